/// Saves screenshots of the 3D view as PNG files.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>

#include <QTimer>

#include "surface_view.h"

namespace marrow::viewer {

/// Writes an image as a PNG file. \throw IoError if it cannot be encoded or written
void write_png(const QImage& image, const std::filesystem::path& file);

/// The file of one image of a turntable: frame-0000.png, frame-0001.png, ...
std::filesystem::path turntable_image(const std::filesystem::path& folder, int frame);

/// Takes one picture of the 3D view, or several in one full turn. Each waits until all visible surfaces are
/// in full resolution. There is at most one per iteration of the event loop, so that the window stays
/// responsive. Restores the view and deletes itself at the end.
class Pictures : public QObject {
    Q_OBJECT
  public:
    using Use = std::function<void(const QImage& picture, int frame)>;
    /// Gives each picture, of `size` in pixels, to `use`, which may throw.
    Pictures(SurfaceView& view, Surfaces& surfaces, int frames, const QSize& size, Use use);

    /// Takes the first picture at once if the surfaces are ready.
    void start() { step(); }
    /// Stops and then emits `finished`. The pictures that are taken stay.
    void cancel() { end({}); }
    int frames() const { return frames_; }

  signals:
    void waiting();  ///< for the surfaces
    void progressed(int frames);
    /// `error` is why there are not more pictures; it is empty if all are taken or the user cancelled.
    void finished(int frames, const QString& error);

  private:
    void step();
    void end(const QString& error);

    SurfaceView& view_;
    Surfaces& surfaces_;
    const int frames_;
    const QSize size_;
    const Use use_;
    std::optional<CameraState> start_;  // where the turn starts; nothing before the first picture
    int frame_ = 0;
    bool waiting_ = false;
    QTimer timer_;
};

}  // namespace marrow::viewer
