#include <ostream>

#include <sys/resource.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "report.h"

namespace marrow {
namespace {

using Json = nlohmann::ordered_json;

// The smallest box in the space that is written; RAS swaps the ends of x and y.
Json bounds(const MeshMeasures& m, Space space) {
    if (space == Space::LPS) return {m.lower, m.upper};
    return {Vec3f{-m.upper[0], -m.upper[1], m.lower[2]}, Vec3f{-m.lower[0], -m.lower[1], m.upper[2]}};
}

Json text_or_null(const std::string& text) {
    return text.empty() ? Json() : Json(text);
}

Json surface_numbers(const Surface& surface, Space space) {
    const auto [points, triangles] = surface.size();
    Json numbers{{"isovalue", surface.isovalue}, {"points", points}, {"triangles", triangles}};
    if (surface.in_slabs) {  // what takes the whole surface is not known
        for (const char* name : {"components", "boundary_edges", "nonmanifold_edges", "euler_characteristic",
                                 "area_mm2", "volume_mm3", "bounds_mm"})
            numbers[name] = Json();
        return numbers;
    }
    const MeshMeasures m = measure(surface.mesh);
    numbers.update({{"components", m.components},
                    {"boundary_edges", m.boundary_edges},
                    {"nonmanifold_edges", m.nonmanifold_edges},
                    {"euler_characteristic", m.euler_characteristic},
                    {"area_mm2", m.area},
                    {"volume_mm3", m.volume},
                    {"bounds_mm", bounds(m, space)}});
    return numbers;
}

std::int64_t peak_memory_bytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return std::int64_t{usage.ru_maxrss} * 1024;
}

// File and series names may hold bytes that are not UTF-8.
void print(std::ostream& out, const Json& json) {
    out << json.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
}

}  // namespace

void print_json(std::ostream& out, const ScanInfo& info, const std::vector<Surface>& surfaces, Space space,
                const std::vector<std::string>& warnings, const StageSeconds& seconds) {
    Json json;
    json["input"] = {{"format", info.format},
                     {"modality", text_or_null(info.series.modality)},
                     {"dims", info.series.dims},
                     {"spacing_mm", info.series.spacing},
                     {"series", text_or_null(info.series.id)}};
    if (surfaces.size() == 1) {
        json.update(surface_numbers(surfaces.front(), space));
    } else {
        for (const Surface& surface : surfaces) {
            Json numbers{{"name", surface.name}};
            numbers.update(surface_numbers(surface, space));
            numbers["output"] = text_or_null(surface.output.string());
            json["surfaces"].push_back(numbers);
        }
    }
    json["warnings"] = warnings;
    json["seconds"] = {{"read", seconds.read},
                       {"extract", seconds.extract},
                       {"refine", seconds.refine},
                       {"write", seconds.write},
                       {"total", seconds.total}};
    json["peak_memory_bytes"] = peak_memory_bytes();
    if (surfaces.size() == 1) json["output"] = text_or_null(surfaces.front().output.string());
    print(out, json);
}

void print_text(std::ostream& out, const std::vector<Surface>& surfaces) {
    for (const Surface& surface : surfaces) {
        out << fmt::format("{}: {} points, {} triangles at isovalue {:g}\n",
                           surface.output.empty() ? surface.name : surface.output.string(),
                           surface.size().points, surface.size().triangles, surface.isovalue);
    }
}

void print_series(std::ostream& out, const std::string& format, const std::vector<SeriesInfo>& series,
                  bool json) {
    if (json) {
        Json list = Json::array();
        for (const SeriesInfo& s : series) {
            list.push_back({{"series", text_or_null(s.id)},
                            {"description", text_or_null(s.description)},
                            {"modality", text_or_null(s.modality)},
                            {"dims", s.dims},
                            {"spacing_mm", s.spacing},
                            {"files", s.files}});
        }
        print(out, {{"format", format}, {"series", list}});
        return;
    }
    out << fmt::format("{}, {} series\n", format, series.size());
    for (const SeriesInfo& s : series) {
        out << '\n';
        if (!s.id.empty()) out << fmt::format("  series       {}\n", s.id);
        if (!s.description.empty()) out << fmt::format("  description  {}\n", s.description);
        if (!s.modality.empty()) out << fmt::format("  modality     {}\n", s.modality);
        out << fmt::format("  samples      {} x {} x {}\n", s.dims[0], s.dims[1], s.dims[2]);
        out << fmt::format("  spacing      {:g} x {:g} x {:g} mm\n", s.spacing[0], s.spacing[1],
                           s.spacing[2]);
        out << fmt::format("  files        {}\n", s.files);
    }
}

}  // namespace marrow
