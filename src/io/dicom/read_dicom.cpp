// Reads DICOM series as volumes.
#include "read_dicom.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <string_view>
#include <type_traits>

#include <marrow/error.h>

#include "base/parallel.h"
#include "file.h"
#include "io/bytes/stored_samples.h"
#include "io/bytes/text.h"
#include "io/scan/parallel_slices.h"
#include "segmentation.h"
#include "stack.h"

namespace marrow::internal::io {

namespace {

Rescale rescale_of(const DicomSlice& s) {
    const Rescale r{s.frame().slope.value_or(1), s.frame().intercept.value_or(0)};
    if (r.slope == 0 || !std::isfinite(r.slope) || !std::isfinite(r.intercept)) {
        throw InputError(fmt::format(
            "{}: its rescale slope or intercept is not a finite number, or the slope is 0", s.name()));
    }
    return r;
}

// The stored values of slices. Files are decoded once, and only a few are kept.
class DecodedSlices {
  public:
    explicit DecodedSlices(const Step& step) : step_(step) {}

    std::vector<std::int32_t> stored(const DicomSlice& s) {
        constexpr std::size_t kMostFiles = 4;
        if (decoded_.size() > kMostFiles) decoded_.clear();
        const std::size_t area = static_cast<std::size_t>(s.file->columns * s.file->rows);
        DicomWorkspace& memory = decoded_[s.file];
        const std::int32_t* all =
            memory.stored.empty() ? decode_dicom(*s.file, memory, step_) : memory.stored.data();
        return {all + s.index * area, all + (s.index + 1) * area};
    }

