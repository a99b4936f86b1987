#include "dicom_stack.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include <marrow/error.h>

#include "header_text.h"

namespace marrow {

namespace {

Vec3d operator-(const Vec3d& a, const Vec3d& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Vec3d operator*(double s, const Vec3d& a) {
    return {s * a[0], s * a[1], s * a[2]};
}
double dot(const Vec3d& a, const Vec3d& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
double length(const Vec3d& a) {
    return std::sqrt(dot(a, a));
}
Vec3d cross(const Vec3d& a, const Vec3d& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

template <class V>
bool close(const std::optional<V>& a, const std::optional<V>& b, double tolerance) {
    if (!a || !b) return a.has_value() == b.has_value();
    for (std::size_t i = 0; i < a->size(); ++i) {
        if (!(std::abs((*a)[i] - (*b)[i]) <= tolerance)) return false;
    }
    return true;
}

bool belongs(const DicomSlice& s, const DicomStack& stack) {
    constexpr double turned = 1e-3, scaled = 1e-4;
    const DicomFile &a = *s.file, &b = stack.first();
    const DicomFrame &f = s.frame(), &g = stack.slices[0].frame();
    return a.series_uid == b.series_uid && a.frame_of_reference == b.frame_of_reference &&
           a.columns == b.columns && a.rows == b.rows && a.echo == b.echo && a.localizer == b.localizer &&
           a.modality == b.modality && f.position.has_value() == g.position.has_value() &&
           close(f.along_row, g.along_row, turned) && close(f.along_column, g.along_column, turned) &&
           close(f.spacing, g.spacing, scaled);
}

// Sorts by the place along the normal, where the slices have one.
void sort_slices(DicomStack& stack) {
    const DicomFrame first = stack.slices[0].frame();
    if (!first.position || !first.along_row || !first.along_column) return;
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
    std::vector<DicomStack> alike;
    for (const DicomFile& file : files) {
        for (std::size_t i = 0; i < file.frames.size(); ++i) {
            const DicomSlice slice{&file, i};
            const auto at = std::find_if(alike.begin(), alike.end(),
                                         [&](const DicomStack& s) { return belongs(slice, s); });
            if (at != alike.end())
                at->slices.push_back(slice);
            else
                alike.push_back({"", {slice}});
        }
    }
    std::vector<DicomStack> stacks;
    for (DicomStack& stack : alike) {
        sort_slices(stack);
        for (DicomStack& part : split_where_far(std::move(stack))) stacks.push_back(std::move(part));
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

Geometry geometry_of(const DicomStack& stack, std::vector<std::string>& warnings) {
    const auto refuse = [&](const std::string& why) {
        return GeometryError(fmt::format("series {}: {}", stack.id, why));
    };
    const DicomFile& file = stack.first();
    const DicomFrame first = stack.slices[0].frame();
    if (!first.position || !first.along_row || !first.along_column) {
        throw refuse(
            "its slices have no position and orientation (ImagePositionPatient, ImageOrientationPatient)");
    }
    if (!first.spacing || !((*first.spacing)[0] > 0) || !((*first.spacing)[1] > 0))
        throw refuse("has no PixelSpacing");
    const Vec3d &x = *first.along_row, &y = *first.along_column;
    if (!(std::abs(length(x) - 1) < 1e-3 && std::abs(length(y) - 1) < 1e-3 && std::abs(dot(x, y)) < 1e-3)) {
        throw refuse("its ImageOrientationPatient is not two perpendicular unit vectors");
    }
    const Vec3d cross_xy = cross(x, y);
    const Vec3d normal = 1 / length(cross_xy) * cross_xy;

    const std::vector<DicomSlice>& slices = stack.slices;
    const std::size_t n = slices.size();
    Vec3d step = normal;
    if (n == 1) {
        const double thickness = first.thickness.value_or(0) > 0 ? *first.thickness : 1;
        step = thickness * normal;
        warnings.push_back("the series has a single slice");
    } else {
        const std::vector<double> gaps = gaps_of(slices);
        const double usual = usual_gap(gaps);
        const double tolerance = std::min(0.01, 0.01 * usual);
        const auto pair = [&](std::size_t i) {
            return fmt::format("{} and {}", slices[i].name(), slices[i + 1].name());
        };
        for (std::size_t i = 0; i + 1 < n; ++i) {
            if (gaps[i] < 1e-4) throw refuse(fmt::format("two slices lie at the same place: {}", pair(i)));
        }
        for (std::size_t i = 0; i + 1 < n; ++i) {
            if (std::abs(gaps[i] - usual) > tolerance) {
                throw refuse(fmt::format("its slices are uneven: {:.4g} mm between {}, {:.4g} mm elsewhere",
                                         gaps[i], pair(i), usual));
            }
        }
        step =
            1 / static_cast<double>(n - 1) * (*slices[n - 1].frame().position - *slices[0].frame().position);
        for (std::size_t i = 0; i + 1 < n; ++i) {
            const Vec3d off = *slices[i + 1].frame().position - *slices[i].frame().position - step;
            if (length(off - dot(off, normal) * normal) > 0.01 + tolerance) {
                throw refuse(fmt::format("its slices are shifted sideways between {}", pair(i)));
            }
        }
        const double tilt = std::acos(std::min(1.0, dot(step, normal) / length(step))) * 180 / M_PI;
        if (tilt > 0.1)
            warnings.push_back(fmt::format(
                "the gantry is tilted by {:.1f} degrees; the volume is sheared accordingly", tilt));
    }
    Geometry g;
    g.dims = {file.columns, file.rows, static_cast<std::int64_t>(n)};
    g.spacing = {(*first.spacing)[0], (*first.spacing)[1], length(step)};
    g.origin = *slices[0].frame().position;
    for (int row = 0; row < 3; ++row)
        g.direction[row] = {x[row] / length(x), y[row] / length(y), step[row] / length(step)};
    check_geometry(g);
    return g;
}

}  // namespace marrow
