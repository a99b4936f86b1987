// Posts extractions and measurements to two workers and accepts their results.
#include "surfaces.h"

#include <chrono>
#include <cmath>
#include <new>
#include <utility>

#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkTypeInt32Array.h>

#include <marrow/components.h>
#include <marrow/gpu.h>
#include <marrow/mesh_check.h>
#include <marrow/simplify.h>
#include <marrow/smooth.h>
#include <marrow/trust.h>
#include <marrow/volume_filters.h>

#include "shared/report_progress.h"
#include "shared/surface_warnings.h"

namespace marrow::viewer {
namespace {

constexpr int kPause = 60;                         // ms without a change before full resolution is extracted
constexpr std::int64_t kPreviewSamples = 1500000;  // few enough for an extraction in a few ms
constexpr int kBorrowed = 1;                       // memory that VTK does not free

// Borrows the memory of the report.
void add_trust(const TrustReport& report, vtkPolyData* to) {
    for (const auto& [name, values] :
         {std::pair{kShiftArray, &report.shift}, {kNoiseArray, &report.noise_shift}}) {
        vtkNew<vtkFloatArray> array;
        array->SetName(name);
        array->SetArray(const_cast<float*>(values->data()), static_cast<vtkIdType>(values->size()),
                        kBorrowed);
        to->GetPointData()->AddArray(array);
    }
}

}  // namespace

/// The samples of the surfaces and their extractor. Except for its const members, only the extracting thread
/// uses it.
struct Surfaces::Source {
    const std::shared_ptr<const Scan> scan;
    const std::optional<SampleBox> box;  // none: the entire scan
    const bool open, topology;
    const std::optional<std::size_t> device;  // none: the CPU

    Source(std::shared_ptr<const Scan> the_scan, const std::optional<SampleBox>& crop_box, bool is_open,
           bool has_topology, std::optional<std::size_t> the_device)
        : scan(std::move(the_scan)),
          box(crop_box),
          open(is_open),
          topology(has_topology),
          device(the_device) {}

    Volume cropped;  // empty without a box
    std::optional<gpu::FallbackExtractor> extractor;
    Progress progress;  // of the running job
    TrustOptions trust_options;

    const Volume& samples() const { return box ? cropped : scan->volume; }

    const Mesh& extract(double isovalue, int level, const Progress& job_progress) {
        progress = job_progress;
        if (!extractor) {
            if (box) cropped = crop(scan->volume, box->first, box->last);
            extractor.emplace(samples(),
                              IsosurfaceOptions{.closed = !open,
                                                .topology = topology,
                                                .progress = [this](double f) { return progress(f); }},
                              device);
        }
        return extractor->extract(isovalue, level);
    }

