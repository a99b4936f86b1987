// Writes mesh files on a worker thread and reports to the thread of the window.
#include "mesh_writer.h"

#include <algorithm>
#include <chrono>
#include <new>

#include <marrow/isosurface.h>
#include <marrow/thin_walls.h>
#include <marrow/tissue_presets.h>
#include <marrow/trust.h>
#include <marrow/volume_filters.h>

#include "shared/library_options.h"
#include "shared/output_checks.h"
#include "shared/surface_trust.h"
#include "shared/surface_warnings.h"

namespace marrow::viewer {
namespace {

// Walls of bone are looked for beside the surface as it was extracted. The first search estimates the noise
// of the scan.
std::optional<ThinWalls> thin_walls_of(const MeshWriter::File& file, const Volume& scan,
                                       const MeshWriter::Source& source, std::optional<NoiseEstimate>& noise,
                                       const Progress& progress) {
    if (file.object.name != "bone") return {};
    if (!noise) noise = estimate_noise(scan, {.padding = source.scan->info.padding, .progress = progress});
    Mesh extracted;
    if (source.refined)
        extracted =
            extract_isosurface(scan, file.shape->isovalue,
                               {.closed = !source.open, .topology = source.topology, .progress = progress});
    const Mesh& mesh = source.refined ? extracted : *file.shape->mesh;
    return find_thin_walls(
        scan, file.shape->isovalue, mesh,
        {.noise = noise->sigma, .padding = source.scan->info.padding, .progress = progress});
}

// The warnings that the command line would give, one per line. `walls` has those beside each file's surface,
// which were found with `noise`.
QString warnings_of(const std::vector<MeshWriter::File>& files,
                    const std::vector<std::optional<ThinWalls>>& walls,
                    const std::optional<NoiseEstimate>& noise, const Volume& scan,
                    const MeshWriter::Source& source, Space space) {
    std::vector<apps::MeshFile> meshes;
    double lowest = files.front().shape->isovalue;
    for (const MeshWriter::File& file : files) {
        meshes.push_back({file.object.mesh, file.path});
        lowest = std::min(lowest, file.shape->isovalue);
    }
    QStringList lines;
    const auto add = [&](const std::optional<std::string>& warning) {
        if (warning) lines << QString::fromStdString(apps::name_flags(*warning));
    };
    const ScanInfo& info = source.scan->info;
    const Histogram samples = source.crop ? histogram(scan) : source.scan->histogram;
    const bool presets = std::any_of(files.begin(), files.end(), [](const MeshWriter::File& file) {
        return find_preset(file.object.name) != nullptr;
    });
    const bool hounsfield = presets || (source.trust && source.scan->hounsfield);
    if (hounsfield && info.series.modality.empty())
        add(apps::assumed_hounsfield_warning(info.format, samples.lower));
    for (const MeshWriter::File& file : files)
        for (const std::string& warning : file.shape->warnings) add(warning);
    add(apps::non_finite_warning(samples.non_finite_samples));
    add(apps::large_coordinates_warning(meshes, scan.geometry()));
    if (!source.open) add(apps::border_warning(lowest, scan));
    for (std::size_t i = 0; i < files.size(); ++i)
        if (walls[i])
            add(apps::thin_walls_warning(*walls[i], noise->windows > 0, files[i].shape->isovalue, space));
    return lines.join('\n');
}

// Refuses files that the scan was read from.
void check_files(const std::vector<MeshWriter::File>& files, const Scan& scan) {
    std::vector<std::filesystem::path> paths;
    for (const MeshWriter::File& file : files) {
        apps::check_output(file.path, scan.input);
        paths.push_back(file.path);
    }
    apps::check_not_read(paths, scan.info.series.dicom_files);
}

}  // namespace

void MeshWriter::write(std::vector<File> files, Space space, Source source) {
    busy_ = true;
    cancelled_ = false;
    emit started();
    const auto end = [this](const QString& message, bool error, const QString& warnings = {}) {
        QMetaObject::invokeMethod(
            this,
            [=, this] {
                busy_ = false;
                emit finished(message, error, warnings);
            },
            Qt::QueuedConnection);
    };
    worker_.post({0, 0}, [=, this, files = std::move(files),
                          source = std::move(source)](const Progress& job_progress) {
        auto last_report = std::chrono::steady_clock::now();
        std::size_t done = 0;
        const Progress progress = [&](double fraction) {
            const auto now = std::chrono::steady_clock::now();
            if (now - last_report > std::chrono::milliseconds(30)) {
                last_report = now;
                const double all = (static_cast<double>(done) + fraction) / static_cast<double>(files.size());
                QMetaObject::invokeMethod(
                    this, [this, all] { emit progressed(all); }, Qt::QueuedConnection);
            }
            return !cancelled_ && job_progress(fraction);
        };
        try {
            check_files(files, *source.scan);
            const Volume& whole = source.scan->volume;
            Volume part;
            if (source.crop) part = crop(whole, source.crop->first, source.crop->last);
            const Volume& scan = source.crop ? part : whole;
            std::vector<std::optional<ThinWalls>> walls;
            std::optional<NoiseEstimate> noise;
            MeshFiles set;
            for (; done < files.size(); ++done) {
                const File& file = files[done];
                walls.push_back(thin_walls_of(file, scan, source, noise,
                                              [&](double) { return !cancelled_ && job_progress(0); }));
                const ThinWalls* const found = walls.back() ? &*walls.back() : nullptr;
                MeshObject object = file.object;
                apps::SurfaceTrust trust;
                if (source.trust) {
                    trust = apps::surface_trust(file.shape->trust.value(), source.scan->hounsfield, scan,
                                                file.shape->mesh->points, found);
                    apps::add_trust(trust, found ? ThinWallState::found : ThinWallState::unknown, object);
                }
                set.write({&object, 1}, file.path,
                          {.space = space,
                           .progress = progress,
                           .scan_files = source.scan->info.series.dicom_files});
            }
            const QString warnings = warnings_of(files, walls, noise, scan, source, space);
            set.commit();
            const QString first = QString::fromStdString(files.front().path.string());
            end(files.size() > 1 ? tr("Wrote %1 and %2 more.").arg(first, QString::number(files.size() - 1))
                                 : tr("Wrote %1.").arg(first),
                false, warnings);
        } catch (const Cancelled&) {
            end(tr("Export cancelled. No file was changed."), false);
        } catch (const std::bad_alloc&) {
            end(tr("Not enough memory for this export. Crop the scan and try again."), true);
        } catch (const std::exception& error) {
            end(QString::fromUtf8(error.what()), true);
        }
    });
}

}  // namespace marrow::viewer
