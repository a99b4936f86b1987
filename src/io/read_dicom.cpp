#include "read_dicom.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include <marrow/error.h>

#include "byte_stream.h"
#include "header_text.h"
#include "parallel_slices.h"
#include "read_dicom_file.h"

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

struct Slice {
    const DicomFile* file;
    std::size_t index;  // of the frame in the file
    double along = 0;   // mm along the normal

    const DicomFrame& frame() const { return file->frames[index]; }
    std::string name() const {
        return file->frames.size() == 1 ? shown(file->path)
                                        : fmt::format("{} frame {}", shown(file->path), index + 1);
    }
};

// Frames that could be slices of one volume: of one series, size, orientation, spacing and frame of
// reference.
struct Stack {
    std::string id;
    std::vector<Slice> slices;

    const DicomFile& first() const { return *slices[0].file; }
};

struct Found {
    std::vector<DicomFile> files;
    std::vector<Stack> stacks;
    std::vector<std::string> warnings;
};

template <class V>
bool close(const std::optional<V>& a, const std::optional<V>& b, double tolerance) {
    if (!a || !b) return a.has_value() == b.has_value();
    for (std::size_t i = 0; i < a->size(); ++i) {
        if (!(std::abs((*a)[i] - (*b)[i]) <= tolerance)) return false;
    }
    return true;
}

bool belongs(const Slice& s, const Stack& stack) {
    constexpr double turned = 1e-3, scaled = 1e-4;
    const DicomFile &a = *s.file, &b = stack.first();
    const DicomFrame &f = s.frame(), &g = stack.slices[0].frame();
    return a.series_uid == b.series_uid && a.frame_of_reference == b.frame_of_reference &&
           a.columns == b.columns && a.rows == b.rows && a.echo == b.echo && a.localizer == b.localizer &&
           a.modality == b.modality && f.position.has_value() == g.position.has_value() &&
           close(f.along_row, g.along_row, turned) && close(f.along_column, g.along_column, turned) &&
           close(f.spacing, g.spacing, scaled);
}

Found find_stacks(const std::vector<std::filesystem::path>& paths, const ScanOptions& options) {
    std::vector<std::optional<DicomFile>> headers(paths.size());
    std::vector<std::string> failures(paths.size());
    for_each_slice(paths.size(), options.threads, options.progress, 0, 0.2, [&](std::size_t i) {
        try {
            headers[i] = read_dicom_header(paths[i]);
        } catch (const InputError& error) {
            failures[i] = error.what();
        }
    });

    Found found;
    std::size_t without_image = 0;
    for (std::size_t i = 0; i < paths.size(); ++i) {
        if (headers[i])
            found.files.push_back(std::move(*headers[i]));
        else if (failures[i].empty())
            ++without_image;
    }
    for (const auto& failure : failures) {
        if (failure.empty()) continue;
        if (found.files.empty()) throw InputError(failure);
        found.warnings.push_back(failure + "; it is left out");
    }
    if (found.files.empty()) {
        throw InputError(fmt::format("{}: none of {} DICOM files holds an image",
                                     shown(paths[0].parent_path()), paths.size()));
    }
    if (without_image > 0)
        found.warnings.push_back(fmt::format("{} DICOM files hold no image and are left out", without_image));

    for (const DicomFile& file : found.files) {
        for (std::size_t i = 0; i < file.frames.size(); ++i) {
            const Slice slice{&file, i};
            const auto at = std::find_if(found.stacks.begin(), found.stacks.end(),
                                         [&](const Stack& s) { return belongs(slice, s); });
            if (at != found.stacks.end())
                at->slices.push_back(slice);
            else
                found.stacks.push_back({"", {slice}});
        }
    }
    // A series in several stacks gets a number for each, in the order of size.
    std::stable_sort(found.stacks.begin(), found.stacks.end(),
                     [](const Stack& a, const Stack& b) { return a.slices.size() > b.slices.size(); });
    std::map<std::string, int> stacks_of, next;
    for (const Stack& s : found.stacks) ++stacks_of[s.first().series_uid];
    for (Stack& s : found.stacks) {
        const std::string& uid = s.first().series_uid;
        s.id = stacks_of[uid] == 1 ? uid : fmt::format("{}/{}", uid, ++next[uid]);
    }
    return found;
}

