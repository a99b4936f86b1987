// Lists, reads and describes scans, and cuts slices out of them.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include <marrow/error.h>
#include <marrow/histogram.h>
#include <marrow/label_table.h>
#include <marrow/labels.h>
#include <marrow/tissue_presets.h>

#include "base/checked_size.h"
#include "json.h"
#include "shared/label_map.h"
#include "shared/orientation.h"
#include "shared/series_summary.h"

namespace marrow::web {
namespace {

std::optional<Volume> volume;
ScanInfo info;
Buffer<std::byte> slice_samples;  // of the last slice

ScanOptions options_of(const Json& request) {
    ScanOptions options;
    options.series = member<std::string>(request, "series");
    if (const auto spacing = member<Json>(request, "spacing")) options.spacing = vec3_of(*spacing);
    options.resample = request.value("resample", false);
    options.volume = member<std::int64_t>(request, "volume");
    options.keep_stored = true;
    options.threads = request.value("threads", 0);
    options.progress = progress();
    return options;
}

Json report_of(const SeriesReport& s, std::size_t index) {
    Json out{{"id", s.series.id},
             {"index", index + 1},
             {"description", s.series.description},
             {"modality", s.series.modality},
             {"dims", s.series.dims},
             {"spacing", vector_of(s.series.spacing)},
             {"files", s.series.files},
             {"warnings", s.warnings},
             {"gaps", s.gaps},
             {"tilt", s.tilt},
             {"date", s.date},
             {"imageType", s.image_type},
             {"kernel", s.kernel},
             {"volumes", s.volumes},
             {"volumeCount", s.volume_count},
             {"memory", s.memory},
             {"summary", apps::series_summary(s)},
             {"unknown", apps::unknown_facts(s)}};
    if (s.refusal) out["refusal"] = *s.refusal;
    if (s.number) out["number"] = *s.number;
    if (s.echo_time) out["echoTime"] = *s.echo_time;
    if (s.hounsfield) out["hounsfield"] = *s.hounsfield;
    if (s.geometry && s.oriented) out["plane"] = apps::plane_name(s.geometry->direction);
    return out;
}

// The value of a sample, as reading without ScanOptions::keep_stored would give it.
template <class T>
float value_of(T sample) {
    return static_cast<float>(scan().rescale().value(static_cast<double>(sample)));
}

// Whether samples stay as stored although their values are whole numbers from 0, as labels are.
bool keeps_whole_values() {
    if (scan().rescale().is_identity()) return false;
    return visit_sample_type(scan().type(), []<class T>(T) {
        const T* const samples = scan().samples<T>();
        return std::all_of(samples, samples + scan().bytes() / sizeof(T), [](T sample) {
            const float value = value_of(sample);
            return value >= 0 && value == std::floor(value);
        });
    });
}

// The type of the samples that a page gets: with a rescale, their values.
SampleType type_for_page() {
    return scan().rescale().is_identity() ? scan().type() : SampleType::float32;
}

// Replaces samples by their values, in float32.
void rescale(Buffer<std::byte>& samples) {
    visit_sample_type(scan().type(), [&]<class T>(T) {
        const auto* const from = reinterpret_cast<const T*>(samples.data());
        const std::size_t count = samples.size() / sizeof(T);
        Buffer<std::byte> values(count * sizeof(float));
        auto* const to = reinterpret_cast<float*>(values.data());
        std::transform(from, from + count, to, value_of<T>);
        samples = std::move(values);
    });
}

// The lowest and highest of the values, without the outer hundredths. A million of them suffice.
template <class T>
Json window_of(const T* samples, std::size_t count) {
    constexpr std::size_t kMost = 1'000'000;
    const std::size_t step = std::max<std::size_t>(1, count / kMost);
    std::vector<T> some;
    for (std::size_t i = 0; i < count; i += step) {
        if (std::isfinite(static_cast<double>(samples[i]))) some.push_back(samples[i]);
    }
    if (some.empty()) return {{"lower", 0}, {"upper", 0}};
    const auto percentile = [&](double part) {
        const auto at =
            some.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(some.size() - 1));
        std::nth_element(some.begin(), at, some.end());
        return scan().rescale().value(static_cast<double>(*at));
    };
    const double lower = percentile(0.01), upper = percentile(0.99);
    if (lower < upper) return {{"lower", lower}, {"upper", upper}};
    return {{"lower", percentile(0)}, {"upper", percentile(1)}};
}

Json labels_of(const Volume& map, const LabelTable& table) {
    Json out = Json::array();
    for (const auto& [label, samples] : count_labels(map)) {
        if (label == LabelOptions{}.background) continue;
        const LabelEntry entry = label_entry(table, label);
        out.push_back(
            {{"label", label}, {"name", entry.name}, {"colour", *entry.colour}, {"samples", samples}});
    }
    return out;
}

}  // namespace

