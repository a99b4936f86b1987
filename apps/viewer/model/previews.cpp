// Reads the middle slices of series and draws them.
#include "previews.h"

#include <QPainter>

#include <marrow/error.h>
#include <marrow/volume_filters.h>

#include "shared/thumbnail.h"

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

QImage draw(const Volume& slice, const Mat3d& direction) {
    const apps::Thumbnail thumbnail = apps::draw_thumbnail(slice, direction, kSide);
    const QImage image(thumbnail.grey.data(), thumbnail.width, thumbnail.height, thumbnail.width,
                       QImage::Format_Grayscale8);
    QImage picture(kSide, kSide, QImage::Format_RGB32);
    picture.fill(Qt::black);
    QPainter(&picture).drawImage((kSide - image.width()) / 2, (kSide - image.height()) / 2, image);
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
            const Volume slice = middle_slice(input_, options_, report, volume, job_progress);
            // A DICOM image alone does not say how it lies in the patient.
            const Geometry& geometry = report.geometry ? *report.geometry : slice.geometry();
            const QImage picture = draw(slice, geometry.direction);
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