    // After extract(). Noise and step are those of the samples, so that they are found only once.
    TrustReport report_trust(const Mesh& mesh, const Progress& job_progress) {
        trust_options.progress = job_progress;
        trust_options.padding = scan->info.padding;
        if (scan->hounsfield) trust_options.step = 100;
        TrustReport report = marrow::report_trust(samples(), mesh.points, trust_options);
        trust_options.noise = report.noise;
        trust_options.step = report.step;
        return report;
    }
};

vtkSmartPointer<vtkPolyData> to_polydata(const Mesh& mesh) {
    const auto vectors = [](const Buffer<Vec3f>& from, vtkFloatArray* to) {
        to->SetNumberOfComponents(3);
        to->SetArray(const_cast<float*>(reinterpret_cast<const float*>(from.data())),
                     3 * static_cast<vtkIdType>(from.size()), kBorrowed);
    };
    vtkNew<vtkFloatArray> coordinates, normals;
    vectors(mesh.points, coordinates);
    vectors(mesh.normals, normals);
    vtkNew<vtkPoints> points;
    points->SetData(coordinates);
    // VTK's ids are signed. No mesh that can be displayed has 2^31 points.
    vtkNew<vtkTypeInt32Array> corners;
    corners->SetArray(reinterpret_cast<int*>(const_cast<Triangle*>(mesh.triangles.data())),
                      3 * static_cast<vtkIdType>(mesh.triangles.size()), kBorrowed);
    vtkNew<vtkCellArray> triangles;
    triangles->SetData(3, corners);

    auto result = vtkSmartPointer<vtkPolyData>::New();
    result->SetPoints(points);
    result->GetPointData()->SetNormals(normals);
    result->SetPolys(triangles);
    result->ComputeBounds();  // now, so that drawing need not
    return result;
}

Surfaces::Surfaces(Session& session, std::optional<std::size_t> device, QObject* parent)
    : QObject(parent), session_(session), device_(device) {
    pause_.setSingleShot(true);
    connect(&pause_, &QTimer::timeout, this, &Surfaces::settle);
    connect(&session_, &Session::parameters_changed, this, &Surfaces::follow);
}

Surfaces::~Surfaces() = default;

std::shared_ptr<const Shape> Surfaces::shape(int id) const {
    const auto it = states_.find(id);
    return it == states_.end() ? nullptr : it->second.newest;
}

std::shared_ptr<const Shape> Surfaces::preview(int id) const {
    const auto it = states_.find(id);
    return it == states_.end() ? nullptr : it->second.preview;
}

std::shared_ptr<const Shape> Surfaces::exact(int id) const {
    const auto it = states_.find(id);
    return it == states_.end() || !it->second.exact ? nullptr : it->second.newest;
}

std::vector<int> Surfaces::unfinished() const {
    std::vector<int> ids;
    for (const SurfaceParameters& surface : session_.parameters().surfaces) {
        if (surface.visible && !exact(surface.id)) ids.push_back(surface.id);
    }
    return ids;
}

QString Surfaces::failure(int id) const {
    const auto it = states_.find(id);
    return it == states_.end() ? QString() : it->second.failure;
}

bool Surfaces::settled() const {
    for (const auto& [id, state] : states_) {
        if (!state.exact || !state.newest->measures) return false;
    }
    return !states_.empty();
}

QString Surfaces::device_name() const {
    return uses_device() ? QString::fromStdString(gpu::devices().at(*device_).name) : "CPU";
}

// The source goes on with the CPU by itself. Others of this scan start with it.
void Surfaces::give_up_device(const std::shared_ptr<const Scan>& scan, const QString& reason) {
    if (device_failed_ || scan != session_.shared_scan()) return;
    device_failed_ = true;
    preview_level_ = needed_preview_level();
    emit device_changed(reason);
}

// On a device the surface follows the isovalue in full resolution, unless smoothing or reduction take longer
// than that.
int Surfaces::needed_preview_level() const {
    if (uses_device() && refinement_.smooth == 0 && refinement_.keep == 100) return 0;
    const SampleBox box = session_.crop();
    std::int64_t samples = 1;
    for (std::size_t a = 0; a < 3; ++a) samples *= box.last[a] - box.first[a] + 1;
    int level = 0;
    for (; samples > kPreviewSamples; samples /= 8) ++level;
    return level;
}

// Devices have no exact topology.
bool Surfaces::uses_device() const {
    return device_ && !device_failed_ && !session_.parameters().topology;
}

// Requests the surfaces whose parameters have changed.
void Surfaces::follow() {
    const Parameters& p = session_.parameters();
    const std::shared_ptr<const Scan> scan = session_.shared_scan();
    const bool new_scan = !source_ || source_->scan != scan;
    const bool used_device = source_ && source_->device && !device_failed_;
    const bool new_source =
        new_scan || source_->open != p.open || source_->topology != p.topology || source_->box != p.crop;
    const Refinement refinement{p.largest, p.components, p.smooth, p.keep};
    const bool with_trust = p.colouring != Colouring::own;
    const bool everything = new_source || refinement != refinement_ || (with_trust && !with_trust_);
    if (new_scan) {
        extracting_.forget_all();
        measuring_.forget_all();
        device_failed_ = false;
    }
    if (new_source)
        source_ = std::make_shared<Source>(scan, p.crop, p.open, p.topology,
                                           uses_device() ? device_ : std::nullopt);
    refinement_ = refinement;
    with_trust_ = with_trust;
    preview_level_ = needed_preview_level();
    if (uses_device() != used_device) emit device_changed({});

    for (auto it = states_.begin(); it != states_.end();) {
        const int id = it->first;
        ++it;
        if (p.find(id)) continue;
        for (const int urgency : {0, 1, 2})
            extracting_.forget({urgency, id}), measuring_.forget({urgency, id});
        states_.erase(id);
        emit removed(id);
    }
    for (const SurfaceParameters& surface : p.surfaces) {
        const auto it = states_.find(surface.id);
        if (everything || it == states_.end() || it->second.isovalue != surface.isovalue)
            request(surface.id, surface.isovalue);
    }
}

void Surfaces::request(int id, double isovalue) {
    State& state = states_[id];
    state.isovalue = isovalue;
    state.request = ++requests_;
    state.exact = false;
    state.failure.clear();
    if (preview_level_ == 0) {
        extracting_.forget({0, id});
        state.preview.reset();
        state.waits = false;
        return post(id, 0);
    }
    extracting_.forget({1, id});
    state.waits = true;
    post(id, preview_level_);
    pause_.start(kPause);
}

// The steps of the command line, in its order. Previews are neither smoothed nor reduced: their triangles are
// larger, so it would be to another effect.
Mesh Surfaces::refine(const Mesh& extracted, const Refinement& refinement, bool preview,
                      const Progress& progress, std::vector<std::string>& warnings) {
    const auto warn = [&](const char* step, const std::optional<std::string>& warning) {
        if (warning) warnings.push_back(std::string(step) + ": " + *warning);
    };
    Mesh mesh = extracted;
    if (refinement.largest)
        mesh = keep_components(mesh, {.count = 1, .cavities = false});
    else if (refinement.components > 0)
        mesh = keep_components(mesh, {.count = refinement.components});
    if (refinement.smooth > 0 && !preview) {
        SmoothStats stats;
        mesh = smooth(mesh, {.iterations = refinement.smooth, .progress = progress}, &stats);
        warn("smooth", apps::unsmoothed_components_warning(stats.restored_components));
    }
    if (refinement.keep < 100 && !preview) {
        const auto triangles = static_cast<double>(mesh.triangles.size());
        const std::int64_t requested = std::llround(refinement.keep / 100.0 * triangles);
        mesh = simplify(mesh, {.triangles = requested, .progress = progress});
        warn("reduce",
             apps::unfinished_reduction_warning(requested, static_cast<std::int64_t>(mesh.triangles.size())));
    }
    return mesh;
}

void Surfaces::settle() {
    pause_.stop();
    for (auto& [id, state] : states_) {
        if (!state.waits) continue;
        state.waits = false;
        post(id, 0);
    }
}

// The job, which shows why it fails instead of ending the program.
Worker::Job Surfaces::guarded(int id, Worker::Job job) {
    return [this, id, request = states_[id].request, job = std::move(job)](const Progress& job_progress) {
        const auto fail = [&](const QString& reason) {
            QMetaObject::invokeMethod(
                this,
                [=, this] {
                    const auto it = states_.find(id);
                    if (it != states_.end() && it->second.request == request) it->second.failure = reason;
                    emit failed(reason);
                },
                Qt::QueuedConnection);
        };
        try {
            job(job_progress);
        } catch (const Cancelled&) {
            throw;
        } catch (const std::bad_alloc&) {
            fail(tr("Not enough memory for this surface. Crop the scan and try again."));
        } catch (const std::exception& error) {
            fail(QString::fromUtf8(error.what()));
        }
    };
}

void Surfaces::post(int id, int level) {
    const State& state = states_[id];
    const auto job = [this, id, level, request = state.request, isovalue = state.isovalue,
                      refinement = refinement_, with_trust = with_trust_,
                      source = source_](const Progress& job_progress) {
        auto shape = std::make_shared<Shape>();
        const auto start = std::chrono::steady_clock::now();
        const Mesh& extracted = source->extract(isovalue, level, job_progress);
        shape->milliseconds =
            std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
        // What waits for the window must not hold the source, whose samples may be on the device: the next
        // source might not have room beside it.
        if (const std::string& failure = source->extractor->failure(); !failure.empty())
            QMetaObject::invokeMethod(
                this,
                [this, scan = source->scan, reason = QString::fromStdString(failure)] {
                    give_up_device(scan, reason);
                },
                Qt::QueuedConnection);
        apps::report(job_progress, 1);
        shape->isovalue = isovalue;
        shape->level = level;
        shape->mesh =
            std::make_shared<Mesh>(refine(extracted, refinement, level > 0, job_progress, shape->warnings));
        shape->polydata = to_polydata(*shape->mesh);
        if (with_trust) {
            shape->trust = source->report_trust(*shape->mesh, job_progress);
            add_trust(*shape->trust, shape->polydata);
        }
        QMetaObject::invokeMethod(
            this, [this, id, request, scan = source->scan, shape] { accept(id, request, scan, shape); },
            Qt::QueuedConnection);
    };
    extracting_.post({level > 0 ? 0 : 1, id}, guarded(id, job));
}

void Surfaces::accept(int id, int request, const std::shared_ptr<const Scan>& scan,
                      std::shared_ptr<Shape> shape) {
    const auto it = states_.find(id);
    if (it == states_.end() || scan != source_->scan) return;  // the surface or the scan is gone
    State& state = it->second;
    const bool newest = request == state.request;
    if (shape->level == 0 && preview_level_ > 0 && !newest) return;  // newer previews have replaced it
    if (state.exact && shape->level > 0) return;
    state.newest = shape;
    if (shape->level > 0) state.preview = shape;
    state.exact = newest && shape->level == 0;
    state.failure.clear();
    emit shape_changed(id);
    post_measure(id, std::move(shape));
}

void Surfaces::post_measure(int id, std::shared_ptr<Shape> shape) {
    const int urgency = shape->level > 0 ? 0 : 1;
    measuring_.forget({2, id});
    if (urgency == 0) measuring_.forget({1, id});
    measuring_.forget({urgency, id});
    const auto job = [this, id, shape](const Progress& job_progress) {
        apps::report(job_progress, 0);
        const MeshMeasures measures = measure(*shape->mesh);
        QMetaObject::invokeMethod(
            this,
            [=, this] {
                shape->measures = measures;
                const auto it = states_.find(id);
                if (it == states_.end() || it->second.newest != shape) return;
                emit measured(id);
                if (shape->level == 0 && (refinement_.smooth > 0 || refinement_.keep < 100))
                    post_check(id, shape);
            },
            Qt::QueuedConnection);
    };
    measuring_.post({urgency, id}, guarded(id, job));
}

// Last of all, because it takes the longest.
void Surfaces::post_check(int id, const std::shared_ptr<Shape>& shape) {
    const auto job = [this, id, shape](const Progress& job_progress) {
        const std::int64_t found = check_mesh(*shape->mesh, {.progress = job_progress}).self_intersections;
        QMetaObject::invokeMethod(
            this,
            [=, this] {
                shape->self_intersections = found;
                const auto it = states_.find(id);
                if (it != states_.end() && it->second.newest == shape) emit measured(id);
            },
            Qt::QueuedConnection);
    };
    measuring_.post({2, id}, guarded(id, job));
}

}  // namespace marrow::viewer
