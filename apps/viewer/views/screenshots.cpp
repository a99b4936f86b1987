// Encodes images, waits for surfaces and steps through a turn of the camera.
#include "screenshots.h"

#include <utility>

#include <QBuffer>

#include <marrow/atomic_file.h>
#include <marrow/error.h>

namespace marrow::viewer {
namespace {

constexpr int kWait = 20;  // ms until a picture looks again whether the surfaces are ready

}  // namespace

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

Pictures::Pictures(SurfaceView& view, Surfaces& surfaces, int frames, const QSize& size, Use use)
    : QObject(&view), view_(view), surfaces_(surfaces), frames_(frames), size_(size), use_(std::move(use)) {
    timer_.setSingleShot(true);
    connect(&timer_, &QTimer::timeout, this, &Pictures::step);
}

// Each angle is from the start, because the user may turn the view in between.
void Pictures::step() {
    const std::vector<int> unfinished = surfaces_.unfinished();
    for (const int id : unfinished) {
        if (const QString failure = surfaces_.failure(id); !failure.isEmpty()) return end(failure);
    }
    if (!unfinished.empty()) {
        surfaces_.settle();
        timer_.start(kWait);
        if (!std::exchange(waiting_, true)) emit waiting();
        return;
    }
    waiting_ = false;
    if (!start_) start_ = view_.camera();
    try {
        view_.set_camera(*start_);
        view_.turn(360.0 * frame_ / frames_);
        use_(view_.screenshot(size_), frame_);
    } catch (const std::exception& error) {
        return end(QString::fromUtf8(error.what()));
    }
    if (++frame_ == frames_) return end({});
    timer_.start(0);
    emit progressed(frame_);
}

void Pictures::end(const QString& error) {
    timer_.stop();
    if (start_) view_.set_camera(*start_);
    emit finished(frame_, error);
    deleteLater();
}

}  // namespace marrow::viewer
