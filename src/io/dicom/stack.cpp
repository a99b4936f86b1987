// Groups DICOM frames into volumes and computes their geometry.
#include "stack.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

#include <marrow/error.h>
#include <marrow/vector.h>

#include "io/bytes/text.h"
#include "io/scan/image_stack.h"
#include "io/scan/number_gap.h"
#include "volumes.h"

namespace marrow::internal::io {

namespace {

template <class V>
bool close(const std::optional<V>& a, const std::optional<V>& b, double tolerance) {
    if (!a || !b) return a.has_value() == b.has_value();
    for (std::size_t i = 0; i < a->size(); ++i) {
        if (!(std::abs((*a)[i] - (*b)[i]) <= tolerance)) return false;
    }
    return true;
}

// Whether a slice can be on the same grid as a stack of the same series.
bool belongs(const DicomSlice& s, const DicomStack& stack) {
    constexpr double kDirection = 1e-3, kSpacing = 1e-4;  // tolerances
    const DicomFile &a = *s.file, &b = stack.first();
    const DicomFrame &f = s.frame(), &g = stack.slices[0].frame();
    return a.columns == b.columns && a.rows == b.rows && a.localizer == b.localizer &&
           f.position.has_value() == g.position.has_value() && close(f.along_row, g.along_row, kDirection) &&
           close(f.along_column, g.along_column, kDirection) && close(f.spacing, g.spacing, kSpacing);
}

bool has_position(const DicomFrame& frame) {
    return frame.position && frame.along_row && frame.along_column;
}

// Sorts by the position along the normal. Slices without a position are sorted by number, or by name without
// numbers; that is a guess, which geometry_of accepts only with options.spacing.
void sort_slices(DicomStack& stack) {
    const DicomFrame first = stack.slices[0].frame();
    if (!has_position(first)) {
        std::stable_sort(stack.slices.begin(), stack.slices.end(),
                         [](const DicomSlice& a, const DicomSlice& b) {
                             const int m = a.file->instance.value_or(0), n = b.file->instance.value_or(0);
                             return m < n || (m == n && natural_less(a.file->path, b.file->path));
                         });
        return;
    }
    const Vec3d across = cross(*first.along_row, *first.along_column);
    for (DicomSlice& s : stack.slices) s.along = dot(*s.frame().position, across) / length(across);
    std::stable_sort(stack.slices.begin(), stack.slices.end(),
                     [](const DicomSlice& a, const DicomSlice& b) { return a.along < b.along; });
}

// The distances between adjacent slices, mm.
std::vector<double> gaps_of(const std::vector<DicomSlice>& slices) {
    std::vector<double> gaps;
    for (std::size_t i = 0; i + 1 < slices.size(); ++i) gaps.push_back(slices[i + 1].along - slices[i].along);
    return gaps;
}

constexpr double kSamePosition = 1e-4;  // mm

double usual_gap(std::vector<double> gaps) {
    const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
    std::nth_element(gaps.begin(), middle, gaps.end());
    return *middle;
}

// Whether a gap differs from the usual one by more than 1 % or 0.01 mm.
bool is_uneven(double gap, double usual) {
    return std::abs(gap - usual) > std::min(0.01, 0.01 * usual);
}

constexpr std::size_t kFewestSlices = 3;  // fewer do not count as a volume of their own

// Splits a sorted stack at large gaps: head and feet in one series are two volumes.
std::vector<DicomStack> split_at_large_gaps(DicomStack stack) {
    constexpr double kLargeGap = 10;  // times the usual gap
    const std::vector<double> gaps = gaps_of(stack.slices);
    std::vector<double> steps;
    std::copy_if(gaps.begin(), gaps.end(), std::back_inserter(steps),
                 [](double gap) { return gap >= kSamePosition; });
    if (steps.empty()) return {std::move(stack)};
    const double large = kLargeGap * usual_gap(steps);
    std::vector<DicomStack> out(1);
    std::vector<std::size_t> positions(1, 1);
    for (std::size_t i = 0; i < stack.slices.size(); ++i) {
        if (i > 0 && gaps[i - 1] > large) {
            out.emplace_back();
            positions.push_back(1);
        } else if (i > 0 && gaps[i - 1] >= kSamePosition) {
            ++positions.back();
        }
        out.back().slices.push_back(stack.slices[i]);
    }
    if (*std::min_element(positions.begin(), positions.end()) < kFewestSlices) return {std::move(stack)};
    return out;
}

bool is_even(const DicomStack& stack) {
    return coincident_slices(stack).empty() && uneven_gaps(stack).empty();
}

// Splits a sorted stack that is not even by the values of an attribute, if one of them has enough slices for
// a volume.
std::vector<DicomStack> split_by(std::string DicomFile::*attribute, DicomStack stack) {
    if (!has_position(stack.slices[0].frame()) || is_even(stack)) return {std::move(stack)};
    std::map<std::string_view, DicomStack> parts;
    for (const DicomSlice& s : stack.slices) parts[s.file->*attribute].slices.push_back(s);
    const bool any = std::any_of(parts.begin(), parts.end(),
                                 [](const auto& part) { return part.second.slices.size() >= kFewestSlices; });
    if (parts.size() == 1 || !any) return {std::move(stack)};
    std::vector<DicomStack> out;
    for (auto& [value, part] : parts) out.push_back(std::move(part));
    return out;
}

// The parts of a sorted stack that cannot be one volume, nor volumes on one grid.
std::vector<DicomStack> parts_of(DicomStack stack) {
    std::vector<DicomStack> out;
    for (DicomStack& near : split_at_large_gaps(std::move(stack))) {
        for (DicomStack& frame : split_by(&DicomFile::frame_of_reference, std::move(near))) {
            for (DicomStack& part : split_by(&DicomFile::modality, std::move(frame)))
                out.push_back(std::move(part));
        }
    }
    return out;
}

}  // namespace

std::string DicomSlice::name(bool with_folder) const {
    const std::string name = quoted(with_folder ? file->path : file->path.filename());
    return file->frames.size() == 1 ? name : fmt::format("{} frame {}", name, index + 1);
}

std::size_t DicomSeries::slices() const {
    std::size_t count = 0;
    for (const DicomStack& volume : volumes) count += volume.slices.size();
    return count;
}

std::vector<DicomSeries> group_into_series(const std::vector<DicomFile>& files) {
    constexpr std::size_t kMost = 2000;  // stacks of a series; each slice is compared with all of them
    std::vector<DicomSeries> out;
    std::map<std::string_view, std::vector<DicomStack>> stacks_of_series;
    for (const DicomFile& file : files) {
        if (file.segmentation) {  // a file is a volume, whose frames may be of several segments
            DicomStack& all = out.emplace_back(DicomSeries{"", {{}}}).volumes[0];
            for (std::size_t i = 0; i < file.frames.size(); ++i) all.slices.push_back({&file, i});
            continue;
        }
        std::vector<DicomStack>& series = stacks_of_series[file.series_uid];
        for (std::size_t i = 0; i < file.frames.size(); ++i) {
            const DicomSlice slice{&file, i};
            const auto at = std::find_if(series.begin(), series.end(),
                                         [&](const DicomStack& s) { return belongs(slice, s); });
            if (at != series.end())
                at->slices.push_back(slice);
            else if (series.size() < kMost)
                series.push_back({"", {slice}});
            else
                throw InputError(
                    fmt::format("{}: its series has more than {} different geometries", slice.name(), kMost));
        }
    }
    for (auto& [uid, series] : stacks_of_series) {
        for (DicomStack& stack : series) {
            sort_slices(stack);
            for (DicomStack& part : parts_of(std::move(stack)))
                out.push_back({"", divide_into_volumes(std::move(part))});
        }
    }
    std::stable_sort(out.begin(), out.end(),
                     [](const DicomSeries& a, const DicomSeries& b) { return a.slices() > b.slices(); });
    std::map<std::string, int> parts, next;
    for (const DicomSeries& s : out) ++parts[s.first().series_uid];
    for (DicomSeries& s : out) {
        const std::string& uid = s.first().series_uid;
        s.id = parts[uid] == 1 ? uid : fmt::format("{}/{}", uid, ++next[uid]);
        for (DicomStack& volume : s.volumes) volume.id = s.id;
    }
    return out;
}

std::optional<Mat3d> axes_of(const DicomFrame& frame) {
    const Vec3d &x = *frame.along_row, &y = *frame.along_column;
    if (!(std::abs(length(x) - 1) < 1e-3 && std::abs(length(y) - 1) < 1e-3 && std::abs(dot(x, y)) < 1e-3))
        return {};
    const Vec3d across = cross(x, y);
    return Mat3d{1 / length(x) * x, 1 / length(y) * y, 1 / length(across) * across};
}

std::vector<std::vector<std::size_t>> coincident_slices(const DicomStack& stack) {
    std::vector<std::vector<std::size_t>> out;
    if (!has_position(stack.slices[0].frame())) return out;
    const std::vector<double> gaps = gaps_of(stack.slices);
    for (std::size_t i = 0; i < gaps.size(); ++i) {
        if (gaps[i] >= kSamePosition) continue;
        if (i == 0 || gaps[i - 1] >= kSamePosition) out.push_back({i});
        out.back().push_back(i + 1);
    }
    return out;
}

std::vector<UnevenGap> uneven_gaps(const DicomStack& stack) {
    std::vector<UnevenGap> out;
    const std::vector<double> gaps = gaps_of(stack.slices);
    if (gaps.empty() || !has_position(stack.slices[0].frame())) return out;
    const double usual = usual_gap(gaps);
    for (std::size_t i = 0; i < gaps.size(); ++i) {
        if (is_uneven(gaps[i], usual)) out.push_back({i, gaps[i]});
    }
    return out;
}

namespace {

[[noreturn]] void refuse(const DicomStack& stack, const std::string& why) {
    throw GeometryError(fmt::format("series {}: {}", stack.id, why));
}

[[noreturn]] void refuse_uneven(const DicomStack& stack, const std::vector<UnevenGap>& uneven, double usual) {
    std::vector<std::string> gaps;
    for (const auto& [slice, length] : uneven)
        gaps.push_back(fmt::format("{:.4g} mm between {} and {}", length, stack.slices[slice].name(false),
                                   stack.slices[slice + 1].name(false)));
    refuse(stack,
           fmt::format("its slices are uneven: {}, elsewhere {:.4g} mm; options.resample makes them even",
                       examples(gaps), usual));
}

// The step from slice to slice, which must be the same for all. If `uneven` is not null, only its direction
// must be the same, and `uneven` receives the positions of uneven slices.
Vec3d step_of(const DicomStack& stack, const Vec3d& normal, std::vector<double>* uneven) {
    const std::vector<DicomSlice>& slices = stack.slices;
    const std::size_t n = slices.size();
    const double usual = usual_gap(gaps_of(slices));
    for (const auto& group : coincident_slices(stack)) {
        refuse(stack, fmt::format("two slices have the same position: {} and {}",
                                  slices[group[0]].name(false), slices[group[1]].name(false)));
    }
    const std::vector<UnevenGap> gaps = uneven_gaps(stack);
    if (!gaps.empty() && !uneven) refuse_uneven(stack, gaps, usual);
    const Vec3d whole = *slices[n - 1].frame().position - *slices[0].frame().position;
    const double extent = dot(whole, normal);
    for (std::size_t i = 0; i + 1 < n; ++i) {
        const Vec3d next = *slices[i + 1].frame().position - *slices[i].frame().position;
        const Vec3d off = next - dot(next, normal) / extent * whole;
        if (length(off - dot(off, normal) * normal) > 0.01 + std::min(0.01, 0.01 * usual)) {
            refuse(stack, fmt::format("its slices are shifted sideways between {} and {}",
                                      slices[i].name(false), slices[i + 1].name(false)));
        }
    }
    double steps = static_cast<double>(n - 1);
    if (!gaps.empty()) {
        steps = std::max(1.0, std::round(extent / usual));
        if (steps > 10 * static_cast<double>(n)) refuse(stack, "its slices are too uneven to be resampled");
        for (const DicomSlice& s : slices) uneven->push_back((s.along - slices[0].along) / extent * steps);
    }
    return 1 / steps * whole;
}

// The spacing between columns and between rows, after checking what else the headers lack.
std::array<double, 2> in_plane_spacing(const DicomStack& stack, const std::optional<Vec3d>& given) {
    const DicomFrame& first = stack.slices[0].frame();
    if (!first.spacing && !given)
        refuse(stack, "it has no PixelSpacing; give the spacing with options.spacing, in mm");
    const std::array<double, 2> in_plane =
        first.spacing ? *first.spacing : std::array<double, 2>{(*given)[0], (*given)[1]};
    if (!(in_plane[0] > 0) || !(in_plane[1] > 0)) refuse(stack, "its PixelSpacing is not positive");
    if (!has_position(first) && !given) {
        refuse(stack,
               "its slices have no position and orientation (ImagePositionPatient, "
               "ImageOrientationPatient); options.spacing stacks them by number");
    }
    if (stack.slices.size() == 1 && !given) {
        refuse(stack, fmt::format("it is a single slice, whose thickness is unknown; set options.spacing to "
                                  "{:.6g},{:.6g},Z with the thickness Z in mm",
                                  in_plane[0], in_plane[1]));
    }
    return in_plane;
}

// Refuses slices of several files if their numbers do not put them in order, and warns of what is a guess.
std::vector<std::string> check_numbers(const DicomStack& stack) {
    const std::vector<DicomSlice>& slices = stack.slices;
    const bool numbered = std::any_of(slices.begin(), slices.end(),
                                      [](const DicomSlice& s) { return s.file->instance.has_value(); });
    std::vector<std::optional<std::int64_t>> growths;
    for (std::size_t i = 1; i < slices.size(); ++i) {
        const DicomFile &before = *slices[i - 1].file, &file = *slices[i].file;
        if (&before == &file || !numbered) continue;
        if (!before.instance || !file.instance || *before.instance == *file.instance)
            refuse(stack, fmt::format("its slices have no position, and their numbers do not tell the order "
                                      "of {} and {}; put the slices of one volume into a folder of their own",
                                      slices[i - 1].name(false), slices[i].name(false)));
        growths.push_back(*file.instance - *before.instance);
    }
    std::vector<std::string> warnings = {
        fmt::format("the slices have {}, and the volume may be mirrored",
                    numbered || stack.first().frames.size() == slices.size()
                        ? "no position; they are stacked by number"
                        : "neither position nor number; they are stacked by the names of their files")};
    if (growths.size() + 1 == slices.size()) {
        std::string gap = number_gap(growths, [&](std::size_t i) { return slices[i].name(false); });
        if (!gap.empty()) warnings.push_back(std::move(gap));
    }
    return warnings;
}

// A single slice states its spacing, but not the distance to a next one.
std::string contradiction(const DicomStack& stack, const Geometry& stated, const Vec3d& given) {
    const Vec3d& s = stated.spacing;
    const bool single = stack.slices.size() == 1;
    return fmt::format(
        "series {}: its headers state a spacing of {:.6g} x {:.6g}{} mm, not {:g} x {:g}{}; {}", stack.id,
        s[0], s[1], single ? "" : fmt::format(" x {:.6g}", s[2]), given[0], given[1],
        single ? "" : fmt::format(" x {:g}", given[2]),
        single ? fmt::format("set options.spacing to {:.6g},{:.6g},{:g}", s[0], s[1], given[2])
               : "do not set options.spacing");
}

}  // namespace

StackGeometry geometry_of(const DicomStack& stack, const ScanOptions& options) {
    const DicomFile& file = stack.first();
    const DicomFrame first = stack.slices[0].frame();
    const std::size_t n = stack.slices.size();
    const auto& given = options.spacing;
    StackGeometry out;
    Geometry& g = out.geometry;
    g.dims = {file.columns, file.rows, static_cast<std::int64_t>(n)};

    const std::array<double, 2> in_plane = in_plane_spacing(stack, given);
    Mat3d axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  // directions of the index axes
    Vec3d step{0, 0, given ? (*given)[2] : 0};
    if (has_position(first)) {
        const std::optional<Mat3d> stated = axes_of(first);
        if (!stated) refuse(stack, kBadOrientation);
        axes = *stated;
        g.origin = *first.position;
        const Vec3d normal = axes[2];
        step =
            n == 1 ? (*given)[2] * normal : step_of(stack, normal, options.resample ? &out.uneven : nullptr);
        out.tilt = std::acos(std::min(1.0, dot(step, normal) / length(step))) * 180 / M_PI;
        if (out.tilt > 0.1) {
            constexpr double kLargestTilt = 45;  // gantries tilt by up to 30 degrees
            const std::string_view cause =
                out.tilt < kLargestTilt
                    ? "the gantry is tilted"
                    : "the positions of the slices contradict their orientation, as if the "
                      "gantry were tilted";
            out.warnings.push_back(
                fmt::format("{} by {:.1f} degrees; the volume is sheared accordingly", cause, out.tilt));
        } else {
            out.tilt = 0;
        }
    } else {
        out.warnings = check_numbers(stack);
    }
    std::set<std::string_view> frames_of_reference;
    for (const DicomSlice& s : stack.slices) frames_of_reference.insert(s.file->frame_of_reference);
    frames_of_reference.erase("");
    if (frames_of_reference.size() > 1) {
        out.warnings.push_back(
            fmt::format("the slices name {} frames of reference; they are read as one volume, because their "
                        "positions fit",
                        frames_of_reference.size()));
    }
    g.spacing = {in_plane[0], in_plane[1], length(step)};
    if (given) {
        for (int axis = 0; axis < 3; ++axis) {
            if (std::abs(g.spacing[axis] - (*given)[axis]) > 0.01 * g.spacing[axis])
                throw OptionError(contradiction(stack, g, *given));
        }
    }
    for (int row = 0; row < 3; ++row)
        g.direction[row] = {axes[0][row], axes[1][row], step[row] / length(step)};
    if (!out.uneven.empty()) {
        g.dims[2] = std::lround(out.uneven.back()) + 1;
        out.warnings.push_back(fmt::format(
            "{} uneven slices are resampled to {} slices, {:.4g} mm apart, by linear interpolation", n,
            g.dims[2], length(step)));
    }
    check_geometry(g);
    return out;
}

}  // namespace marrow::internal::io