  private:
    const Step& step_;
    std::map<const DicomFile*, DicomWorkspace> decoded_;
};

// Keeps the first of several slices with the same position and values. Calls `step` as decode_dicom does.
// \throw GeometryError slices with the same position differ
void drop_duplicates(DicomStack& stack, std::vector<std::string>& warnings, const Step& step) {
    DecodedSlices decoded(step);
    std::vector<std::size_t> dropped;
    for (const auto& group : coincident_slices(stack)) {
        const DicomSlice& first = stack.slices[group[0]];
        const auto pixels = decoded.stored(first);
        const Rescale rescale = rescale_of(first);
        for (std::size_t i = 1; i < group.size(); ++i) {
            const DicomSlice& other = stack.slices[group[i]];
            const bool same = *first.frame().position == *other.frame().position &&
                              rescale_of(other) == rescale && decoded.stored(other) == pixels;
            if (!same) {
                throw GeometryError(
                    fmt::format("series {}: slices with different pixels have the same position, for example "
                                "{} and {}; separate "
                                "the volumes of this series",
                                stack.id, first.name(false), other.name(false)));
            }
        }
        dropped.insert(dropped.end(), group.begin() + 1, group.end());
    }
    if (dropped.empty()) return;
    warnings.push_back(fmt::format(
        "{} skipped, for example {}",
        dropped.size() == 1 ? "1 duplicate slice is" : fmt::format("{} duplicate slices are", dropped.size()),
        stack.slices[dropped[0]].name()));
    for (auto i = dropped.rbegin(); i != dropped.rend(); ++i)
        stack.slices.erase(stack.slices.begin() + static_cast<std::ptrdiff_t>(*i));
}

// Rescales to 16 bits, computing in the type of `slope`. Returns false if a value does not fit.
template <class T, class Wide>
bool rescale(const std::int32_t* from, std::size_t count, Wide slope, Wide intercept, T* to) {
    using Unsigned = std::make_unsigned_t<Wide>;
    constexpr auto kLowest = static_cast<Unsigned>(std::numeric_limits<T>::lowest());
    Unsigned beyond = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const Wide value = slope * from[i] + intercept;
        to[i] = static_cast<T>(value);
        beyond |= (static_cast<Unsigned>(value) - kLowest) >> 16;
    }
    return beyond == 0;
}

// Rescales to 16 bits with whole numbers. Returns false if a value does not fit.
template <class T>
bool rescale(const std::int32_t* from, std::size_t count, const Rescale& by, int bits_stored, T* to) {
    const auto m = static_cast<std::int64_t>(by.slope), b = static_cast<std::int64_t>(by.intercept);
    // 32 bits are faster; they hold 2^14 * 2^16 + 10^9.
    if (bits_stored <= 16 && std::abs(m) <= 1 << 14)
        return rescale(from, count, static_cast<std::int32_t>(m), static_cast<std::int32_t>(b), to);
    return rescale(from, count, m, b, to);
}

// Whether all values are integers.
bool is_integral(const DicomStack& stack) {
    return std::all_of(stack.slices.begin(), stack.slices.end(), [](const DicomSlice& s) {
        const auto [slope, intercept] = rescale_of(s);
        return slope == std::floor(slope) && intercept == std::floor(intercept) && std::abs(slope) < 32768 &&
               std::abs(intercept) < 1e9;
    });
}

// Decodes the slices into `volume` and reports progress from `begin` to 1. If an integer does not fit into
// the type of the volume, it stops and returns the progress so far.
std::optional<double> load_slices(const DicomStack& stack, const ScanOptions& options, double begin,
                                  Volume& volume) {
    // A file with many frames is decoded once.
    std::map<const DicomFile*, std::vector<std::size_t>> slices_of;
    for (std::size_t k = 0; k < stack.slices.size(); ++k) slices_of[stack.slices[k].file].push_back(k);
    const std::vector<std::pair<const DicomFile*, std::vector<std::size_t>>> files(slices_of.begin(),
                                                                                   slices_of.end());

    const std::size_t area = static_cast<std::size_t>(volume.geometry().dims[0] * volume.geometry().dims[1]);
    const bool integral = is_integral(stack);
    std::atomic<bool> fits = true;
    double reached = begin;
    const Progress progress = [&](double fraction) {
        if (!fits) return true;  // the second attempt continues from here
        reached = fraction;
        return !options.progress || options.progress(fraction);
    };
    PerThread<DicomWorkspace> workspaces;
    for_each_slice(files.size(), options.threads, progress, begin, 1, [&](std::size_t i, const Step& step) {
        if (!fits) return;
        const std::int32_t* stored = decode_dicom(*files[i].first, workspaces.local(), step);
        for (const std::size_t k : files[i].second) {
            const DicomSlice& slice = stack.slices[k];
            // A volume with a rescale keeps what is stored.
            const Rescale by = volume.rescale().is_identity() ? rescale_of(slice) : Rescale{};
            const std::int32_t* from = stored + slice.index * area;
            const int bits = slice.file->bits_stored;
            if (volume.type() == SampleType::float32) {
                float* to = volume.samples<float>() + k * area;
                bool exact = true;
                for (std::size_t j = 0; j < area; ++j) {
                    const double value = by.slope * from[j] + by.intercept;
                    to[j] = static_cast<float>(value);
                    exact &= static_cast<double>(to[j]) == value;
                }
                if (integral && !exact) fits = false;
            } else if (volume.type() == SampleType::float64) {
                double* to = volume.samples<double>() + k * area;
                for (std::size_t j = 0; j < area; ++j) to[j] = by.slope * from[j] + by.intercept;
            } else if (volume.type() == SampleType::int16) {
                if (!rescale(from, area, by, bits, volume.samples<std::int16_t>() + k * area)) fits = false;
            } else {
                if (!rescale(from, area, by, bits, volume.samples<std::uint16_t>() + k * area)) fits = false;
            }
        }
    });
    if (fits) return {};
    return reached;
}

// The 16-bit type that can hold what the slices store, if they all have the same rescale and it can be kept.
std::optional<SampleType> kept_type(const DicomStack& stack) {
    const Rescale common = rescale_of(stack.slices[0]);
    if (!can_be_kept(common)) return {};
    bool fit_int16 = true, fit_uint16 = true;
    for (const DicomSlice& slice : stack.slices) {
        if (rescale_of(slice) != common) return {};
        const DicomFile& file = *slice.file;
        fit_int16 &= file.bits_stored <= (file.is_signed ? 16 : 15);
        fit_uint16 &= file.bits_stored <= 16 && !file.is_signed;
    }
    if (fit_int16) return SampleType::int16;
    if (fit_uint16) return SampleType::uint16;
    return {};
}

// The type that a volume has if the samples are kept as stored; nothing if they cannot be. Between uneven
// slices, values are interpolated.
std::optional<SampleType> type_to_keep(const DicomStack& stack, const StackGeometry& geometry,
                                       const ScanOptions& options) {
    return options.keep_stored && geometry.uneven.empty() ? kept_type(stack) : std::nullopt;
}

// Interpolates linearly between slices at `positions`, which are fractional indices along the third axis of
// `even`.
template <class T>
Volume resampled(const Volume& uneven, const std::vector<double>& positions, const Geometry& even) {
    Volume out(even, uneven.type());
    const std::size_t area = static_cast<std::size_t>(even.dims[0] * even.dims[1]);
    std::size_t below = 0;
    for (std::size_t k = 0; k < static_cast<std::size_t>(even.dims[2]); ++k) {
        const auto position = static_cast<double>(k);
        while (below + 2 < positions.size() && positions[below + 1] <= position) ++below;
        const double share =
            std::clamp((position - positions[below]) / (positions[below + 1] - positions[below]), 0.0, 1.0);
        const T *a = uneven.samples<T>() + below * area, *b = a + area;
        T* to = out.samples<T>() + k * area;
        for (std::size_t j = 0; j < area; ++j) {
            const double value = (1 - share) * a[j] + share * b[j];
            if constexpr (std::is_integral_v<T>)
                to[j] = static_cast<T>(std::lround(value));
            else
                to[j] = static_cast<T>(value);
        }
    }
    return out;
}

Volume resampled_if_uneven(Volume volume, const StackGeometry& stack_geometry) {
    const std::vector<double>& positions = stack_geometry.uneven;
    const Geometry& even = stack_geometry.geometry;
    if (positions.empty()) return volume;
    if (volume.type() == SampleType::int16) return resampled<std::int16_t>(volume, positions, even);
    if (volume.type() == SampleType::float32) return resampled<float>(volume, positions, even);
    return resampled<double>(volume, positions, even);
}

void check_supported(const DicomStack& stack) {
    for (const DicomSlice& s : stack.slices) {
        if (s.file->refusal) fail<InputError>(s.file->path, "{}", *s.file->refusal);
    }
}

bool is_rescaled(const DicomStack& stack) {
    return std::any_of(stack.slices.begin(), stack.slices.end(),
                       [](const DicomSlice& s) { return s.frame().slope.has_value(); });
}

// The unit of a CT's values, if its headers state another one than HU, as those of dual energy can.
std::string other_unit(const DicomStack& stack) {
    constexpr std::array<std::string_view, 6> kOthers{"OD", "MGML", "Z_EFF", "ED", "EDW", "PCT"};
    const std::string& type = stack.slices[0].frame().rescale_type;
    return std::find(kOthers.begin(), kOthers.end(), type) != kOthers.end() ? type : "";
}

// The padding after rescaling, if all slices agree.
std::optional<double> padding_of(const DicomStack& stack, SampleType type) {
    std::optional<double> common;
    for (const DicomSlice& slice : stack.slices) {
        if (!slice.file->padding) return {};
        const auto [slope, intercept] = rescale_of(slice);
        const double rescaled = slope * *slice.file->padding + intercept;
        const double padding = type == SampleType::float32 ? static_cast<float>(rescaled) : rescaled;
        if (common.value_or(padding) != padding) return {};
        common = padding;
    }
    return common;
}

// The labels of each map: "segments 1, 4, 5".
std::vector<std::string> differences_of(const LabelMaps& maps) {
    std::vector<std::string> out;
    for (const std::vector<std::int64_t>& labels : maps.labels)
        out.push_back(fmt::format("segments {}", fmt::join(labels, ", ")));
    return out;
}

std::vector<std::filesystem::path> files_of(const DicomStack& stack) {
    std::vector<std::filesystem::path> files;
    for (const DicomSlice& slice : stack.slices) {
        if (files.empty() || files.back() != slice.file->path) files.push_back(slice.file->path);
    }
    return files;
}

std::size_t choose_map(const LabelMaps& maps, const ScanOptions& options) {
    return choose_volume(differences_of(maps),
                         fmt::format("the segments overlap and make {} label maps", maps.maps.size()),
                         options);
}

std::vector<std::string> differences_of(const DicomSeries& series) {
    std::vector<std::string> out;
    for (const DicomStack& volume : series.volumes) out.push_back(volume.difference);
    return out;
}

DicomStack& choose_stack(DicomSeries& series, const ScanOptions& options) {
    return series.volumes[choose_volume(
        differences_of(series), fmt::format("the series holds {} volumes", series.volumes.size()), options)];
}

void describe_map(const DicomFile& file, const Volume& map, SeriesInfo& info) {
    info.dims = map.geometry().dims;
    info.spacing = map.geometry().spacing;
    info.files = 1;
    info.labels = file.segmentation->segments;
}

// "2005-07-26" for "20050726".
std::string date_of(const DicomFile& file) {
    const std::string& date = file.date;
    return date.size() == 8 ? date.substr(0, 4) + '-' + date.substr(4, 2) + '-' + date.substr(6) : "";
}

// What the headers of a stack say.
SeriesReport header_report(const DicomStack& stack) {
    const DicomFile& file = stack.first();
    SeriesReport out;
    out.series = describe(stack);
    out.number = file.series_number;
    out.date = date_of(file);
    out.echo_time = file.echo_time;
    out.image_type = file.image_type;
    out.kernel = file.kernel;
    out.patient_name = file.patient_name;
    out.oriented = file.frames[0].position && file.frames[0].along_row;
    if (!file.modality.empty())
        out.hounsfield = file.modality == "CT" && is_rescaled(stack) && other_unit(stack).empty();
    return out;
}

SeriesReport report_on_segmentation(const DicomSeries& series, const ScanOptions& options) {
    const DicomFile& file = series.first();
    SeriesReport out = header_report(series.volumes[0]);
    out.hounsfield = false;
    try {
        check_supported(series.volumes[0]);
        const LabelMaps maps = read_label_maps(file, options);
        out.warnings = maps.warnings;
        if (maps.maps.size() > 1) out.volumes = differences_of(maps);
        out.volume_count = static_cast<std::int64_t>(maps.maps.size());
        describe_map(file, maps.maps[0], out.series);
        out.geometry = maps.maps[0].geometry();
        out.memory =
            static_cast<std::uint64_t>(out.geometry->sample_count()) * sample_size(maps.maps[0].type());
        choose_map(maps, options);
    } catch (const InputError& error) {
        out.refusal = error.what();
    }
    return out;
}

// Checks a stack, drops its duplicates and computes its geometry, which `info` describes. Calls `step` as
// decode_dicom does. \throw InputError it cannot be read
StackGeometry prepare(DicomStack& stack, const ScanOptions& options, SeriesInfo& info,
                      std::vector<std::string>& warnings, const Step& step) {
    check_supported(stack);
    if (stack.order) {  // the volumes may be divided wrongly
        warnings.push_back(
            fmt::format("the volumes of the series are told apart by the order of their {} alone",
                        *stack.order == VolumeAttribute::instance_number ? "InstanceNumber" : "times"));
    }
    drop_duplicates(stack, warnings, step);
    StackGeometry out = geometry_of(stack, options);
    for (const DicomSlice& s : stack.slices) rescale_of(s);
    const bool is_ct = stack.first().modality == "CT";
    if (is_ct && !is_rescaled(stack))
        warnings.push_back("the CT has no rescale slope: its values are not HU");
    else if (const std::string unit = other_unit(stack); is_ct && !unit.empty())
        warnings.push_back(fmt::format("the CT's values are not HU: their unit (RescaleType) is {}", unit));
    warnings.insert(warnings.end(), out.warnings.begin(), out.warnings.end());
    info.dims = out.geometry.dims;
    info.spacing = out.geometry.spacing;
    return out;
}

SeriesReport report_on(DicomSeries& series, const ScanOptions& options) {
    if (series.first().segmentation) return report_on_segmentation(series, options);
    std::optional<std::string> refusal;
    DicomStack* chosen = &series.volumes[0];
    try {
        chosen = &choose_stack(series, options);
    } catch (const InputError& error) {
        refusal = error.what();
    }
    DicomStack& stack = *chosen;
    SeriesReport out = header_report(stack);
    if (series.volumes.size() > 1) out.volumes = differences_of(series);
    out.volume_count = static_cast<std::int64_t>(series.volumes.size());
    for (const DicomStack& volume : series.volumes) {
        const DicomSlice& middle = volume.slices[volume.slices.size() / 2];
        out.middle_slices.push_back({middle.file->path, middle.index});
    }
    SampleType type = SampleType::int16;  // unless a value does not fit
    for (const auto& [slice, length] : uneven_gaps(stack))
        out.gaps.push_back(fmt::format("{:.4g} mm between {} and {}", length, stack.slices[slice].name(),
                                       stack.slices[slice + 1].name()));
    try {
        const StackGeometry prepared = prepare(stack, options, out.series, out.warnings,
                                               [&](double) { report_progress(options.progress, 0); });
        out.geometry = prepared.geometry;
        out.tilt = prepared.tilt;
        if (!type_to_keep(stack, prepared, options) && !is_integral(stack)) type = SampleType::float32;
    } catch (const InputError& error) {
        refusal = error.what();
    }
    out.refusal = refusal;
    const auto& spacing = out.series.spacing;
    if (*std::min_element(spacing.begin(), spacing.end()) > 0)
        out.smallest_feature = 2 * *std::max_element(spacing.begin(), spacing.end());
    out.memory = static_cast<std::uint64_t>(out.series.dims[0] * out.series.dims[1] * out.series.dims[2]) *
                 sample_size(type);
    return out;
}

// A series of several volumes lacks nothing but the choice of one: then its headers give a geometry.
bool lacks_volume(const SeriesReport& series, const ScanOptions& options) {
    return series.refusal && series.volume_count > 1 && series.geometry && !options.volume;
}

// Why none of several series is chosen.
std::string reason_for_none(const std::vector<SeriesReport>& reports, const DicomHeaders& headers,
                            const SeriesChoice& choice, const ScanOptions& options) {
    std::size_t readable = 0, of_volumes = 0;
    for (const DicomSeries* series : choice.candidates) {
        const SeriesReport& report = reports[static_cast<std::size_t>(series - headers.series.data())];
        of_volumes += lacks_volume(report, options);
        readable += !report.refusal || lacks_volume(report, options);
    }
    if (readable == 0) return fmt::format("all {} series are refused", choice.candidates.size());
    return fmt::format("{} of {} series can be read: choose one with options.series{}", readable,
                       choice.candidates.size(),
                       of_volumes > 0 ? ", and one of its volumes with options.volume" : "");
}

}  // namespace

