// Finds the series among DICOM files and chooses one.
#include "series.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include <marrow/error.h>

#include "io/bytes/text.h"
#include "io/scan/parallel_slices.h"

namespace marrow::internal::io {

DicomHeaders read_dicom_headers(const DicomInput& input, int threads, const Progress& progress) {
    const std::vector<std::filesystem::path>& paths = input.files;
    std::vector<std::optional<DicomFile>> headers(paths.size());
    std::vector<std::string> failures(paths.size());
    for_each_slice(paths.size(), threads, progress, 0, 1, [&](std::size_t i, const Step& step) {
        try {
            headers[i] = read_dicom_header(paths[i]);
        } catch (const InputError& error) {
            failures[i] = error.what();
        }
        step(1);
    });

    DicomHeaders found;
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
        if (found.files.empty() || paths[i] == input.named) throw InputError(failure);
        if (!found.damage)
            found.damage = failure + "; it may belong to the scan: repair it or remove it from the folder";
    }
    if (found.files.empty() && (input.named || paths.size() == 1)) {
        const std::filesystem::path& path = input.named.value_or(paths[0]);
        fail<InputError>(path, "{}", reason_without_image(path));
    }
    if (found.files.empty()) {
        fail<InputError>(paths[0].parent_path(), "none of {} DICOM files holds an image", paths.size());
    }
    if (without_image > 0)
        found.warnings.push_back(
            without_image == 1 ? "1 DICOM file holds no image and is skipped"
                               : fmt::format("{} DICOM files hold no image and are skipped", without_image));
    found.series = group_into_series(found.files);
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
        info.spacing = geometry_of(stack, {}).geometry.spacing;
    } catch (const InputError&) {  // It cannot be read, but it can be described.
    }
    return info;
}

namespace {

// The number of a series in the list of inspect_scan, from 1.
std::size_t number_of(const DicomSeries& series, const DicomHeaders& headers) {
    return static_cast<std::size_t>(&series - headers.series.data()) + 1;
}

// The first few of these series, by their numbers. Ids are long, and say nothing to people.
std::string listed(const std::vector<DicomSeries*>& candidates, const DicomHeaders& headers) {
    constexpr std::size_t kLongest = 200;
    std::string all;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
        const DicomSeries& series = *candidates[i];
        const SeriesInfo info = describe(series.volumes[0]);
        const std::size_t volumes = series.volumes.size();
        const std::string one =
            fmt::format("{} ({}{}, {} x {}{}, {})", number_of(series, headers),
                        info.modality.empty() ? "modality unknown" : info.modality,
                        info.description.empty() ? "" : fmt::format(" {}", quoted(info.description)),
                        info.dims[0], info.dims[1],
                        // A segmentation has several frames for a slice.
                        series.first().segmentation ? "" : fmt::format(" x {}", info.dims[2]),
                        volumes > 1 ? count_of(volumes, "volume") : count_of(info.files, "file"));
        if (i > 0 && all.size() + one.size() > kLongest)
            return all + fmt::format(" and {} more", candidates.size() - i);
        if (i > 0) all += ", ";
        all += one;
    }
    return all;
}

}  // namespace

SeriesChoice choose_series(DicomHeaders& headers, const DicomInput& input, const ScanOptions& options) {
    SeriesChoice choice;
    for (DicomSeries& s : headers.series) choice.candidates.push_back(&s);
    const auto keep = [&](auto&& condition) {
        std::vector<DicomSeries*> kept;
        std::copy_if(choice.candidates.begin(), choice.candidates.end(), std::back_inserter(kept), condition);
        return kept;
    };
    if (options.series) {
        const std::string& wanted = *options.series;
        std::vector<DicomSeries*> chosen;
        // Only the first way in which it names any series counts.
        for (int way = 0; way < 4 && chosen.empty(); ++way) {
            chosen = keep([&](const DicomSeries* s) {
                return way == 0   ? s->id == wanted
                       : way == 1 ? s->first().series_uid == wanted
                       : way == 2 ? std::to_string(number_of(*s, headers)) == wanted
                                  : !wanted.empty() && s->id.starts_with(wanted);
            });
        }
        if (chosen.empty()) {
            throw OptionError(fmt::format("there is no series {}, only {}: {}; inspect_scan lists all",
                                          quoted(wanted), choice.candidates.size(),
                                          listed(choice.candidates, headers)));
        }
        return {std::move(chosen), "options.series selects it", false};
    }
    if (input.named) {
        auto chosen = keep([&](const DicomSeries* s) {
            return std::any_of(s->volumes.begin(), s->volumes.end(), [&](const DicomStack& volume) {
                return std::any_of(volume.slices.begin(), volume.slices.end(),
                                   [&](const DicomSlice& slice) { return slice.file->path == *input.named; });
            });
        });
        if (chosen.empty()) {
            fail<InputError>(*input.named, "{}", reason_without_image(*input.named));
        }
        return {std::move(chosen), "the named file belongs to it", false};
    }
    choice.reason = "there is no other";
    auto volumes = keep([](const DicomSeries* s) { return s->slices() > 1 && !s->first().localizer; });
    if (!volumes.empty() && volumes.size() < choice.candidates.size()) {
        choice.reason =
            count_of(choice.candidates.size() - volumes.size(), "scout or single image") + " skipped";
        choice.candidates = std::move(volumes);
        choice.skips_single_images = true;
    }
    return choice;
}

DicomSeries& only_candidate(const SeriesChoice& choice, const DicomHeaders& headers) {
    if (choice.candidates.size() > 1) {
        throw GeometryError(fmt::format(
            "there are {} series: {}; choose one by its number with options.series; inspect_scan lists all",
            choice.candidates.size(), listed(choice.candidates, headers)));
    }
    return *choice.candidates[0];
}

std::string images_left_out(const DicomSeries& series, const DicomHeaders& headers,
                            const ScanOptions& options) {
    if (options.series) return {};
    std::size_t images = 0;
    const DicomFile* example = nullptr;
    for (const DicomSeries& other : headers.series) {
        const DicomFile& first = other.first();
        if (&other == &series || first.series_uid != series.first().series_uid || first.localizer ||
            first.segmentation)
            continue;
        if (!example) example = &first;
        images += other.slices();
    }
    if (!example || example->series_uid.empty()) return {};
    return fmt::format(
        "{} of the same series (SeriesInstanceUID), for example {}, differ in size, direction, spacing or "
        "place and are not read",
        count_of(images, "more image"), quoted(example->path));
}

std::size_t choose_volume(const std::vector<std::string>& differences, const std::string& what,
                          const ScanOptions& options) {
    if (!options.volume && differences.size() > 1) {
        std::vector<std::string> all;
        for (std::size_t i = 0; i < differences.size(); ++i)
            all.push_back(fmt::format("{}: {}", i, differences[i]));
        throw GeometryError(fmt::format("{} ({}); choose one with options.volume; inspect_scan lists all",
                                        what, examples(all)));
    }
    const std::int64_t chosen = options.volume.value_or(0);
    if (chosen < 0 || static_cast<std::size_t>(chosen) >= differences.size()) {
        throw OptionError(fmt::format("the series has no volume {}; there are {}, numbered from 0", chosen,
                                      differences.size()));
    }
    return static_cast<std::size_t>(chosen);
}

}  // namespace marrow::internal::io
