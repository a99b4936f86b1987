// Turns results into JSON with nlohmann-json.
#include "json_report.h"

#include <sys/resource.h>

#include <functional>

#include <nlohmann/json.hpp>

#include "info_report.h"
#include "shared/library_options.h"
#include "shared/orientation.h"
#include "shared/series_summary.h"
#include "steps.h"

namespace marrow::apps {
namespace {

using Json = nlohmann::ordered_json;

Json text_or_null(const std::string& text) {
    return text.empty() ? Json() : Json(text);
}

// File and series names may hold bytes that are not UTF-8.
std::string to_text(const Json& json) {
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

// Messages of the library, with the flags of the command line.
Json message_list(const std::vector<std::string>& messages) {
    Json list = Json::array();
    for (const std::string& message : messages) list.push_back(name_flags(message));
    return list;
}

void add_failure(const Failure& failure, Json& json) {
    json["error"] = name_flags(failure.error);
    json["exit_code"] = failure.exit_code;
}

// One object for one input; for several, an array of this name and the failure that decides the exit code.
template <class Found, class ToJson>
std::string list_json(const char* name, const std::vector<Found>& inputs, const ToJson& to_json) {
    if (inputs.size() == 1) return to_text(to_json(inputs.front()));
    Json json{{name, Json::array()}};
    for (const Found& input : inputs) json[name].push_back(to_json(input));
    if (const Failure* failure = decisive_failure(inputs)) add_failure(*failure, json);
    return to_text(json);
}

// The bounding box in the space that is written. RAS negates x and y, which swaps their ends.
Json bounds(const MeshMeasures& m, Space space) {
    if (space != Space::RAS) return {m.lower, m.upper};
    return {Vec3f{-m.upper[0], -m.upper[1], m.lower[2]}, Vec3f{-m.lower[0], -m.lower[1], m.upper[2]}};
}

// An open surface has none.
Json volume_of(const MeshMeasures& m) {
    return m.boundary_edges == 0 ? Json(m.volume) : Json();
}

Json step_numbers(const StepReport& step) {
    const auto pair = [](auto before, auto after) { return Json{before, after}; };
    const auto distance = [](const std::optional<MeshDistance>& d) {
        return d ? Json{{"max", d->max}, {"mean", d->mean}} : Json();
    };
    const MeshMeasures &before = step.before.measures.value(), &after = step.after.measures.value();
    return {{"step", step.name},
            {"triangles", pair(before.triangles, after.triangles)},
            {"components", pair(before.components, after.components)},
            {"boundary_edges", pair(before.boundary_edges, after.boundary_edges)},
            {"nonmanifold_edges", pair(before.nonmanifold_edges, after.nonmanifold_edges)},
            {"volume_mm3", pair(volume_of(before), volume_of(after))},
            {"area_mm2", pair(before.area, after.area)},
            {"deviation_mm", distance(step.deviation)},
            {"moved_mm", distance(step.moved)},
            {"held_back", step.held_back}};
}

Json trust_numbers(const SurfaceTrust& trust) {
    const auto percentiles = [](const TrustPercentiles& p) {
        return Json{{"median", p.median},
                    {"percentile_90", p.percentile_90},
                    {"percentile_99", p.percentile_99},
                    {"capped_points", p.capped}};
    };
    const TrustReport& report = trust.report;
    const NoiseEstimate& noise = report.noise;
    const auto if_known = [&](const Json& number) { return noise.windows > 0 ? number : Json(); };
    return {{"isovalue_step", report.step},
            {"shift_mm", percentiles(report.shifts)},
            {"noise_mm", if_known(percentiles(report.noise_shifts))},
            {"cap_mm", report.cap},
            {"border_points", report.border_points},
            {"noise",
             {{"estimator", "lower of local_deviation and slices, in windows of tissue"},
              {"sigma", if_known(noise.sigma)},
              {"lowest", if_known(noise.lowest)},
              {"highest", if_known(noise.highest)},
              {"local_deviation", if_known(noise.local_deviation)},
              {"slices", noise.slices ? Json(*noise.slices) : Json()},
              {"laplacian", if_known(noise.laplacian)},
              {"windows", noise.windows}}}};
}

Json thin_wall_numbers(const VanishedWalls& walls, Space space) {
    constexpr std::size_t kMostPlaces = 100;
    Json json{
        {"area_mm2", walls.found.area}, {"restored", walls.restored}, {"places", walls.found.walls.size()}};
    json["largest"] = Json::array();
    for (const ThinWall& wall : walls.found.walls) {
        if (json["largest"].size() == kMostPlaces) break;
        const double sign = space == Space::RAS ? -1 : 1;
        json["largest"].push_back(
            {{"position_mm", {sign * wall.position[0], sign * wall.position[1], wall.position[2]}},
             {"area_mm2", wall.area}});
    }
    return json;
}

Json surface_numbers(const Surface& surface, Space space) {
    const auto [points, triangles] = surface.size();
    Json numbers;
    if (surface.label)
        numbers.update({{"label", *surface.label},
                        {"samples", surface.label_volume.samples},
                        {"samples_mm3", surface.label_volume.samples_mm3},
                        {"held_back", surface.held_back}});
    else
        numbers["isovalue"] = surface.isovalue;
    numbers.update({{"points", points}, {"triangles", triangles}, {"device", surface.device}});
    if (!surface.measures) {  // a surface that was written slab by slab
        for (const char* name :
             {"components", "pieces", "cavities", "boundary_edges", "nonmanifold_edges",
              "euler_characteristic", "area_mm2", "volume_mm3", "bounds_mm", "trust", "thin_walls", "steps"})
            numbers[name] = Json();
        return numbers;
    }
    const MeshMeasures& m = *surface.measures;
    numbers.update({{"components", m.components},
                    {"pieces", m.components - m.cavities},
                    {"cavities", m.cavities},
                    {"boundary_edges", m.boundary_edges},
                    {"nonmanifold_edges", m.nonmanifold_edges},
                    {"euler_characteristic", m.euler_characteristic},
                    {"area_mm2", m.area},
                    {"volume_mm3", volume_of(m)},
                    {"bounds_mm", bounds(m, space)}});
    numbers["trust"] = surface.trust ? trust_numbers(*surface.trust) : Json();
    numbers["thin_walls"] = surface.thin_walls ? thin_wall_numbers(*surface.thin_walls, space) : Json();
    numbers["steps"] = Json::array();
    for (const StepReport& step : surface.steps) numbers["steps"].push_back(step_numbers(step));
    return numbers;
}

std::int64_t peak_memory_bytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return std::int64_t{usage.ru_maxrss} * 1024;
}

Json number_or_null(double value) {
    return value > 0 ? Json(value) : Json();
}

Json seconds_numbers(const StageSeconds& seconds) {
    return {{"read", seconds.read},     {"filter", seconds.filter}, {"extract", seconds.extract},
            {"refine", seconds.refine}, {"write", seconds.write},   {"verify", seconds.verify},
            {"total", seconds.total}};
}

Json scan_bounds(const Geometry& geometry) {
    const Box box = apps::bounds(geometry);
    return {box.lower, box.upper};
}

Json sample_numbers(const SampleReport& samples) {
    Json json{{"type", sample_type_name(samples.type)},
              {"lower", samples.finite > 0 ? Json(samples.lower) : Json()},
              {"upper", samples.finite > 0 ? Json(samples.upper) : Json()},
              {"may_be_hounsfield_units", samples.may_be_hounsfield},
              {"rescale", {{"slope", samples.rescale.slope}, {"intercept", samples.rescale.intercept}}}};
    json["labels"] = Json::array();
    for (const auto& [label, count, name] : samples.labels)
        json["labels"].push_back(
            {{"label", label}, {"name", name ? Json(*name) : Json()}, {"samples", count}});
    return json;
}

Json series_numbers(const SeriesReport& s, bool show_patient) {
    const Vec3d& spacing = s.series.spacing;
    Json one{
        {"series", text_or_null(s.series.id)},
        {"description", text_or_null(s.series.description)},
        {"modality", text_or_null(s.series.modality)},
        {"dims", s.series.dims},
        {"spacing_mm", {number_or_null(spacing[0]), number_or_null(spacing[1]), number_or_null(spacing[2])}},
        {"files", s.series.files},
        {"volumes", s.volumes},
        {"levels", s.levels},
        {"tilt_degrees", s.tilt},
        {"gaps", s.gaps},
        {"series_number", s.number ? Json(*s.number) : Json()},
        {"image_type", text_or_null(s.image_type)},
        {"echo_time_ms", s.echo_time ? Json(*s.echo_time) : Json()},
        {"kernel", text_or_null(s.kernel)},
        {"plane", s.geometry ? Json(plane_name(s.geometry->direction)) : Json()},
        {"origin_mm", s.geometry ? Json(s.geometry->origin) : Json()},
        {"direction", s.geometry ? Json(s.geometry->direction) : Json()},
        {"bounds_mm", s.geometry ? scan_bounds(*s.geometry) : Json()},
        {"hounsfield_units", s.hounsfield ? Json(*s.hounsfield) : Json()},
        {"smallest_feature_mm", s.smallest_feature ? Json(*s.smallest_feature) : Json()},
        {"memory_bytes", s.memory},
        {"not_stated", unknown_facts(s)},
        {"warnings", message_list(s.warnings)},
        {"refused", s.refusal ? Json(name_flags(*s.refusal)) : Json()}};
    if (show_patient) one["patient"] = text_or_null(s.patient_name);
    return one;
}

Json finding_numbers(const Finding& finding, bool show_patient) {
    Json json{{"input", finding.input.string()}};
    if (finding.failure) {
        json["refused"] = name_flags(finding.failure->error);
        add_failure(*finding.failure, json);
    }
    if (!finding.report) return json;
    const ScanReport& report = *finding.report;
    if (!finding.failure) json["refused"] = report.chosen ? Json() : Json(name_flags(report.reason));
    json["format"] = scan_format_name(report.format);
    json["files"] = report.files;
    json["chosen"] = report.chosen ? Json(*report.chosen) : Json();
    json["reason"] = report.chosen ? Json(report.reason) : Json();
    json["warnings"] = message_list(report.warnings);
    json["series"] = Json::array();
    for (const SeriesReport& s : report.series) json["series"].push_back(series_numbers(s, show_patient));
    json["values"] = finding.samples ? sample_numbers(*finding.samples) : Json();
    return json;
}

Json check_numbers(const CheckedObject& object, Space space, double min_wall) {
    const MeshCheck& c = object.found;
    const MeshMeasures& m = c.measures;
    Json json{{"sound", c.is_sound()},
              {"closed", c.is_closed()},
              {"manifold", c.is_manifold()},
              {"oriented", c.is_oriented()},
              {"points", m.points},
              {"triangles", m.triangles},
              {"components", m.components},
              {"pieces", m.components - c.cavities},
              {"cavities", c.cavities},
              {"euler_characteristic", m.euler_characteristic},
              {"genus", c.genus ? Json(*c.genus) : Json()},
              {"boundary_edges", m.boundary_edges},
              {"nonmanifold_edges", m.nonmanifold_edges - c.misoriented_edges},
              {"misoriented_edges", c.misoriented_edges},
              {"nonmanifold_points", c.nonmanifold_points},
              {"unused_points", c.unused_points},
              {"degenerate_triangles", c.degenerate_triangles},
              {"self_intersections", c.self_intersections},
              {"area_mm2", m.area},
              {"volume_mm3", object.has_volume() ? Json(m.volume) : Json()},
              {"bounds_mm", bounds(m, space)}};
    if (min_wall > 0)
        json["thin_walls"] = {{"below_mm", min_wall},
                              {"triangles", c.thin_triangles},
                              {"area_mm2", c.thin_area},
                              {"thinnest_mm", c.thinnest_wall ? Json(*c.thinnest_wall) : Json()}};
    return json;
}

// Adds the numbers of an object to those of the ones before it.
void add_numbers(Json& sum, const Json& numbers) {
    const auto extreme = [&](std::size_t corner, auto is_further) {
        for (std::size_t a = 0; a < 3; ++a) {
            Json& end = sum["bounds_mm"][corner][a];
            const Json& other = numbers["bounds_mm"][corner][a];
            if (is_further(other.get<double>(), end.get<double>())) end = other;
        }
    };
    for (auto& [name, value] : sum.items()) {
        const Json& other = numbers[name];
        if (name == "bounds_mm") {
            extreme(0, std::less<>());
            extreme(1, std::greater<>());
        } else if (name == "thin_walls") {
            value["triangles"] =
                value["triangles"].get<std::int64_t>() + other["triangles"].get<std::int64_t>();
            value["area_mm2"] = value["area_mm2"].get<double>() + other["area_mm2"].get<double>();
            if (value["thinnest_mm"].is_null() || other["thinnest_mm"] < value["thinnest_mm"])
                if (!other["thinnest_mm"].is_null()) value["thinnest_mm"] = other["thinnest_mm"];
        } else if (value.is_null() || other.is_null()) {
            value = nullptr;
        } else if (value.is_boolean()) {
            value = value.get<bool>() && other.get<bool>();
        } else if (value.is_number_integer()) {
            value = value.get<std::int64_t>() + other.get<std::int64_t>();
        } else {
            value = value.get<double>() + other.get<double>();
        }
    }
}

Json check_numbers(const CheckedFile& file, double min_wall) {
    Json json{{"mesh", file.file.string()}};
    if (file.failure) add_failure(*file.failure, json);
    if (file.objects.empty()) return json;
    json["space"] = file.space != Space::none ? Json(file.space == Space::RAS ? "RAS" : "LPS") : Json();
    Json objects = Json::array(), crossings = Json::array(), sum;
    for (const CheckedObject& object : file.objects) {
        const Json numbers = check_numbers(object, file.space, min_wall);
        if (sum.is_null())
            sum = numbers;
        else
            add_numbers(sum, numbers);
        Json& one = objects.emplace_back(Json{{"name", object.name}});
        one.update(numbers);
    }
    json.update(sum);
    if (objects.size() < 2) return json;
    for (const MeshCrossing& crossing : file.crossings)
        crossings.push_back(
            {{"objects", {crossing.first, crossing.second}},
             {"names", {file.objects[crossing.first].name, file.objects[crossing.second].name}},
             {"triangle_pairs", crossing.pairs}});
    json["objects"] = objects;
    json["crossings"] = crossings;
    return json;
}

Json level_numbers(const TerrainLevel& level) {
    const TerrainInfo& info = level.info;
    const MeshMeasures& m = level.measures;
    return {{"samples", info.samples},
            {"cell_m", info.cell},
            {"origin_m", {info.centre[0], info.centre[1], info.zero}},
            {"mm_per_metre", info.mm_per_metre},
            {"unknown_samples", info.unknown_samples},
            {"points", m.points},
            {"triangles", m.triangles},
            {"components", m.components},
            {"boundary_edges", m.boundary_edges},
            {"nonmanifold_edges", m.nonmanifold_edges},
            {"euler_characteristic", m.euler_characteristic},
            {"area_mm2", m.area},
            {"volume_mm3", volume_of(m)},
            {"bounds_mm", {m.lower, m.upper}},
            {"height_error",
             {{"rms_m", info.rms_error},
              {"max_m", info.max_error},
              {"rms_of_cell", info.rms_error / info.cell[2]}}},
            {"output", text_or_null(level.output.string())}};
}

}  // namespace

std::string surfaces_json(const SurfaceResults& results, Space space) {
    const SeriesInfo& series = results.info.series;
    const std::vector<Surface>& surfaces = results.surfaces;
    // A single surface needs no array, unless it is one of a label map, whose labels are not known before.
    const bool single = surfaces.size() == 1 && !surfaces.front().label;
    Json json;
    json["input"] = {{"format", scan_format_name(results.info.format)},
                     {"modality", text_or_null(series.modality)},
                     {"dims", series.dims},
                     {"spacing_mm", series.spacing},
                     {"series", text_or_null(series.id)}};
    if (single) {
        json.update(surface_numbers(surfaces.front(), space));
    } else {
        for (const Surface& surface : surfaces) {
            Json numbers{{"name", surface.name}};
            numbers.update(surface_numbers(surface, space));
            numbers["output"] = text_or_null(surface.output.string());
            json["surfaces"].push_back(numbers);
        }
    }
    json["verified"] = results.verified.has_value();
    json["warnings"] = message_list(results.warnings);
    json["seconds"] = seconds_numbers(results.seconds);
    json["peak_memory_bytes"] = peak_memory_bytes();
    if (single) json["output"] = text_or_null(surfaces.front().output.string());
    return to_text(json);
}

std::string findings_json(const std::vector<Finding>& findings, bool show_patient) {
    return list_json("inputs", findings,
                     [&](const Finding& finding) { return finding_numbers(finding, show_patient); });
}

std::string checks_json(const std::vector<CheckedFile>& files, double min_wall) {
    return list_json("meshes", files, [&](const CheckedFile& file) { return check_numbers(file, min_wall); });
}

std::string sweep_json(const std::vector<SweepSample>& sweep, const std::vector<Plateau>& plateaus) {
    Json json;
    json["sweep"] = Json::array();
    for (std::size_t i = 0; i < sweep.size(); ++i) {
        const SweepSample& s = sweep[i];
        json["sweep"].push_back({{"isovalue", s.isovalue},
                                 {"volume_mm3", s.volume},
                                 {"area_mm2", s.area},
                                 {"components", s.components},
                                 {"triangles", s.triangles},
                                 {"shift_mm", i > 0 ? Json(surface_shift(sweep[i - 1], s)) : Json()}});
    }
    json["plateaus"] = Json::array();
    for (const Plateau& p : plateaus)
        json["plateaus"].push_back({{"from", sweep[p.first].isovalue}, {"to", sweep[p.last].isovalue}});
    return to_text(json);
}

std::string terrain_json(const TerrainResults& results) {
    const TerrainInfo& info = results.levels.front().info;
    Json json{{"input",
               {{"format", info.format},
                {"projection", text_or_null(info.projection)},
                {"centre_m", info.centre},
                {"heights_m", {info.lowest, info.highest}}}},
              {"exaggerate", results.exaggerate},
              {"warnings", message_list(info.warnings)}};
    for (const TerrainLevel& level : results.levels) json["levels"].push_back(level_numbers(level));
    json["seconds"] = {{"extract", results.extract_seconds},
                       {"write", results.write_seconds},
                       {"total", results.total_seconds}};
    return to_text(json);
}

std::string devices_json(const DeviceList& list) {
    const auto numbers = [](const gpu::Device& device) {
        return Json{{"number", Json()},
                    {"name", device.name},
                    {"kind", gpu::device_kind_name(device.kind)},
                    {"driver", text_or_null(device.driver)},
                    {"memory_bytes", device.memory},
                    {"unusable", Json()}};
    };
    Json json{{"devices", Json::array()},
              {"auto", list.automatic ? Json(*list.automatic) : Json(kCpu)},
              {"why_none", text_or_null(list.why_none)}};
    for (const gpu::Device& device : list.usable) {
        json["devices"].push_back(numbers(device));
        json["devices"].back()["number"] = json["devices"].size() - 1;
    }
    for (const auto& [device, reason] : list.unusable) {
        json["devices"].push_back(numbers(device));
        json["devices"].back()["unusable"] = reason;
    }
    return to_text(json);
}

std::string error_json(const std::string& message, int exit_code) {
    return to_text({{"error", message}, {"exit_code", exit_code}});
}

}  // namespace marrow::apps
