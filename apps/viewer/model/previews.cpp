// Reads the middle slices of series and draws them.
#include "previews.h"

#include <algorithm>
#include <cmath>

#include <QPainter>

#include <marrow/error.h>
#include <marrow/histogram.h>
#include <marrow/volume_filters.h>

#include "distribution.h"

namespace marrow::viewer {
namespace {

constexpr int kSide = 144;  // pixels; sharp on screens with twice the usual resolution

// A DICOM series is made of images, of which one suffices. Everything else is read as a whole.
Volume middle_slice(const std::filesystem::path& input, ScanOptions options, const SeriesReport& report,
                    std::int64_t volume, const Progress& progress) {
    if (!report.middle_slices.empty())
        return read_dicom_image(report.middle_slices[static_cast<std::size_t>(volume)], progress);
    if (!report.series.id.empty()) options.series = report.series.id;
    if (report.volume_count > 1) options.volume = volume;
    options.threads = 1;  // the window needs the others
    options.progress = progress;
    const Volume scan = read_scan(input, options);
    const auto [nx, ny, nz] = scan.geometry().dims;
    return crop(scan, {0, 0, nz / 2}, {nx - 1, ny - 1, nz / 2});
}

QImage draw(const Volume& slice) {
    const Geometry& geometry = slice.geometry();
    QImage samples(static_cast<int>(geometry.dims[0]), static_cast<int>(geometry.dims[1]),
                   QImage::Format_Grayscale8);
    const ValueRange range = usual_range(histogram(slice));
    visit_sample_type(slice.type(), [&](auto type) {
        const auto* from = slice.samples<decltype(type)>();
        for (int y = 0; y < samples.height(); ++y) {
            uchar* to = samples.scanLine(y);
            for (int x = 0; x < samples.width(); ++x, ++from) {
                const double grey =
                    255 * (static_cast<double>(*from) - range.lower) / (range.upper - range.lower);
                to[x] = static_cast<uchar>(std::isfinite(grey) ? std::clamp(grey, 0.0, 255.0) : 0);
            }
        }
    });
    QSizeF size(samples.width() * geometry.spacing[0], samples.height() * geometry.spacing[1]);
    size.scale(kSide, kSide, Qt::KeepAspectRatio);
    QImage picture(kSide, kSide, QImage::Format_RGB32);
    picture.fill(Qt::black);
    QPainter painter(&picture);
    painter.setRenderHint(QPainter::SmoothPixmapTransform);
    painter.drawImage(QRectF(QPointF((kSide - size.width()) / 2, (kSide - size.height()) / 2), size),
                      samples);
    return picture;
}

}  // namespace

Previews::Previews(std::filesystem::path input, const ScanOptions& options, QObject* parent)
    : QObject(parent), input_(std::move(input)), options_(options) {}

void Previews::request(int series, const SeriesReport& report, std::int64_t volume) {
    const Worker::Key key{0, series};
    worker_.forget(key);
    worker_.post(key, [=, this](const Progress& job_progress) {
        try {
            const QImage picture = draw(middle_slice(input_, options_, report, volume, job_progress));
            QMetaObject::invokeMethod(
                this, [this, series, picture] { emit made(series, picture); }, Qt::QueuedConnection);
        } catch (const Cancelled&) {
            throw;
        } catch (const std::exception&) {
            // The list tells why the series cannot be read.
        }
    });
}

}  // namespace marrow::viewer
