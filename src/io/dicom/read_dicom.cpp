#include "read_dicom.h"

#include <fmt/format.h>

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <type_traits>

#include <marrow/error.h>

#include "stack.h"
#include "io/bytes/text.h"
#include "io/scan/parallel_slices.h"
#include "file.h"

namespace marrow {

namespace {

struct Found {
    std::vector<DicomFile> files;
    std::vector<DicomStack> stacks;  // they point into files
    std::vector<std::string> warnings;
    std::string damage;  // of a file that may be a slice of any of them; empty: none
};

constexpr double headers_done = 0.2;  // of the progress

Found find_stacks(const std::vector<std::filesystem::path>& paths, const std::filesystem::path& wanted,
                  const ScanOptions& options) {
    std::vector<std::optional<DicomFile>> headers(paths.size());
    std::vector<std::string> failures(paths.size());
    for_each_slice(paths.size(), options.threads, options.progress, 0, headers_done,
                   [&](std::size_t i, const Step& step) {
                       try {
                           headers[i] = read_dicom_header(paths[i]);
                       } catch (const InputError& error) {
                           failures[i] = error.what();
                       }
                       step(1);
                   });

    Found found;
    std::size_t without_image = 0;
    for (std::size_t i = 0; i < paths.size(); ++i) {
        if (headers[i])
            found.files.push_back(std::move(*headers[i]));
        else if (failures[i].empty())
            ++without_image;
    }
    for (std::size_t i = 0; i < paths.size(); ++i) {
        const std::string& failure = failures[i];
        if (failure.empty()) continue;
        if (found.files.empty() || paths[i] == wanted) throw InputError(failure);
        if (found.damage.empty())
            found.damage = failure + "; it may belong to the scan: mend it or take it out of the folder";
    }
    if (found.files.empty()) {
        throw InputError(fmt::format("{}: none of {} DICOM files holds an image",
                                     shown(paths[0].parent_path()), paths.size()));
    }
    if (without_image > 0)
        found.warnings.push_back(fmt::format("{} DICOM files hold no image and are left out", without_image));
    found.stacks = stacks_of(found.files);
    return found;
}

SeriesInfo describe(const DicomStack& stack) {
    const DicomFile& file = stack.first();
    SeriesInfo info{stack.id,
                    file.description,
                    file.modality,
                    {file.columns, file.rows, static_cast<std::int64_t>(stack.slices.size())},
                    {},
                    0};
    std::vector<const DicomFile*> files;
    for (const DicomSlice& s : stack.slices) files.push_back(s.file);
    std::sort(files.begin(), files.end());
    info.files = static_cast<std::size_t>(std::unique(files.begin(), files.end()) - files.begin());
    if (const auto spacing = stack.slices[0].frame().spacing)
        info.spacing = {(*spacing)[0], (*spacing)[1], 0};
    try {
        info.spacing = place_of(stack, {}).geometry.spacing;
    } catch (const InputError&) {  // it can be listed all the same
    }
    return info;
}

std::string listed(const std::vector<const DicomStack*>& stacks) {
    constexpr std::size_t most = 20;
    std::string out;
    for (std::size_t i = 0; i < std::min(stacks.size(), most); ++i) {
        const SeriesInfo info = describe(*stacks[i]);
        out += fmt::format("{}{} ({}, {}, {} x {} x {}, {} files)", out.empty() ? "" : "; ", info.id,
                           info.modality.empty() ? "modality unknown" : info.modality,
                           shown(info.description), info.dims[0], info.dims[1], info.dims[2], info.files);
    }
    return stacks.size() > most ? out + fmt::format("; and {} more", stacks.size() - most) : out;
}

struct Choice {
    std::vector<DicomStack*> candidates;
    std::string reason;        // why these
    bool passes_over = false;  // scouts or single images
};

Choice choose(Found& found, const std::filesystem::path& wanted, const ScanOptions& options) {
    Choice choice;
    for (DicomStack& s : found.stacks) choice.candidates.push_back(&s);
    const auto keep = [&](auto&& condition) {
        std::vector<DicomStack*> kept;
        std::copy_if(choice.candidates.begin(), choice.candidates.end(), std::back_inserter(kept), condition);
        return kept;
    };
    if (!options.series.empty()) {
        auto chosen = keep([&](const DicomStack* s) { return s->id == options.series; });
        if (chosen.empty())
            chosen = keep([&](const DicomStack* s) { return s->first().series_uid == options.series; });
        if (chosen.empty()) {
            throw GeometryError(fmt::format("there is no series {}; there are: {}", shown(options.series),
                                            listed({choice.candidates.begin(), choice.candidates.end()})));
        }
        return {std::move(chosen), "it was asked for", false};
    }
    if (!wanted.empty()) {
        auto chosen = keep([&](const DicomStack* s) {
            return std::any_of(s->slices.begin(), s->slices.end(),
                               [&](const DicomSlice& slice) { return slice.file->path == wanted; });
        });
        if (chosen.empty()) throw InputError(fmt::format("{}: holds no image", shown(wanted)));
        return {std::move(chosen), "the file that was named belongs to it", false};
    }
    choice.reason = "there is no other";
    auto volumes = keep([](const DicomStack* s) { return s->slices.size() > 1 && !s->first().localizer; });
    if (!volumes.empty() && volumes.size() < choice.candidates.size()) {
        choice.reason =
            fmt::format("{} scout or single images are left out", choice.candidates.size() - volumes.size());
        choice.candidates = std::move(volumes);
        choice.passes_over = true;
    }
    return choice;
}

DicomStack& only(const Choice& choice) {
    if (choice.candidates.size() > 1) {
        throw GeometryError(fmt::format("there are {} series; choose one with --series (options.series): {}",
                                        choice.candidates.size(),
                                        listed({choice.candidates.begin(), choice.candidates.end()})));
    }
    return *choice.candidates[0];
}

struct Rescale {
    double slope, intercept;