const Volume& scan() {
    if (!volume) throw InputError("there is no scan: read one first");
    return *volume;
}

const ScanInfo& scan_info() {
    return info;
}

VolumeView cropped_scan(const Json& request) {
    const VolumeView whole(scan());
    const auto crop = member<Json>(request, "crop");
    if (!crop) return whole;
    const auto first = crop->at("first").get<std::array<std::int64_t, 3>>();
    const auto last = crop->at("last").get<std::array<std::int64_t, 3>>();
    // As the command line's --crop: by itself, without the samples around it.
    VolumeView part =
        part_of(whole, first, {last[0] - first[0] + 1, last[1] - first[1] + 1, last[2] - first[2] + 1});
    part.geometry = part.own_geometry();
    part.first = part.below = part.above = {0, 0, 0};
    return part;
}

Json inspect(const Json& request) {
    const ScanReport report = inspect_scan(request.at("path").get<std::string>(), options_of(request));
    Json series = Json::array();
    for (std::size_t i = 0; i < report.series.size(); ++i) series.push_back(report_of(report.series[i], i));
    Json out{{"format", scan_format_name(report.format)},
             {"files", report.files},
             {"series", series},
             {"reason", report.reason},
             {"warnings", report.warnings}};
    if (report.chosen) out["chosen"] = *report.chosen;
    return out;
}

Json read(const Json& request) {
    ScanOptions options = options_of(request);
    const auto read_with_options = [&] {
        volume.reset();  // before the next one needs memory
        info = {};
        volume = read_scan(request.at("path").get<std::string>(), options, &info);
    };
    read_with_options();
    // The samples of a label map must be its labels, so a map that stays as stored is read again.
    if (keeps_whole_values()) {
        options.keep_stored = false;
        read_with_options();
    }
    return describe_scan(request);
}

Json adopt(const Json& request) {
    static constexpr std::array kTypes{SampleType::uint8,  SampleType::int8,  SampleType::uint16,
                                       SampleType::int16,  SampleType::int32, SampleType::float32,
                                       SampleType::float64};
    const auto type = std::find_if(kTypes.begin(), kTypes.end(), [&](SampleType t) {
        return request.at("type").get<std::string>() == sample_type_name(t);
    });
    if (type == kTypes.end())
        throw InputError("samples have the types uint8, int8, uint16, int16, int32, float32 and float64");
    Geometry geometry;
    geometry.dims = request.at("dims").get<std::array<std::int64_t, 3>>();
    if (const auto spacing = member<Json>(request, "spacing")) geometry.spacing = vec3_of(*spacing);
    if (const auto origin = member<Json>(request, "origin")) geometry.origin = vec3_of(*origin);
    if (const auto direction = member<std::vector<double>>(request, "direction")) {
        for (std::size_t i = 0; i < 9; ++i) geometry.direction[i / 3][i % 3] = direction->at(i);
    }
    volume.emplace(geometry, *type);
    info = {};
    return array_of(static_cast<const char*>(volume->data()), volume->bytes());
}