// Sorts the slices by their place along the normal and derives the geometry.
// \throw GeometryError where they do not make an even volume.
Geometry sorted_geometry(Stack& stack, std::vector<std::string>& warnings) {
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

    auto& slices = stack.slices;
    for (Slice& s : slices) s.along = dot(*s.frame().position, normal);
    std::stable_sort(slices.begin(), slices.end(),
                     [](const Slice& a, const Slice& b) { return a.along < b.along; });

    const std::size_t n = slices.size();
    Vec3d step = normal;
    if (n == 1) {
        const double thickness = first.thickness.value_or(0) > 0 ? *first.thickness : 1;
        step = thickness * normal;
        warnings.push_back("the series has a single slice");
    } else {
        std::vector<double> gaps(n - 1);
        for (std::size_t i = 0; i + 1 < n; ++i) gaps[i] = slices[i + 1].along - slices[i].along;
        std::vector<double> ordered = gaps;
        std::nth_element(ordered.begin(), ordered.begin() + static_cast<std::ptrdiff_t>(ordered.size() / 2),
                         ordered.end());
        const double usual = ordered[ordered.size() / 2];
        const double tolerance = std::min(0.01, 0.01 * usual);
        step =
            1 / static_cast<double>(n - 1) * (*slices[n - 1].frame().position - *slices[0].frame().position);
        for (std::size_t i = 0; i + 1 < n; ++i) {
            const std::string between =
                fmt::format("between {} and {}", slices[i].name(), slices[i + 1].name());
            if (gaps[i] < 1e-4)
                throw refuse(fmt::format("two slices lie at the same place: {} and {}", slices[i].name(),
                                         slices[i + 1].name()));
            if (!(std::abs(gaps[i] - usual) <= tolerance)) {
                throw refuse(fmt::format("its slices are uneven: {:.4g} mm {}, {:.4g} mm elsewhere", gaps[i],
                                         between, usual));
            }
            const Vec3d shift = *slices[i + 1].frame().position - *slices[i].frame().position - step;
            if (!(length(shift - dot(shift, normal) * normal) <= 0.01 + tolerance)) {
                throw refuse(fmt::format("its slices are shifted sideways {}", between));
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

SeriesInfo describe(const Stack& stack) {
    const DicomFile& file = stack.first();
    SeriesInfo info{stack.id,
                    file.description,
                    file.modality,
                    {file.columns, file.rows, static_cast<std::int64_t>(stack.slices.size())},
                    {},
                    0};
    std::vector<const DicomFile*> files;
    for (const Slice& s : stack.slices) files.push_back(s.file);
    std::sort(files.begin(), files.end());
    info.files = static_cast<std::size_t>(std::unique(files.begin(), files.end()) - files.begin());
    Stack copy = stack;
    std::vector<std::string> ignored;
    try {
        info.spacing = sorted_geometry(copy, ignored).spacing;
    } catch (const InputError&) {  // it can be listed all the same
        if (const auto spacing = stack.slices[0].frame().spacing)
            info.spacing = {(*spacing)[0], (*spacing)[1], 0};
    }
    return info;
}

std::string listed(const std::vector<const Stack*>& stacks) {
    std::string out;
    for (const Stack* s : stacks) {
        const SeriesInfo info = describe(*s);
        out += fmt::format("{}{} ({}, {}, {} x {} x {}, {} files)", out.empty() ? "" : "; ", info.id,
                           info.modality.empty() ? "modality unknown" : info.modality,
                           shown(info.description), info.dims[0], info.dims[1], info.dims[2], info.files);
    }
    return out;
}

Stack& choose(Found& found, const std::filesystem::path& wanted, const ScanOptions& options,
              std::vector<std::string>& warnings) {
    std::vector<Stack*> candidates;
    for (Stack& s : found.stacks) candidates.push_back(&s);
    const auto keep = [&](auto&& condition) {
        std::vector<Stack*> kept;
        std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(kept), condition);
        return kept;
    };
    if (!options.series.empty()) {
        auto chosen = keep([&](const Stack* s) { return s->id == options.series; });
        if (chosen.empty())
            chosen = keep([&](const Stack* s) { return s->first().series_uid == options.series; });
        if (chosen.empty()) {
            throw GeometryError(fmt::format("there is no series {}; there are: {}", shown(options.series),
                                            listed({candidates.begin(), candidates.end()})));
        }
        candidates = std::move(chosen);
    } else if (!wanted.empty()) {
        candidates = keep([&](const Stack* s) {
            return std::any_of(s->slices.begin(), s->slices.end(),
                               [&](const Slice& slice) { return slice.file->path == wanted; });
        });
        if (candidates.empty()) throw InputError(fmt::format("{}: holds no image", shown(wanted)));
    } else {
        // scouts and single images are no volumes, unless there is nothing else
        const auto volumes =
            keep([](const Stack* s) { return s->slices.size() > 1 && !s->first().localizer; });
        if (!volumes.empty() && volumes.size() < candidates.size()) {
            warnings.push_back(
                fmt::format("{} scout or single images are left out", candidates.size() - volumes.size()));
            candidates = volumes;
        }
    }
    if (candidates.size() > 1) {
        throw GeometryError(fmt::format("there are {} series; choose one with --series (options.series): {}",
                                        candidates.size(), listed({candidates.begin(), candidates.end()})));
    }
    return *candidates[0];
}

struct Rescale {
    double slope, intercept;
};

Rescale rescale_of(const Slice& s) {
    const Rescale r{s.frame().slope.value_or(1), s.frame().intercept.value_or(0)};
    if (r.slope == 0 || !std::isfinite(r.slope) || !std::isfinite(r.intercept)) {
        throw InputError(fmt::format("{}: its rescale slope or intercept is not a usable number", s.name()));
    }
    return r;
}

// Decodes into `volume`. Returns false where it is int16 and a value does not fit.
bool load_slices(const Stack& stack, const ScanOptions& options, double begin, Volume& volume) {
    // a file of many frames is decoded once
    std::map<const DicomFile*, std::vector<std::size_t>> slices_of;
    for (std::size_t k = 0; k < stack.slices.size(); ++k) slices_of[stack.slices[k].file].push_back(k);
    const std::vector<std::pair<const DicomFile*, std::vector<std::size_t>>> files(slices_of.begin(),
                                                                                   slices_of.end());

    const std::size_t area = static_cast<std::size_t>(volume.geometry().dims[0] * volume.geometry().dims[1]);
    std::atomic<bool> fits = true;
    for_each_slice(files.size(), options.threads, options.progress, begin, 1, [&](std::size_t i) {
        if (!fits) return;
        const std::vector<std::int32_t> stored = decode_dicom(*files[i].first);
        for (const std::size_t k : files[i].second) {
            const Slice& slice = stack.slices[k];
            const auto [slope, intercept] = rescale_of(slice);
            const std::int32_t* from = stored.data() + slice.index * area;
            if (volume.type() == SampleType::float32) {
                float* to = volume.samples<float>() + k * area;
                for (std::size_t j = 0; j < area; ++j)
                    to[j] = static_cast<float>(slope * from[j] + intercept);
            } else {
                std::int16_t* to = volume.samples<std::int16_t>() + k * area;
                const auto m = static_cast<std::int64_t>(slope), b = static_cast<std::int64_t>(intercept);
                bool all_fit = true;
                for (std::size_t j = 0; j < area; ++j) {
                    const std::int64_t value = m * from[j] + b;
                    to[j] = static_cast<std::int16_t>(value);
                    all_fit &= to[j] == value;
                }
                if (!all_fit) fits = false;
            }
        }
    });
    return fits;
}

}  // namespace

std::vector<SeriesInfo> list_dicom(const std::vector<std::filesystem::path>& files,
                                   const ScanOptions& options) {
    const Found found = find_stacks(files, options);
    std::vector<SeriesInfo> out;
    for (const Stack& s : found.stacks) out.push_back(describe(s));
    return out;
}

Volume load_dicom(const std::vector<std::filesystem::path>& files, const std::filesystem::path& wanted,
                  const ScanOptions& options, ScanInfo& info) {
    Found found = find_stacks(files, options);
    info.warnings = found.warnings;
    Stack& stack = choose(found, wanted, options, info.warnings);
    const Geometry geometry = sorted_geometry(stack, info.warnings);
    info.series = describe(stack);

    bool integral = true, rescaled = false;
    for (const Slice& s : stack.slices) {
        const auto [slope, intercept] = rescale_of(s);
        integral &= slope == std::floor(slope) && intercept == std::floor(intercept) &&
                    std::abs(slope) < 32768 && std::abs(intercept) < 1e9;
        rescaled |= s.frame().slope.has_value();
    }
    if (stack.first().modality == "CT" && !rescaled)
        info.warnings.push_back("the CT has no rescale slope: its values are not HU");

    constexpr double headers_done = 0.2;
    if (integral) {
        Volume volume(geometry, SampleType::int16);
        if (load_slices(stack, options, headers_done, volume)) return volume;
    }
    Volume volume(geometry, SampleType::float32);
    load_slices(stack, options, headers_done, volume);
    return volume;
}

}  // namespace marrow