ScanReport inspect_dicom(const DicomInput& input, const ScanOptions& options) {
    // Finding the headers takes most of the time.
    constexpr double kHeadersDone = 0.9;
    DicomHeaders headers =
        read_dicom_headers(input, options.threads, sub_progress(options.progress, 0, kHeadersDone));
    ScanReport out{ScanFormat::dicom, input.files.size(), {}, {}, {}, headers.warnings};
    const SeriesChoice choice = choose_series(headers, input, options);
    const auto count = static_cast<double>(headers.series.size());
    for (double i = 0; DicomSeries & s : headers.series) {
        ScanOptions of_series = options;
        of_series.progress = sub_progress(options.progress, std::lerp(kHeadersDone, 1, i / count),
                                          std::lerp(kHeadersDone, 1, (i + 1) / count));
        report_progress(of_series.progress, 0);
        out.series.push_back(report_on(s, of_series));
        ++i;
    }
    report_progress(options.progress, 1);
    out.reason = choice.reason;
    if (headers.damage) {
        out.reason = *headers.damage;
    } else if (choice.candidates.size() == 1) {
        const auto at = static_cast<std::size_t>(choice.candidates[0] - headers.series.data());
        if (const std::string warning = images_left_out(*choice.candidates[0], headers, options);
            !warning.empty())
            out.series[at].warnings.push_back(warning);
        if (const auto& refusal = out.series[at].refusal)
            out.reason = *refusal;
        else
            out.chosen = at;
    } else {
        out.reason = reason_for_none(out.series, headers, choice, options);
    }
    return out;
}

