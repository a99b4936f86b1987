// Pictures of the 3D view as PNG files.
#pragma once

#include <filesystem>

#include <QTimer>

#include "surface_view.h"

namespace marrow::viewer {

/// \throw IoError where the picture cannot be made or written
void write_png(const QImage& image, const std::filesystem::path& file);

/// Writes frame-0000.png, frame-0001.png, ... of one turn into a folder: one for each turn of the event loop, so that the
/// window stays alive. Deletes itself at the end.
class Turntable : public QObject {
    Q_OBJECT
  public:
    Turntable(SurfaceView& view, int frames, const QSize& size, const QString& folder);

  signals:
    void progressed(int frame);
    void finished(const QString& sentence, bool error);

  private:
    void step();

    SurfaceView& view_;
    const int frames_;
    const QSize size_;
    const QString folder_;
    int frame_ = 0;
    QTimer timer_;
};

}  // namespace marrow::viewer
