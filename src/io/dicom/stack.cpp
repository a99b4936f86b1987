#include "stack.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include <marrow/error.h>
#include <marrow/vector.h>

#include "io/bytes/text.h"

namespace marrow {

namespace {

template <class V>
bool close(const std::optional<V>& a, const std::optional<V>& b, double tolerance) {
    if (!a || !b) return a.has_value() == b.has_value();
    for (std::size_t i = 0; i < a->size(); ++i) {
        if (!(std::abs((*a)[i] - (*b)[i]) <= tolerance)) return false;
    }
    return true;
}

// Whether a slice of the same series goes with others of it.
bool belongs(const DicomSlice& s, const DicomStack& stack) {
    constexpr double turned = 1e-3, scaled = 1e-4;
    const DicomFile &a = *s.file, &b = stack.first();
    const DicomFrame &f = s.frame(), &g = stack.slices[0].frame();
    return a.frame_of_reference == b.frame_of_reference && a.columns == b.columns && a.rows == b.rows &&
           a.echo == b.echo && a.localizer == b.localizer && a.modality == b.modality &&
           f.position.has_value() == g.position.has_value() && close(f.along_row, g.along_row, turned) &&
           close(f.along_column, g.along_column, turned) && close(f.spacing, g.spacing, scaled);
}

bool has_place(const DicomFrame& frame) {
    return frame.position && frame.along_row && frame.along_column;
}

// Sorts by the place along the normal; slices without one by their number, which is a guess that only
// options.spacing lets pass.
void sort_slices(DicomStack& stack) {
    const DicomFrame first = stack.slices[0].frame();
    if (!has_place(first)) {
        std::stable_sort(stack.slices.begin(), stack.slices.end(),
                         [](const DicomSlice& a, const DicomSlice& b) {
                             return a.file->instance.value_or(0) < b.file->instance.value_or(0);
                         });
        return;
    }
    const Vec3d across = cross(*first.along_row, *first.along_column);
    for (DicomSlice& s : stack.slices) s.along = dot(*s.frame().position, across) / length(across);
    std::stable_sort(stack.slices.begin(), stack.slices.end(),
                     [](const DicomSlice& a, const DicomSlice& b) { return a.along < b.along; });
}

// Between neighbours, mm.
std::vector<double> gaps_of(const std::vector<DicomSlice>& slices) {
    std::vector<double> gaps;
    for (std::size_t i = 0; i + 1 < slices.size(); ++i) gaps.push_back(slices[i + 1].along - slices[i].along);
    return gaps;
}

double usual_gap(std::vector<double> gaps) {
    const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
    std::nth_element(gaps.begin(), middle, gaps.end());
    return *middle;
}

// By more than 1 % or 0.01 mm.
bool is_uneven(double gap, double usual) {
    return std::abs(gap - usual) > std::min(0.01, 0.01 * usual);
}

// Cuts a sorted stack where it is far apart: head and feet under one number are two volumes, not one with a
// gap.
std::vector<DicomStack> split_where_far(DicomStack stack) {
    constexpr double far = 10;  // usual gaps
    const std::vector<double> gaps = gaps_of(stack.slices);
    const double usual = gaps.empty() ? 0 : usual_gap(gaps);
    std::vector<DicomStack> out(1);
    for (std::size_t i = 0; i < stack.slices.size(); ++i) {
        if (i > 0 && usual > 0 && gaps[i - 1] > far * usual) out.emplace_back();
        out.back().slices.push_back(stack.slices[i]);
    }
    // one or two slices apart from the others are no volume: a gap after all
    if (std::any_of(out.begin(), out.end(), [](const DicomStack& s) { return s.slices.size() < 3; }))
        return {std::move(stack)};
    return out;
}

}  // namespace

std::string DicomSlice::name() const {
    return file->frames.size() == 1 ? shown(file->path)
                                    : fmt::format("{} frame {}", shown(file->path), index + 1);
}

std::vector<DicomStack> stacks_of(const std::vector<DicomFile>& files) {
    constexpr std::size_t most = 2000;  // in one series; each slice is compared with all
    std::map<std::string_view, std::vector<DicomStack>> alike;  // of each series
    for (const DicomFile& file : files) {
        std::vector<DicomStack>& series = alike[file.series_uid];
        for (std::size_t i = 0; i < file.frames.size(); ++i) {
            const DicomSlice slice{&file, i};
            const auto at = std::find_if(series.begin(), series.end(),
                                         [&](const DicomStack& s) { return belongs(slice, s); });
            if (at != series.end())
                at->slices.push_back(slice);
            else if (series.size() < most)
                series.push_back({"", {slice}});
            else
                throw InputError(
                    fmt::format("{}: its series falls into more than {} volumes of different geometry",
                                slice.name(), most));
        }
    }
    std::vector<DicomStack> stacks;
    for (auto& [uid, series] : alike) {
        for (DicomStack& stack : series) {
            sort_slices(stack);
            for (DicomStack& part : split_where_far(std::move(stack))) stacks.push_back(std::move(part));
        }
    }
    std::stable_sort(stacks.begin(), stacks.end(), [](const DicomStack& a, const DicomStack& b) {
        return a.slices.size() > b.slices.size();
    });
    std::map<std::string, int> parts, next;
    for (const DicomStack& s : stacks) ++parts[s.first().series_uid];
    for (DicomStack& s : stacks) {
        const std::string& uid = s.first().series_uid;
        s.id = parts[uid] == 1 ? uid : fmt::format("{}/{}", uid, ++next[uid]);
    }
    return stacks;
}

std::vector<std::vector<std::size_t>> slices_at_one_place(const DicomStack& stack) {
    constexpr double nothing = 1e-4;  // mm
    std::vector<std::vector<std::size_t>> out;
    if (!has_place(stack.slices[0].frame())) return out;
    const std::vector<double> gaps = gaps_of(stack.slices);
    for (std::size_t i = 0; i < gaps.size(); ++i) {
        if (gaps[i] >= nothing) continue;
        if (i == 0 || gaps[i - 1] >= nothing) out.push_back({i});
        out.back().push_back(i + 1);
    }
    return out;
}

std::vector<std::string> uneven_gaps(const DicomStack& stack) {
    std::vector<std::string> out;
    const std::vector<double> gaps = gaps_of(stack.slices);
    if (gaps.empty() || !has_place(stack.slices[0].frame())) return out;
    const double usual = usual_gap(gaps);
    for (std::size_t i = 0; i < gaps.size(); ++i) {
        if (is_uneven(gaps[i], usual))
            out.push_back(fmt::format("{:.4g} mm between {} and {}", gaps[i], stack.slices[i].name(),
                                      stack.slices[i + 1].name()));
    }
    return out;
}

namespace {

[[noreturn]] void refuse(const DicomStack& stack, const std::string& why) {
    throw GeometryError(fmt::format("series {}: {}", stack.id, why));
}

// The first slice's axes x and y, and the third across them.
Mat3d axes_of(const DicomStack& stack) {
    const Vec3d &x = *stack.slices[0].frame().along_row, &y = *stack.slices[0].frame().along_column;
    if (!(std::abs(length(x) - 1) < 1e-3 && std::abs(length(y) - 1) < 1e-3 && std::abs(dot(x, y)) < 1e-3))
        refuse(stack, "its ImageOrientationPatient is not two perpendicular unit vectors");
    const Vec3d across = cross(x, y);
    return {1 / length(x) * x, 1 / length(y) * y, 1 / length(across) * across};
}

// The step from slice to slice, which must be one and the same for all, save for its length where `uneven`
// is not null.
Vec3d step_of(const DicomStack& stack, const Vec3d& normal, std::vector<double>* uneven) {
    const std::vector<DicomSlice>& slices = stack.slices;
    const std::size_t n = slices.size();
    const double usual = usual_gap(gaps_of(slices));
    for (const auto& group : slices_at_one_place(stack)) {
        refuse(stack, fmt::format("two slices lie at the same place: {} and {}", slices[group[0]].name(),
                                  slices[group[1]].name()));
    }
    const std::vector<std::string> odd = uneven_gaps(stack);
    if (!odd.empty() && !uneven) {
        constexpr std::size_t most = 5;
        std::string list;
        for (std::size_t i = 0; i < std::min(odd.size(), most); ++i) list += odd[i] + ", ";
        if (odd.size() > most) list += fmt::format("{} more such gaps, ", odd.size() - most);
        refuse(stack,
               fmt::format("its slices are uneven: {}{:.4g} mm elsewhere; --resample (options.resample) "
                           "makes them even",
                           list, usual));
    }
    const Vec3d whole = *slices[n - 1].frame().position - *slices[0].frame().position;
    const double extent = dot(whole, normal);
    for (std::size_t i = 0; i + 1 < n; ++i) {
        const Vec3d next = *slices[i + 1].frame().position - *slices[i].frame().position;
        const Vec3d off = next - dot(next, normal) / extent * whole;
        if (length(off - dot(off, normal) * normal) > 0.01 + std::min(0.01, 0.01 * usual)) {
            refuse(stack, fmt::format("its slices are shifted sideways between {} and {}", slices[i].name(),
                                      slices[i + 1].name()));
        }
    }
    double steps = static_cast<double>(n - 1);
    if (!odd.empty()) {
        steps = std::max(1.0, std::round(extent / usual));
        if (steps > 10 * static_cast<double>(n)) refuse(stack, "its slices are too uneven to be made even");
        for (const DicomSlice& s : slices) uneven->push_back((s.along - slices[0].along) / extent * steps);
    }
    return 1 / steps * whole;
}

}  // namespace

StackPlace place_of(const DicomStack& stack, const ScanOptions& options) {
    const DicomFile& file = stack.first();
    const DicomFrame first = stack.slices[0].frame();
    const std::size_t n = stack.slices.size();
    const auto& given = options.spacing;
    StackPlace out;
    Geometry& g = out.geometry;
    g.dims = {file.columns, file.rows, static_cast<std::int64_t>(n)};

    if (!first.spacing && !given)
        refuse(stack, "has no PixelSpacing; give it with --spacing X,Y,Z (options.spacing), in mm");
    const std::array<double, 2> in_plane =
        first.spacing ? *first.spacing : std::array<double, 2>{(*given)[0], (*given)[1]};
    if (!(in_plane[0] > 0) || !(in_plane[1] > 0)) refuse(stack, "its PixelSpacing is not positive");
    if (!has_place(first) && !given) {
        refuse(stack,
               "its slices have no position and orientation (ImagePositionPatient, "
               "ImageOrientationPatient); --spacing X,Y,Z (options.spacing) stacks them by their number");
    }
    if (n == 1 && !given) {
        refuse(stack, "is a single slice; --spacing X,Y,Z (options.spacing) gives it a thickness in mm");
    }

    Mat3d axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  // axes[a]: the direction of index axis a
    Vec3d step{0, 0, given ? (*given)[2] : 0};
    if (has_place(first)) {
        axes = axes_of(stack);
        g.origin = *first.position;
        const Vec3d normal = axes[2];
        step =
            n == 1 ? (*given)[2] * normal : step_of(stack, normal, options.resample ? &out.uneven : nullptr);
        out.tilt = std::acos(std::min(1.0, dot(step, normal) / length(step))) * 180 / M_PI;
        if (out.tilt > 0.1) {
            out.warnings.push_back(fmt::format(
                "the gantry is tilted by {:.1f} degrees; the volume is sheared accordingly", out.tilt));
        } else {
            out.tilt = 0;
        }
    } else {
        out.warnings.push_back(
            "the slices have no position: they are stacked by their number, and may lie mirrored");
    }
    g.spacing = {in_plane[0], in_plane[1], length(step)};
    if (given) {
        for (int axis = 0; axis < 3; ++axis) {
            if (std::abs(g.spacing[axis] - (*given)[axis]) > 0.01 * g.spacing[axis])
                refuse(stack, fmt::format("its spacing is {:.4g} x {:.4g} x {:.4g} mm; do not give another",
                                          g.spacing[0], g.spacing[1], g.spacing[2]));
        }
    }
    for (int row = 0; row < 3; ++row)
        g.direction[row] = {axes[0][row], axes[1][row], step[row] / length(step)};
    if (!out.uneven.empty()) {
        g.dims[2] = std::lround(out.uneven.back()) + 1;
        out.warnings.push_back(
            fmt::format("{} uneven slices are resampled to {}, {:.4g} mm apart, linear between neighbours", n,
                        g.dims[2], length(step)));
    }
    check_geometry(g);
    return out;
}

}  // namespace marrow