bool is_dicom_segmentation(const DicomInput& input, const ScanOptions& options) {
    DicomHeaders headers = read_dicom_headers(input, options.threads, options.progress);
    const DicomSeries& series = only_candidate(choose_series(headers, input, options), headers);
    if (headers.damage) throw InputError(*headers.damage);
    return series.first().segmentation.has_value();
}

Volume read_image(const DicomImage& image, const Progress& progress) {
    const std::optional<DicomFile> file = read_dicom_header(image.file);
    if (!file || image.frame >= file->frames.size())
        fail<InputError>(image.file, "has no image {}", image.frame);
    DicomWorkspace workspace;
    const std::int32_t* stored = nullptr;
    for_each_slice(1, 1, progress, 0, 1,
                   [&](std::size_t, const Step& step) { stored = decode_dicom(*file, workspace, step); });
    Geometry geometry;
    geometry.dims = {file->columns, file->rows, 1};
    if (const auto& spacing = file->frames[image.frame].spacing)
        geometry.spacing = {(*spacing)[0], (*spacing)[1], 1};
    Volume out(geometry, SampleType::int32);
    const auto area = static_cast<std::size_t>(file->columns * file->rows);
    std::copy_n(stored + image.frame * area, area, out.samples<std::int32_t>());
    return out;
}

