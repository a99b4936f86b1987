// Changes the session and records the changes for undo.
#include "session.h"

#include <algorithm>
#include <cmath>

#include <QUndoCommand>

#include <marrow/tissue_presets.h>

#include "number_text.h"

namespace marrow::viewer {
namespace {

QColor to_colour(const std::array<double, 3>& c) {
    return QColor::fromRgbF(c[0], c[1], c[2]);
}

constexpr std::array<std::array<double, 3>, 5> kColours{
    {{0.55, 0.75, 0.88}, {0.62, 0.80, 0.60}, {0.85, 0.66, 0.83}, {0.90, 0.80, 0.52}, {0.80, 0.55, 0.48}}};

// From air to bone for CT, otherwise nearly all values.
Window default_window(const Scan& scan) {
    if (scan.hounsfield) return {300, 1500};
    const Histogram& h = scan.histogram;
    if (h.counts.empty() || h.upper <= h.lower) return window_of_all_values(h);
    std::int64_t all = 0;
    for (const std::int64_t n : h.counts) all += n;
    const double bin = (h.upper - h.lower) / static_cast<double>(h.counts.size());
    std::int64_t above = 0;
    std::size_t last = h.counts.size();
    while (last > 1 && above < all / 500) above += h.counts[--last];
    const double upper = h.lower + bin * static_cast<double>(last + 1);
    return {(h.lower + upper) / 2, upper - h.lower};
}

}  // namespace

/// One step of undo: the parameters before and after it.
class Change : public QUndoCommand {
  public:
    Change(Session& session, const QString& text, const QString& merge_key, Parameters before,
           Parameters after)
        : QUndoCommand(text),
          session_(session),
          merge_key_(merge_key),
          step_(session.step_),
          before_(std::move(before)),
          after_(std::move(after)) {}

    int id() const override { return 1; }
    void undo() override { session_.restore(before_); }
    void redo() override { session_.restore(after_); }
    bool mergeWith(const QUndoCommand* next) override {
        const auto* other = static_cast<const Change*>(next);
        if (merge_key_.isEmpty() || other->merge_key_ != merge_key_ || other->step_ != step_) return false;
        after_ = other->after_;
        setObsolete(after_ == before_);
        return true;
    }

