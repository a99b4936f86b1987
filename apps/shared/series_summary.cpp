// Describes series in a line.
#include "series_summary.h"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

#include "orientation.h"

namespace marrow::apps {
namespace {

std::string mm_or_unknown(double value) {
    return value > 0 ? fmt::format("{:.4g}", value) : "?";
}

}  // namespace

std::string count_of(std::size_t count, std::string_view thing) {
    return fmt::format("{} {}{}", count, thing, count == 1 || thing == "series" ? "" : "s");
}

std::string spacing_text(const Vec3d& spacing) {
    return fmt::format("{} x {} x {} mm", mm_or_unknown(spacing[0]), mm_or_unknown(spacing[1]),
                       mm_or_unknown(spacing[2]));
}

std::string series_summary(const SeriesReport& s) {
    std::vector<std::string> parts;
    const auto add = [&](const std::string& text) {
        if (!text.empty()) parts.push_back(text);
    };
    add(s.series.modality);
    if (!s.series.description.empty()) add(fmt::format("'{}'", s.series.description));
    if (s.number) add(fmt::format("series {}", *s.number));
    add(fmt::format("{} x {} x {}", s.series.dims[0], s.series.dims[1], s.series.dims[2]));
    add(spacing_text(s.series.spacing));
    if (s.geometry && s.oriented) add(plane_name(s.geometry->direction));
    if (!s.volumes.empty()) add(count_of(s.volumes.size(), "volume"));
    if (s.echo_time && s.volumes.empty()) add(fmt::format("echo time {:g} ms", *s.echo_time));
    add(s.kernel.empty() ? "" : "kernel " + s.kernel);
    add(s.image_type);
    return fmt::format("{}", fmt::join(parts, ", "));
}

std::vector<std::string> unknown_facts(const SeriesReport& series) {
    std::vector<std::string> out;
    const Vec3d& spacing = series.series.spacing;
    if (*std::min_element(spacing.begin(), spacing.end()) <= 0 && series.gaps.empty())
        out.push_back("spacing");
    if (!series.oriented) out.push_back("orientation in the patient");
    if (series.series.modality.empty()) out.push_back("modality");
    if (!series.hounsfield) out.push_back("unit of the values");
    return out;
}

}  // namespace marrow::apps