Volume read_dicom(const DicomInput& input, const ScanOptions& options, ScanInfo& info) {
    constexpr double kHeadersDone = 0.2;
    DicomHeaders headers =
        read_dicom_headers(input, options.threads, sub_progress(options.progress, 0, kHeadersDone));
    info.warnings = headers.warnings;
    const SeriesChoice choice = choose_series(headers, input, options);
    DicomSeries& series = only_candidate(choice, headers);
    if (headers.damage) throw InputError(*headers.damage);
    if (choice.skips_single_images) info.warnings.push_back(choice.reason);
    if (const std::string warning = images_left_out(series, headers, options); !warning.empty())
        info.warnings.push_back(warning);
    if (series.first().segmentation) {
        check_supported(series.volumes[0]);
        LabelMaps maps = read_label_maps(series.first(), options);
        const std::size_t chosen = choose_map(maps, options);
        info.series = describe(series.volumes[0]);
        info.series.dicom_files = files_of(series.volumes[0]);
        describe_map(series.first(), maps.maps[chosen], info.series);
        info.volumes = static_cast<std::int64_t>(maps.maps.size());
        info.warnings.insert(info.warnings.end(), maps.warnings.begin(), maps.warnings.end());
        return std::move(maps.maps[chosen]);
    }
    DicomStack& stack = choose_stack(series, options);
    info.volumes = static_cast<std::int64_t>(series.volumes.size());
    info.series = describe(stack);
    info.series.dicom_files = files_of(stack);
    const StackGeometry stack_geometry = prepare(stack, options, info.series, info.warnings, [&](double) {
        report_progress(options.progress, kHeadersDone);
    });

    Geometry as_stored = stack_geometry.geometry;
    as_stored.dims[2] = static_cast<std::int64_t>(stack.slices.size());
    double begin = kHeadersDone;
    const std::optional<SampleType> kept = type_to_keep(stack, stack_geometry, options);
    // Each holds integers that the one before does not, and the last holds all.
    std::vector<SampleType> types{SampleType::float32, SampleType::float64};
    if (kept || is_integral(stack)) types.insert(types.begin(), kept.value_or(SampleType::int16));
    Volume volume;
    for (const SampleType type : types) {
        volume = Volume();  // frees it
        volume = Volume(as_stored, type);
        if (type == kept) volume.set_rescale(rescale_of(stack.slices[0]));
        const std::optional<double> reached = load_slices(stack, options, begin, volume);
        if (!reached) break;
        begin = *reached;
    }
    info.padding = padding_of(stack, volume.type());
    return resampled_if_uneven(std::move(volume), stack_geometry);
}

}  // namespace marrow::internal::io
