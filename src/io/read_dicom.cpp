#include "read_dicom.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>

#include <marrow/error.h>

#include "dicom_stack.h"
#include "header_text.h"
#include "parallel_slices.h"
#include "read_dicom_file.h"

namespace marrow {

namespace {

struct Found {
    std::vector<DicomFile> files;
    std::vector<DicomStack> stacks;  // they point into files
    std::vector<std::string> warnings;
};

constexpr double headers_done = 0.2;  // of the progress

Found find_stacks(const std::vector<std::filesystem::path>& paths, const ScanOptions& options) {
    std::vector<std::optional<DicomFile>> headers(paths.size());
    std::vector<std::string> failures(paths.size());
    for_each_slice(paths.size(), options.threads, options.progress, 0, headers_done, [&](std::size_t i) {
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
    std::vector<std::string> ignored;
    try {
        info.spacing = geometry_of(stack, ignored).spacing;
    } catch (const InputError&) {  // it can be listed all the same
        if (const auto spacing = stack.slices[0].frame().spacing)
            info.spacing = {(*spacing)[0], (*spacing)[1], 0};
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

DicomStack& choose(Found& found, const std::filesystem::path& wanted, const ScanOptions& options,
                   std::vector<std::string>& warnings) {
    std::vector<DicomStack*> candidates;
    for (DicomStack& s : found.stacks) candidates.push_back(&s);
    const auto keep = [&](auto&& condition) {
        std::vector<DicomStack*> kept;
        std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(kept), condition);
        return kept;
    };
    if (!options.series.empty()) {
        auto chosen = keep([&](const DicomStack* s) { return s->id == options.series; });
        if (chosen.empty())
            chosen = keep([&](const DicomStack* s) { return s->first().series_uid == options.series; });
        if (chosen.empty()) {
            throw GeometryError(fmt::format("there is no series {}; there are: {}", shown(options.series),
                                            listed({candidates.begin(), candidates.end()})));
        }
        candidates = std::move(chosen);
    } else if (!wanted.empty()) {
        candidates = keep([&](const DicomStack* s) {
            return std::any_of(s->slices.begin(), s->slices.end(),
                               [&](const DicomSlice& slice) { return slice.file->path == wanted; });
        });
        if (candidates.empty()) throw InputError(fmt::format("{}: holds no image", shown(wanted)));
    } else {
        // scouts and single images are no volumes, unless there is nothing else
        const auto volumes =
            keep([](const DicomStack* s) { return s->slices.size() > 1 && !s->first().localizer; });
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

Rescale rescale_of(const DicomSlice& s) {
    const Rescale r{s.frame().slope.value_or(1), s.frame().intercept.value_or(0)};
    if (r.slope == 0 || !std::isfinite(r.slope) || !std::isfinite(r.intercept)) {
        throw InputError(fmt::format("{}: its rescale slope or intercept is not a usable number", s.name()));
    }
    return r;
}

// Decodes into `volume`. Returns false where it is int16 and a value does not fit.
bool load_slices(const DicomStack& stack, const ScanOptions& options, double begin, Volume& volume) {
    // a file of many frames is decoded once
    std::map<const DicomFile*, std::vector<std::size_t>> slices_of;
    for (std::size_t k = 0; k < stack.slices.size(); ++k) slices_of[stack.slices[k].file].push_back(k);
    const std::vector<std::pair<const DicomFile*, std::vector<std::size_t>>> files(slices_of.begin(),
                                                                                   slices_of.end());

    const std::size_t area = static_cast<std::size_t>(volume.geometry().dims[0] * volume.geometry().dims[1]);
    std::atomic<bool> fits = true;
    for_each_slice(files.size(), options.threads, options.progress, begin, 1, [&](std::size_t i) {
        if (!fits) return;
        const Buffer<std::int32_t> stored = decode_dicom(*files[i].first);
        for (const std::size_t k : files[i].second) {
            const DicomSlice& slice = stack.slices[k];
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
    for (const DicomStack& s : found.stacks) out.push_back(describe(s));
    return out;
}

Volume load_dicom(const std::vector<std::filesystem::path>& files, const std::filesystem::path& wanted,
                  const ScanOptions& options, ScanInfo& info) {
    Found found = find_stacks(files, options);
    info.warnings = found.warnings;
    DicomStack& stack = choose(found, wanted, options, info.warnings);
    for (const DicomSlice& s : stack.slices) {
        if (!s.file->refusal.empty())
            throw InputError(fmt::format("{}: {}", shown(s.file->path), s.file->refusal));
    }
    const Geometry geometry = geometry_of(stack, info.warnings);
    info.series = describe(stack);

    bool integral = true, rescaled = false;
    for (const DicomSlice& s : stack.slices) {
        const auto [slope, intercept] = rescale_of(s);
        integral &= slope == std::floor(slope) && intercept == std::floor(intercept) &&
                    std::abs(slope) < 32768 && std::abs(intercept) < 1e9;
        rescaled |= s.frame().slope.has_value();
    }
    if (stack.first().modality == "CT" && !rescaled)
        info.warnings.push_back("the CT has no rescale slope: its values are not HU");

    if (integral) {
        Volume volume(geometry, SampleType::int16);
        if (load_slices(stack, options, headers_done, volume)) return volume;
    }
    Volume volume(geometry, SampleType::float32);
    load_slices(stack, options, headers_done, volume);
    return volume;
}

}  // namespace marrow