Json describe_scan(const Json&) {
    const Geometry& g = scan().geometry();
    const Histogram samples = histogram(scan(), 256, info.padding);
    // Whether it is in Hounsfield units depends on air, which may be padding.
    const double lowest = info.padding ? std::min(samples.lower, *info.padding) : samples.lower;
    const bool segmentation = info.series.modality == "SEG" || !info.series.labels.empty();
    const bool is_map = segmentation || apps::is_label_map(scan(), info.series);
    const bool hounsfield =
        !is_map && !samples.counts.empty() && presets_apply(info.series.modality, info.format, lowest);
    const Mat3d m = g.index_to_physical();
    Json out{{"format", info.series.files > 0 ? scan_format_name(info.format) : ""},
             {"description", info.series.description},
             {"seriesId", info.series.id},
             {"modality", info.series.modality},
             {"sampleType", sample_type_name(type_for_page())},
             {"dims", g.dims},
             {"spacing", vector_of(g.spacing)},
             {"origin", vector_of(g.origin)},
             {"direction", Json::array()},
             {"indexToPhysical",
              {m[0][0], m[1][0], m[2][0], 0, m[0][1], m[1][1], m[2][1], 0, m[0][2], m[1][2], m[2][2], 0,
               g.origin[0], g.origin[1], g.origin[2], 1}},
             {"unit", is_map       ? "labels"
                      : hounsfield ? "HU"
                                   : ""},
             {"unitAssumed", is_map ? !segmentation : hounsfield && info.series.modality.empty()},
             {"warnings", info.warnings},
             {"histogram",
              {{"lower", samples.lower},
               {"upper", samples.upper},
               {"counts", samples.counts},
               {"nonFinite", samples.non_finite_samples}}},
             {"labels", is_map ? labels_of(scan(), info.series.labels) : Json::array()},
             {"bytes", scan().bytes()}};
    for (std::size_t i = 0; i < 9; ++i) out["direction"].push_back(g.direction[i / 3][i % 3]);
    out["window"] = visit_sample_type(scan().type(), [&]<class T>(T) {
        return window_of(scan().samples<T>(), scan().bytes() / sizeof(T));
    });
    try {
        out["otsu"] = otsu_isovalue(samples);
    } catch (const InputError&) {
        // All samples are equal, so there is no best isovalue.
    }
    return out;
}

Json read_labels(const Json& request) {
    const LabelTable table = read_label_table(request.at("path").get<std::string>());
    const Json labels = labels_of(scan(), completed(table, info.series.labels));
    const bool any = std::any_of(labels.begin(), labels.end(), [&](const Json& label) {
        return table.contains(label.at("label").get<std::int64_t>());
    });
    return {{"labels", labels}, {"matches", any}};
}

Json slice(const Json& request) {
    const Geometry& g = scan().geometry();
    const auto axis = request.at("axis").get<std::size_t>();
    const auto index = request.at("index").get<std::int64_t>();
    if (axis > 2 || index < 0 || index >= g.dims[axis]) throw InputError("the scan has no such slice");
    const std::size_t across = axis == 0 ? 1 : 0, down = axis == 2 ? 1 : 2;
    const std::size_t size = sample_size(scan().type());
    const std::array<std::size_t, 3> stride{size, size * static_cast<std::size_t>(g.dims[0]),
                                            size * static_cast<std::size_t>(g.dims[0] * g.dims[1])};
    const auto width = static_cast<std::size_t>(g.dims[across]),
               height = static_cast<std::size_t>(g.dims[down]);
    slice_samples.resize(width * height * size);
    const auto* const from =
        static_cast<const std::byte*>(scan().data()) + static_cast<std::size_t>(index) * stride[axis];
    for (std::size_t y = 0; y < height; ++y) {
        const std::byte* const row = from + y * stride[down];
        std::byte* const to = slice_samples.data() + y * width * size;
        if (across == 0) {
            std::memcpy(to, row, width * size);
        } else {
            for (std::size_t x = 0; x < width; ++x)
                std::memcpy(to + x * size, row + x * stride[across], size);
        }
    }
    if (!scan().rescale().is_identity()) rescale(slice_samples);
    return {{"width", width},
            {"height", height},
            {"spacing", {g.spacing[across], g.spacing[down]}},
            {"rescaled", !scan().rescale().is_identity()},
            {"samples", array_of(slice_samples.data(), slice_samples.size())}};
}

}  // namespace marrow::web
