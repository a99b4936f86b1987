// Reads DICOM segmentations as label maps.
#include "segmentation.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <utility>

#include <marrow/error.h>
#include <marrow/vector.h>

#include "base/progress.h"
#include "io/bytes/text.h"
#include "io/scan/parallel_slices.h"
#include "stack.h"
#include "tags.h"

namespace marrow::internal::io {

namespace {

// sRGB of a colour in CIELab, as DICOM encodes it (PS3.3, C.10.7.1.1). DICOM means the white D50, but DCMTK,
// dcmqi and 3D Slicer, which most segmentations come from, take that of sRGB, D65; it returns their colours
// exactly.
std::array<double, 3> srgb_of(const std::vector<std::uint16_t>& encoded) {
    constexpr double kWhole = 65535;
    const double l = encoded[0] / kWhole * 100, a = encoded[1] / kWhole * 255 - 128,
                 b = encoded[2] / kWhole * 255 - 128;
    const double fy = (l + 16) / 116;
    const auto inverse = [](double f) {
        constexpr double kDelta = 6.0 / 29;
        return f > kDelta ? f * f * f : 3 * kDelta * kDelta * (f - 4.0 / 29);
    };
    const Vec3d white{0.95047, 1, 1.08883};
    const Vec3d xyz{white[0] * inverse(fy + a / 500), white[1] * inverse(fy),
                    white[2] * inverse(fy - b / 200)};
    constexpr Mat3d kLinear{{{3.2404542, -1.5371385, -0.4985314},
                             {-0.9692660, 1.8760108, 0.0415560},
                             {0.0556434, -0.2040259, 1.0572252}}};
    const Vec3d linear = kLinear * xyz;
    std::array<double, 3> out{};
    for (std::size_t i = 0; i < 3; ++i) {
        const double c = std::clamp(linear[i], 0.0, 1.0);
        out[i] = c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055;
    }
    return out;
}

// Where the frames of a segmentation are: frame i is slice slices[i] of the geometry.
struct FrameGrid {
    Geometry geometry;
    std::vector<std::size_t> slices;
    std::vector<std::string> warnings;
};

[[noreturn]] void refuse(const DicomFile& file, const std::string& why) {
    fail<GeometryError>(file.path, "{}", why);
}

bool near(const Vec3d& a, const Vec3d& b, double tolerance) {
    return length(a - b) <= tolerance;
}

// Whether a distance is a multiple of a step, twice the step or more.
bool is_several_steps(double distance, double step) {
    const double steps = std::round(distance / step);
    return step > 0 && steps >= 2 && std::abs(distance / step - steps) <= 0.01 * steps;
}

// The step between slices, mm: as stated, or the smallest distance between frames.
double step_between(const DicomFile& file, const std::vector<double>& along,
                    std::vector<std::string>& warnings) {
    std::vector<double> sorted = along;
    std::sort(sorted.begin(), sorted.end());
    double smallest = 0;
    for (std::size_t i = 1; i < sorted.size(); ++i) {
        const double gap = sorted[i] - sorted[i - 1];
        if (gap > 1e-4 && (smallest == 0 || gap < smallest)) smallest = gap;
    }
    const DicomFrame& first = file.frames[0];
    const double thickness = first.thickness.value_or(0);
    if (!first.between && is_several_steps(smallest, thickness))
        warnings.push_back(fmt::format(
            "the segmentation does not state how far apart its slices are; its closest frames are {:g} mm "
            "apart, which is taken, but {:g} mm thick, so slices between them may be missing",
            smallest, thickness));
    const double stated = first.between.value_or(smallest > 0 ? 0 : thickness);
    if (!(stated > 0)) return smallest;
    if (is_several_steps(smallest, stated))
        warnings.push_back(fmt::format(
            "no two frames of the segmentation are beside each other: its slices are {:g} mm apart, and its "
            "closest frames {:g} mm; the slices between them are empty",
            stated, smallest));
    const double steps = smallest / stated;
    return std::abs(steps - std::round(steps)) <= 0.01 ? stated : smallest;
}

FrameGrid grid_of(const DicomFile& file) {
    constexpr double kDirection = 1e-3;
    const DicomFrame& first = file.frames[0];
    std::vector<double> along;
    if (!first.position || !first.along_row || !first.along_column || !first.spacing)
        refuse(file, "the segmentation does not state position, orientation and spacing of its frames");
    const Vec3d &x = *first.along_row, &y = *first.along_column;
    const std::optional<Mat3d> axes = axes_of(first);
    if (!axes) refuse(file, kBadOrientation);
    const Vec3d& normal = (*axes)[2];
    for (const DicomFrame& frame : file.frames) {
        if (!frame.position || !frame.along_row || !frame.along_column || frame.spacing != first.spacing ||
            !near(*frame.along_row, x, kDirection) || !near(*frame.along_column, y, kDirection))
            refuse(file, "the frames of the segmentation are not on one grid");
        along.push_back(dot(*frame.position, normal));
    }
    const auto [low, high] = std::minmax_element(along.begin(), along.end());
    FrameGrid out;
    const double guess = step_between(file, along, out.warnings);
    if (!(guess > 0)) refuse(file, "the segmentation does not state the distance between its slices");
    const double steps = std::round((*high - *low) / guess);
    constexpr double kMostSlices = 2000;
    if (!(steps < std::max(kMostSlices, 10 * static_cast<double>(along.size()))))
        refuse(file, fmt::format("the segmentation would have {:.0f} slices", steps + 1));
    const double step = steps > 0 ? (*high - *low) / steps : guess;

    Geometry& g = out.geometry;
    g.dims = {file.columns, file.rows, static_cast<std::int64_t>(steps) + 1};
    g.spacing = {(*first.spacing)[0], (*first.spacing)[1], step};
    g.origin = *file.frames[static_cast<std::size_t>(low - along.begin())].position;
    for (int row = 0; row < 3; ++row) g.direction[row] = {(*axes)[0][row], (*axes)[1][row], normal[row]};
    for (std::size_t i = 0; i < along.size(); ++i) {
        const double slice = std::round((along[i] - *low) / step);
        if (!near(*file.frames[i].position, g.origin + slice * step * normal, 0.01 + 0.01 * step))
            refuse(file, fmt::format("frame {} of the segmentation is not on the grid of the others", i + 1));
        out.slices.push_back(static_cast<std::size_t>(slice));
    }
    check_geometry(g);
    return out;
}

// Refuses frames that would overwrite each other, such as those of several times: two of one segment, or of a
// label map, in the same slice.
void check_places(const DicomFile& file, const FrameGrid& grid) {
    const bool is_map = file.segmentation->type == DicomSegmentation::Type::label_map;
    std::map<std::pair<int, std::size_t>, std::size_t> frame_at;  // by segment and slice
    for (std::size_t f = 0; f < grid.slices.size(); ++f) {
        const auto [at, added] =
            frame_at.try_emplace({is_map ? 0 : file.frames[f].segment, grid.slices[f]}, f);
        if (!added)
            refuse(file, fmt::format("frames {} and {} of the segmentation are at the same place",
                                     at->second + 1, f + 1));
    }
}

// Copies a label map, or the frames of one, into a volume. \throw InputError a label is negative or too large
template <class T>
Volume stored_map(const FrameGrid& grid, const std::int32_t* stored, std::size_t area) {
    Volume out(grid.geometry, sample_type_of<T>());
    T* to = out.template samples<T>();
    std::fill_n(to, out.geometry().sample_count(), T{0});
    for (std::size_t f = 0; f < grid.slices.size(); ++f)
        std::transform(stored + f * area, stored + (f + 1) * area, to + grid.slices[f] * area,
                       [](std::int32_t label) { return static_cast<T>(label); });
    return out;
}

// A small file with segments that overlap could make very many large maps.
void check_size(const DicomFile& file, const FrameGrid& grid, std::size_t maps) {
    constexpr double kAlwaysFits = 1 << 28, kMostExpansion = 16;  // samples; maps for each frame's samples
    const double stored =
                     static_cast<double>(file.columns * file.rows) * static_cast<double>(file.frames.size()),
                 needed = static_cast<double>(maps) * static_cast<double>(grid.geometry.sample_count());
    if (needed > std::max(kAlwaysFits, kMostExpansion * stored))
        fail<LimitError>(
            file.path, "has overlapping segments that need {} label maps or more, too many for its {} frames",
            maps, file.frames.size());
}

// Puts a segment into the first map where it meets no other. The samples from `least` on belong to it. Calls
// `step` after each frame.
template <class T>
void add_segment(const DicomFile& file, const FrameGrid& grid, const std::int32_t* stored, int segment,
                 std::int32_t least, const std::function<void()>& step, LabelMaps& out) {
    const auto area = static_cast<std::size_t>(file.columns * file.rows);
    const auto fits = [&](const Volume& map) {
        for (std::size_t f = 0; f < grid.slices.size(); ++f) {
            if (file.frames[f].segment != segment) continue;
            const T* at = map.template samples<T>() + grid.slices[f] * area;
            for (std::size_t i = 0; i < area; ++i) {
                if (stored[f * area + i] >= least && at[i] != 0) return false;
            }
            step();
        }
        return true;
    };
    std::size_t m = 0;
    while (m < out.maps.size() && !fits(out.maps[m])) ++m;
    if (m == out.maps.size()) {
        if (m > 0) check_size(file, grid, m + 1);
        Volume& map = out.maps.emplace_back(grid.geometry, sample_type_of<T>());
        std::fill_n(map.template samples<T>(), map.geometry().sample_count(), T{0});
        out.labels.emplace_back();
    }
    for (std::size_t f = 0; f < grid.slices.size(); ++f) {
        if (file.frames[f].segment != segment) continue;
        T* to = out.maps[m].template samples<T>() + grid.slices[f] * area;
        for (std::size_t i = 0; i < area; ++i) {
            if (stored[f * area + i] >= least) to[i] = static_cast<T>(segment);
        }
        step();
    }
    out.labels[m].push_back(segment);
}

template <class T>
LabelMaps maps_of(const DicomFile& file, const FrameGrid& grid, const std::int32_t* stored,
                  const ScanOptions& options) {
    LabelMaps out;
    out.warnings = grid.warnings;
    const DicomSegmentation& segmentation = *file.segmentation;
    if (segmentation.type == DicomSegmentation::Type::label_map) {
        out.maps.push_back(stored_map<T>(grid, stored, static_cast<std::size_t>(file.columns * file.rows)));
        out.labels.emplace_back();
        return out;
    }
    const bool fractional = segmentation.type == DicomSegmentation::Type::fractional;
    if (fractional) out.warnings.push_back("the fractions of the segments are cut at half of the largest");
    const std::int32_t least = fractional ? (segmentation.largest_fraction + 1) / 2 : 1;
    std::set<int> segments;
    for (const DicomFrame& frame : file.frames) segments.insert(frame.segment);
    double done = 0;
    for (const int segment : segments) {
        const double fraction = 0.5 + 0.5 * done++ / static_cast<double>(segments.size());
        add_segment<T>(
            file, grid, stored, segment, least, [&] { report_progress(options.progress, fraction); }, out);
    }
    return out;
}

}  // namespace

std::optional<DicomSegmentation> read_segmentation(const DicomDataSet& data_set) {
    const std::string uid = data_set.text(tag::kSopClassUid);
    if (uid != "1.2.840.10008.5.1.4.1.1.66.4" && uid != "1.2.840.10008.5.1.4.1.1.66.7") return {};
    DicomSegmentation out;
    const std::string type = data_set.text(tag::kSegmentationType);
    using Type = DicomSegmentation::Type;
    out.type = uid.ends_with('7') || type == "LABELMAP" ? Type::label_map
               : type == "FRACTIONAL"                   ? Type::fractional
                                                        : Type::binary;
    const auto largest = data_set.unsigned_short(tag::kLargestFraction);
    if (out.type == Type::fractional) out.largest_fraction = std::max(1, largest.value_or(255));
    for (const DicomDataSet& segment : data_set.items(tag::kSegmentSequence)) {
        const auto number = segment.unsigned_short(tag::kSegmentNumber);
        if (!number || *number == 0) continue;  // 0 is the background of a label map
        LabelEntry entry{readable_text(segment, tag::kSegmentLabel, data_set), {}};
        const auto colour = segment.numbers<std::uint16_t>(tag::kRecommendedColour);
        if (colour.size() == 3) entry.colour = srgb_of(colour);
        out.segments.emplace(*number, std::move(entry));
    }
    return out;
}

LabelMaps read_label_maps(const DicomFile& file, const ScanOptions& options) {
    const FrameGrid grid = grid_of(file);
    for (const DicomFrame& frame : file.frames) {
        if (frame.segment <= 0 && file.segmentation->type != DicomSegmentation::Type::label_map)
            fail<InputError>(file.path, "a frame of the segmentation does not name its segment");
    }
    check_places(file, grid);
    DicomWorkspace workspace;
    const std::int32_t* stored = nullptr;
    for_each_slice(1, options.threads, options.progress, 0, 0.5,
                   [&](std::size_t, const Step& step) { stored = decode_dicom(file, workspace, step); });
    const std::size_t count = static_cast<std::size_t>(file.columns * file.rows) * file.frames.size();
    std::int32_t largest = 0;
    if (file.segmentation->type == DicomSegmentation::Type::label_map) {
        const auto [low, high] = std::minmax_element(stored, stored + count);
        if (*low < 0 || *high > 65535)
            fail<InputError>(file.path, "has labels from {} to {}; they must be from 0 to 65535", *low,
                             *high);
        largest = *high;
    } else {
        for (const DicomFrame& frame : file.frames) largest = std::max(largest, frame.segment);
    }
    try {
        return largest <= 255 ? maps_of<std::uint8_t>(file, grid, stored, options)
                              : maps_of<std::uint16_t>(file, grid, stored, options);
    } catch (const std::bad_alloc&) {
        fail<LimitError>(file.path, "does not fit in memory");
    }
}

}  // namespace marrow::internal::io