  private:
    Session& session_;
    QString merge_key_;
    int step_;
    Parameters before_, after_;
};

QString surface_name(const Scan& scan, const SurfaceParameters& surface) {
    if (!surface.name.isEmpty()) return surface.name;
    for (const Preset& preset : kPresets) {
        if (scan.hounsfield && surface.isovalue == preset.isovalue())
            return QString::fromUtf8(preset.name.data(), static_cast<int>(preset.name.size()));
    }
    return scan.otsu == surface.isovalue ? "otsu" : "surface";
}

Window window_of_all_values(const Histogram& h) {
    return {(h.lower + h.upper) / 2, h.upper > h.lower ? h.upper - h.lower : 1};
}

double Measurement::value() const {
    if (points.size() == 2) return length(points[0] - points[1]);
    const Vec3d a = points[0] - points[1], b = points[2] - points[1];
    const double lengths = std::sqrt(dot(a, a) * dot(b, b));
    return lengths > 0 ? std::acos(std::clamp(dot(a, b) / lengths, -1.0, 1.0)) * 180 / M_PI : 0;
}

QString Measurement::text() const {
    return decimal_text(value(), 1) + (points.size() == 2 ? " mm" : "°");
}

const SurfaceParameters* Parameters::find(int id) const {
    const auto it = std::find_if(surfaces.begin(), surfaces.end(), [&](const auto& s) { return s.id == id; });
    return it == surfaces.end() ? nullptr : &*it;
}

SurfaceParameters* Parameters::find(int id) {
    return const_cast<SurfaceParameters*>(std::as_const(*this).find(id));
}

Session::Session(QObject* parent) : QObject(parent) {}

void Session::set_scan(std::shared_ptr<const Scan> scan) {
    scan_ = std::move(scan);
    undo_.clear();
    picked_.clear();
    parameters_ = {};
    const auto& dims = scan_->volume.geometry().dims;
    for (std::size_t a = 0; a < 3; ++a) crosshair_[a] = std::floor(static_cast<double>(dims[a] - 1) / 2);

    SurfaceParameters surface;
    surface.id = next_id_++;
    if (scan_->hounsfield) {
        const Preset* bone = find_preset("bone");
        surface.isovalue = bone->isovalue();
        surface.colour = to_colour(bone->colour);
    } else {
        const Histogram& h = scan_->histogram;
        surface.isovalue = scan_->otsu.value_or((h.lower + h.upper) / 2);
        surface.colour = to_colour(kColours[0]);
    }
    parameters_.surfaces.push_back(surface);
    parameters_.current = surface.id;
    parameters_.window = default_window(*scan_);
    tool_ = Tool::navigate;
    emit scan_changed();
    emit parameters_changed();
    emit crosshair_changed();
    emit picking_changed();
}

void Session::resume(Parameters parameters, const Vec3d& crosshair) {
    const int current = parameters.current;  // as in the file
    for (SurfaceParameters& surface : parameters.surfaces) {
        if (surface.id == current) parameters.current = next_id_;
        surface.id = next_id_++;
    }
    undo_.clear();
    parameters_ = std::move(parameters);
    emit parameters_changed();
    set_crosshair(crosshair);
}

bool Session::has_unsaved_work() const {
    const Parameters& p = parameters_;
    return !undo_.isClean() && (p.surfaces.size() > 1 || p.crop || !p.measurements.empty());
}

void Session::change(const QString& text, const QString& merge_key,
                     const std::function<void(Parameters&)>& edit) {
    if (!scan_) return;
    Parameters after = parameters_;
    edit(after);
    if (after == parameters_) return;
    if (merge_key.isEmpty()) end_step();
    undo_.push(new Change(*this, text, merge_key, parameters_, after));  // also applies it
}

void Session::restore(const Parameters& parameters) {
    parameters_ = parameters;
    emit parameters_changed();
}

void Session::set_isovalue(double isovalue) {
    if (!std::isfinite(isovalue)) return;
    change(tr("isovalue"), QString("isovalue %1").arg(parameters_.current), [&](Parameters& p) {
        if (SurfaceParameters* surface = p.find(p.current)) surface->isovalue = isovalue;
    });
}

void Session::apply_preset(const QString& name) {
    const Preset* preset = find_preset(name.toStdString());
    if (!preset || !scan_ || !scan_->hounsfield) return;
    change(tr("preset %1").arg(name), {}, [&](Parameters& p) {
        SurfaceParameters* surface = p.find(p.current);
        if (!surface) return;
        surface->isovalue = preset->isovalue();
        surface->colour = to_colour(preset->colour);
    });
}

void Session::add_surface(const QString& name, double isovalue, const QColor& colour, double opacity) {
    change(tr("add surface"), {}, [&](Parameters& p) {
        if (p.surfaces.size() >= Parameters::kMostSurfaces) return;
        SurfaceParameters surface;
        surface.id = next_id_++;
        surface.name = name;
        surface.isovalue = isovalue;
        surface.opacity = opacity;
        surface.colour = colour.isValid() ? colour : to_colour(kColours[p.surfaces.size() % kColours.size()]);
        p.current = surface.id;
        p.surfaces.push_back(surface);
    });
}

void Session::remove_surface(int id) {
    change(tr("remove surface"), {}, [&](Parameters& p) {
        if (p.surfaces.size() < 2) return;  // the histogram always needs one
        p.surfaces.erase(std::remove_if(p.surfaces.begin(), p.surfaces.end(),
                                        [&](const auto& surface) { return surface.id == id; }),
                         p.surfaces.end());
        if (!p.find(p.current)) p.current = p.surfaces.back().id;
    });
}

void Session::select_surface(int id) {
    // Selecting is not a step of undo.
    if (!parameters_.find(id) || parameters_.current == id) return;
    end_step();
    parameters_.current = id;
    emit parameters_changed();
}

Vec3d Session::crosshair_position() const {
    return scan_ ? scan_->volume.geometry().physical(crosshair_) : Vec3d{};
}

void Session::set_crosshair(const Vec3d& index) {
    if (!scan_) return;
    Vec3d inside = index;
    const auto& dims = scan_->volume.geometry().dims;
    for (std::size_t a = 0; a < 3; ++a) {
        if (!std::isfinite(index[a])) return;
        inside[a] = std::clamp(index[a], 0.0, static_cast<double>(std::max<std::int64_t>(dims[a] - 1, 0)));
    }
    if (inside == crosshair_) return;
    crosshair_ = inside;
    emit crosshair_changed();
}

SampleBox Session::crop() const {
    return parameters_.crop.value_or(whole_scan());
}

SampleBox Session::whole_scan() const {
    SampleBox box;
    for (std::size_t a = 0; scan_ && a < 3; ++a) box.last[a] = scan_->volume.geometry().dims[a] - 1;
    return box;
}

void Session::move_crop_side(const CropSide& side, double sample) {
    if (!scan_ || !std::isfinite(sample)) return;
    const SampleBox whole = whole_scan();
    SampleBox box = crop();
    const auto a = side.axis;
    const std::int64_t lowest = side.upper ? std::min(box.first[a] + 1, whole.last[a]) : 0;
    const std::int64_t highest = side.upper ? whole.last[a] : std::max<std::int64_t>(box.last[a] - 1, 0);
    (side.upper ? box.last : box.first)[a] = std::clamp(
        std::int64_t{std::llround(std::clamp(sample, -1.0, static_cast<double>(whole.last[a]) + 1))}, lowest,
        highest);
    change(tr("crop"), "crop",
           [&](Parameters& p) { p.crop = box == whole ? std::nullopt : std::optional(box); });
}

void Session::set_tool(Tool tool) {
    tool_ = tool;
    picked_.clear();
    emit picking_changed();
}

void Session::click(const Vec3d& position) {
    if (!scan_) return;
    if (tool_ == Tool::navigate || tool_ == Tool::crop)
        return set_crosshair(index_of(scan_->volume.geometry(), position));
    picked_.push_back(position);
    if (picked_.size() == (tool_ == Tool::distance ? 2u : 3u)) {
        const Measurement measurement{std::move(picked_)};
        picked_.clear();
        change(measurement.points.size() == 2 ? tr("distance") : tr("angle"), {},
               [&](Parameters& p) { p.measurements.push_back(measurement); });
    }
    emit picking_changed();
}

void Session::clear_picked() {
    if (picked_.empty()) return;
    picked_.clear();
    emit picking_changed();
}

}  // namespace marrow::viewer
