// Encodes images and steps through a turn of the camera.
#include "screenshots.h"

#include <QBuffer>

#include <marrow/atomic_file.h>
#include <marrow/error.h>

namespace marrow::viewer {

void write_png(const QImage& image, const std::filesystem::path& file) {
    QByteArray bytes;
    QBuffer buffer(&bytes);
    buffer.open(QIODevice::WriteOnly);
    if (!image.save(&buffer, "PNG")) throw IoError("cannot encode a PNG of this size; choose a smaller one");
    AtomicFile out(file);
    out.write(bytes.constData(), static_cast<std::size_t>(bytes.size()));
    out.commit();
}

std::filesystem::path turntable_image(const std::filesystem::path& folder, int frame) {
    return folder / QString("frame-%1.png").arg(frame, 4, 10, QChar('0')).toStdString();
}

Turntable::Turntable(SurfaceView& view, int frames, const QSize& size, const QString& folder)
    : QObject(&view), view_(view), frames_(frames), size_(size), folder_(folder), start_(view.camera()) {
    connect(&timer_, &QTimer::timeout, this, &Turntable::step);
    timer_.start(0);
}

// Each angle is from the start, because the user may turn the view in between.
void Turntable::step() {
    try {
        if (frame_ == frames_) return end(tr("Wrote %1 images to %2.").arg(frames_).arg(folder_), false);
        view_.set_camera(start_);
        view_.turn(360.0 * frame_ / frames_);
        write_png(view_.screenshot(size_), turntable_image(folder_.toStdString(), frame_));
        emit progressed(++frame_);
    } catch (const std::exception& error) {
        end(QString::fromUtf8(error.what()), true);
    }
}

void Turntable::cancel() {
    end(tr("Turntable cancelled. Wrote %1 of %2 images to %3.").arg(frame_).arg(frames_).arg(folder_), false);
}

void Turntable::end(const QString& message, bool error) {
    timer_.stop();
    view_.set_camera(start_);
    emit finished(message, error);
    deleteLater();
}

}  // namespace marrow::viewer
