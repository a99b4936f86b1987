/// Saves screenshots of the 3D view as PNG files.
#pragma once

#include <filesystem>

#include <QTimer>

#include "surface_view.h"

namespace marrow::viewer {

/// Writes an image as a PNG file. \throw IoError if it cannot be encoded or written
void write_png(const QImage& image, const std::filesystem::path& file);

/// The file of one image of a turntable: frame-0000.png, frame-0001.png, ...
std::filesystem::path turntable_image(const std::filesystem::path& folder, int frame);

/// Writes one full turn as images into a folder. Draws one frame per iteration
/// of the event loop, so that the window stays responsive. Restores the view and deletes itself at the end.
class Turntable : public QObject {
    Q_OBJECT
  public:
    Turntable(SurfaceView& view, int frames, const QSize& size, const QString& folder);

    /// Stops and then emits `finished`. The images that are complete stay.
    void cancel();

  signals:
    void progressed(int frame);
    void finished(const QString& message, bool error);

  private:
    void step();
    void end(const QString& message, bool error);

    SurfaceView& view_;
    const int frames_;
    const QSize size_;
    const QString folder_;
    const CameraState start_;
    int frame_ = 0;
    QTimer timer_;
};

}  // namespace marrow::viewer