    friend bool operator==(const Rescale&, const Rescale&) = default;
};

Rescale rescale_of(const DicomSlice& s) {
    const Rescale r{s.frame().slope.value_or(1), s.frame().intercept.value_or(0)};
    if (r.slope == 0 || !std::isfinite(r.slope) || !std::isfinite(r.intercept)) {
        throw InputError(fmt::format("{}: its rescale slope or intercept is not a usable number", s.name()));
    }
    return r;
}

// Of slices at one place with the same values only the first stays. \throw GeometryError where they differ.
void drop_duplicates(DicomStack& stack, std::vector<std::string>& warnings) {
    constexpr std::size_t most_listed = 5;
    std::map<const DicomFile*, DicomWorkspace> decoded;
    const auto stored = [&](const DicomSlice& s) {
        if (decoded.size() > 4) decoded.clear();
        const std::size_t area = static_cast<std::size_t>(s.file->columns * s.file->rows);
        DicomWorkspace& memory = decoded[s.file];
        const std::int32_t* all =
            memory.stored.empty() ? decode_dicom(*s.file, memory, [](double) {}) : memory.stored.data();
        return std::vector<std::int32_t>(all + s.index * area, all + (s.index + 1) * area);
    };
    std::vector<std::size_t> dropped;
    std::vector<std::string> groups;
    for (const auto& group : slices_at_one_place(stack)) {
        const DicomSlice& first = stack.slices[group[0]];
        const auto pixels = stored(first);
        const Rescale rescale = rescale_of(first);
        bool same = true;
        for (std::size_t i = 1; same && i < group.size(); ++i) {
            const DicomSlice& other = stack.slices[group[i]];
            same = *first.frame().position == *other.frame().position && rescale_of(other) == rescale &&
                   stored(other) == pixels;
        }
        if (same) {
            dropped.insert(dropped.end(), group.begin() + 1, group.end());
            continue;
        }
        std::string names;
        for (const std::size_t i : group)
            names += fmt::format("{}{}", names.empty() ? "" : " and ", stack.slices[i].name());
        groups.push_back(names);
        if (groups.size() > most_listed) break;
    }
    if (!groups.empty()) {
        std::string list;
        for (std::size_t i = 0; i < std::min(groups.size(), most_listed); ++i)
            list += fmt::format("{}{}", i ? "; " : "", groups[i]);
        throw GeometryError(
            fmt::format("series {}: slices with different pixels lie at the same place, as of "
                        "several volumes in one: {}{}",
                        stack.id, list, groups.size() > most_listed ? "; and more" : ""));
    }
    if (dropped.empty()) return;
    warnings.push_back(fmt::format("{} slices are there twice and count once, such as {}", dropped.size(),
                                   stack.slices[dropped[0]].name()));
    for (auto i = dropped.rbegin(); i != dropped.rend(); ++i)
        stack.slices.erase(stack.slices.begin() + static_cast<std::ptrdiff_t>(*i));
}

// Into int16, computed in the type of `slope`; false where a value does not fit.
template <class Wide>
bool rescale(const std::int32_t* from, std::size_t count, Wide slope, Wide intercept, std::int16_t* to) {
    std::make_unsigned_t<Wide> beyond = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const Wide value = slope * from[i] + intercept;
        to[i] = static_cast<std::int16_t>(value);
        beyond |= (static_cast<std::make_unsigned_t<Wide>>(value) + 32768) >> 16;
    }
    return beyond == 0;
}

// Decodes into `volume`, reporting progress from `begin` to 1. Where the volume is int16 and a value does not
// fit, stops and returns the progress it came to.
std::optional<double> load_slices(const DicomStack& stack, const ScanOptions& options, double begin,
                                  Volume& volume) {
    // a file of many frames is decoded once
    std::map<const DicomFile*, std::vector<std::size_t>> slices_of;
    for (std::size_t k = 0; k < stack.slices.size(); ++k) slices_of[stack.slices[k].file].push_back(k);
    const std::vector<std::pair<const DicomFile*, std::vector<std::size_t>>> files(slices_of.begin(),
                                                                                   slices_of.end());

    const std::size_t area = static_cast<std::size_t>(volume.geometry().dims[0] * volume.geometry().dims[1]);
    std::atomic<bool> fits = true;
    double reached = begin;
    const Progress progress = [&](double fraction) {
        if (!fits) return true;  // what is read again counts from here
        reached = fraction;
        return !options.progress || options.progress(fraction);
    };
    oneapi::tbb::enumerable_thread_specific<DicomWorkspace> workspaces;
    for_each_slice(files.size(), options.threads, progress, begin, 1, [&](std::size_t i, const Step& step) {
        if (!fits) return;
        const std::int32_t* stored = decode_dicom(*files[i].first, workspaces.local(), step);
        for (const std::size_t k : files[i].second) {
            const DicomSlice& slice = stack.slices[k];
            const auto [slope, intercept] = rescale_of(slice);
            const std::int32_t* from = stored + slice.index * area;
            if (volume.type() == SampleType::float32) {
                float* to = volume.samples<float>() + k * area;
                for (std::size_t j = 0; j < area; ++j)
                    to[j] = static_cast<float>(slope * from[j] + intercept);
            } else {
                std::int16_t* to = volume.samples<std::int16_t>() + k * area;
                const auto m = static_cast<std::int64_t>(slope), b = static_cast<std::int64_t>(intercept);
                // in 32 bits, which are faster, where they hold 2^14 * 2^16 + 10^9
                const bool narrow = slice.file->bits_stored <= 16 && std::abs(m) <= 1 << 14;
                const bool all_fit = narrow ? rescale(from, area, static_cast<std::int32_t>(m),
                                                      static_cast<std::int32_t>(b), to)
                                            : rescale(from, area, m, b, to);
                if (!all_fit) fits = false;
            }
        }
    });
    if (fits) return {};
    return reached;
}

// Slices at `places`, fractional indices along the third axis of `even`, made even: linear between neighbours.
template <class T>
Volume resampled(const Volume& uneven, const std::vector<double>& places, const Geometry& even) {
    Volume out(even, uneven.type());
    const std::size_t area = static_cast<std::size_t>(even.dims[0] * even.dims[1]);
    std::size_t below = 0;
    for (std::size_t k = 0; k < static_cast<std::size_t>(even.dims[2]); ++k) {
        const auto place = static_cast<double>(k);
        while (below + 2 < places.size() && places[below + 1] <= place) ++below;
        const double share =
            std::clamp((place - places[below]) / (places[below + 1] - places[below]), 0.0, 1.0);
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

Volume made_even(Volume volume, const StackPlace& place) {
    if (place.uneven.empty()) return volume;
    return volume.type() == SampleType::int16 ? resampled<std::int16_t>(volume, place.uneven, place.geometry)
                                              : resampled<float>(volume, place.uneven, place.geometry);
}

void check_readable(const DicomStack& stack) {
    for (const DicomSlice& s : stack.slices) {
        if (!s.file->refusal.empty())
            throw InputError(fmt::format("{}: {}", shown(s.file->path), s.file->refusal));
    }
}

bool is_rescaled(const DicomStack& stack) {
    return std::any_of(stack.slices.begin(), stack.slices.end(),
                       [](const DicomSlice& s) { return s.frame().slope.has_value(); });
}

SeriesReport report_on(DicomStack& stack, const ScanOptions& options) {
    SeriesReport out;
    out.series = describe(stack);
    out.patient_name = stack.first().patient_name;
    const std::string& modality = stack.first().modality;
    if (modality == "CT")
        out.hounsfield = is_rescaled(stack);
    else if (!modality.empty())
        out.hounsfield = false;
    out.gaps = uneven_gaps(stack);
    try {
        check_readable(stack);
        drop_duplicates(stack, out.warnings);
        const StackPlace place = place_of(stack, options);
        for (const DicomSlice& s : stack.slices) rescale_of(s);
        out.series.dims = place.geometry.dims;
        out.series.spacing = place.geometry.spacing;
        out.tilt = place.tilt;
        out.warnings.insert(out.warnings.end(), place.warnings.begin(), place.warnings.end());
    } catch (const InputError& error) {
        out.refusal = error.what();
    }
    const auto& spacing = out.series.spacing;
    if (*std::min_element(spacing.begin(), spacing.end()) > 0)
        out.smallest_feature = 2 * *std::max_element(spacing.begin(), spacing.end());
    out.memory = static_cast<std::uint64_t>(out.series.dims[0] * out.series.dims[1] * out.series.dims[2]) *
                 sample_size(SampleType::int16);
    return out;
}

}  // namespace

ScanReport inspect_dicom(const std::vector<std::filesystem::path>& files, const std::filesystem::path& wanted,
                         const ScanOptions& options) {
    Found found = find_stacks(files, wanted, options);
    ScanReport out{"DICOM", files.size(), {}, {}, {}, found.warnings};
    const Choice choice = choose(found, wanted, options);
    for (DicomStack& s : found.stacks) out.series.push_back(report_on(s, options));
    out.reason = choice.reason;
    if (!found.damage.empty()) {
        out.reason = found.damage;
    } else if (choice.candidates.size() == 1) {
        const auto at = static_cast<std::size_t>(choice.candidates[0] - found.stacks.data());
        if (out.series[at].refusal.empty())
            out.chosen = at;
        else
            out.reason = out.series[at].refusal;
    } else {
        out.reason = fmt::format("{} series could be read: choose one", choice.candidates.size());
    }
    return out;
}

Volume load_dicom(const std::vector<std::filesystem::path>& files, const std::filesystem::path& wanted,
                  const ScanOptions& options, ScanInfo& info) {
    Found found = find_stacks(files, wanted, options);
    info.warnings = found.warnings;
    const Choice choice = choose(found, wanted, options);
    DicomStack& stack = only(choice);
    if (!found.damage.empty()) throw InputError(found.damage);
    if (choice.passes_over) info.warnings.push_back(choice.reason);
    check_readable(stack);
    info.series = describe(stack);
    drop_duplicates(stack, info.warnings);
    const StackPlace place = place_of(stack, options);
    info.warnings.insert(info.warnings.end(), place.warnings.begin(), place.warnings.end());
    info.series.dims = place.geometry.dims;
    info.series.spacing = place.geometry.spacing;

    bool integral = true;
    for (const DicomSlice& s : stack.slices) {
        const auto [slope, intercept] = rescale_of(s);
        integral &= slope == std::floor(slope) && intercept == std::floor(intercept) &&
                    std::abs(slope) < 32768 && std::abs(intercept) < 1e9;
    }
    if (stack.first().modality == "CT" && !is_rescaled(stack))
        info.warnings.push_back("the CT has no rescale slope: its values are not HU");

    Geometry as_stored = place.geometry;
    as_stored.dims[2] = static_cast<std::int64_t>(stack.slices.size());
    double begin = headers_done;
    if (integral) {
        Volume volume(as_stored, SampleType::int16);
        const std::optional<double> reached = load_slices(stack, options, begin, volume);
        if (!reached) return made_even(std::move(volume), place);
        begin = *reached;
    }
    Volume volume(as_stored, SampleType::float32);
    load_slices(stack, options, begin, volume);
    return made_even(std::move(volume), place);
}

}  // namespace marrow
