// What an input is, and who reads it.
#include <marrow/scan_io.h>

#include <fmt/format.h>

#include <algorithm>

#include <marrow/error.h>

#include "base/progress.h"
#include "io/bytes/byte_stream.h"
#include "io/bytes/text.h"
#include "io/dicom/data_set.h"
#include "io/dicom/read_dicom.h"
#include "io/scan/image_stack.h"
#include "io/scan/raw_image.h"

namespace marrow {

namespace {

namespace fs = std::filesystem;

struct Input {
    std::string format;           // as in the table of scan_io.h
    std::vector<fs::path> files;  // of a folder, those that matter
    fs::path wanted;              // DICOM: the one file that was named
};

constexpr std::size_t head_size = 352;

// The format of a file by its first bytes, else by its name; empty where neither tells.
std::string format_of(const fs::path& path) {
    const std::string head = head_of(path, head_size);
    if (head.size() >= 132 && head.compare(128, 4, "DICM") == 0)
        return "DICOM";  // what is before may be TIFF
    if (head.starts_with("NRRD000")) return "NRRD";
    if (is_tiff(head)) return "TIFF";
    if (is_picture(head)) return "slices";
    const std::string end = ending(path);
    if (end == ".nii" || end == ".nii.gz" || end == ".hdr" || end == ".hdr.gz" || end == ".img" ||
        end == ".img.gz")
        return "NIfTI";
    if (end == ".nrrd" || end == ".nhdr") return "NRRD";
    if (end == ".mha" || end == ".mhd") return "MetaImage";
    if (end == ".dcm" || end == ".dicom" || end == ".ima" || is_dicom(head)) return "DICOM";
    return "";
}

fs::path folder_of(const fs::path& file) {
    return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

// Regular files in a folder, in a fixed order.
std::vector<fs::path> files_in(const fs::path& folder, bool nested) {
    std::vector<fs::path> out;
    const auto add = [&](const fs::directory_entry& entry) {
        std::error_code ignored;
        if (entry.is_regular_file(ignored)) out.push_back(entry.path());
    };
    try {
        if (nested) {
            for (const auto& entry : fs::recursive_directory_iterator(folder)) add(entry);
        } else {
            for (const auto& entry : fs::directory_iterator(folder)) add(entry);
        }
    } catch (const fs::filesystem_error& error) {
        throw IoError(fmt::format("{}: cannot be listed: {}", shown(folder), error.code().message()));
    }
    std::sort(out.begin(), out.end(), natural_less);
    return out;
}

// What is cut off within the zeros before its mark counts as DICOM where other files are; it is refused later.
std::vector<fs::path> dicom_among(const std::vector<fs::path>& files, const Progress& progress) {
    std::vector<fs::path> dicom, perhaps;
    for (const fs::path& file : files) {
        internal::report_progress(progress, 0);  // a folder may hold many files, far away
        const std::string head = head_of(file, head_size);
        if (is_dicom(head))
            dicom.push_back(file);
        else if (head.size() <= 132 && head.find_first_not_of(std::string_view("\0DICM", 5)) == head.npos)
            perhaps.push_back(file);
    }
    if (!dicom.empty()) dicom.insert(dicom.end(), perhaps.begin(), perhaps.end());
    return dicom;
}

Input identify_folder(const fs::path& folder, const Progress& progress) {
    const std::vector<fs::path> all = files_in(folder, true);
    Input input{"DICOM", dicom_among(all, progress), {}};
    if (!input.files.empty()) return input;
    input = {"slices", files_in(folder, false), {}};
    std::erase_if(input.files, [](const fs::path& file) { return !is_picture(head_of(file, head_size)); });
    if (!input.files.empty()) return input;
    if (all.empty()) throw InputError(fmt::format("{}: the folder holds no files", shown(folder)));
    throw InputError(
        fmt::format("{}: none of the folder's {} files is DICOM or a picture; name a NIfTI, NRRD or "
                    "MetaImage file itself",
                    shown(folder), all.size()));
}

Input identify(const fs::path& path, const Progress& progress) {
    std::error_code ignored;
    if (fs::is_directory(path, ignored)) return identify_folder(path, progress);
    size_of_file(path);
    const std::string format = format_of(path);
    if (format.empty()) {
        if (head_of(path, 2) == "PK")
            throw InputError(fmt::format("{}: is an archive; unpack it first", shown(path)));
        throw InputError(fmt::format(
            "{}: is not a scan that can be read (DICOM, NIfTI, NRRD, MetaImage, TIFF, PNG)", shown(path)));
    }
    if (format != "DICOM") return {format, {path}, {}};
    if (!is_dicom(head_of(path, head_size)))
        throw InputError(fmt::format("{}: is not a DICOM file", shown(path)));
    if (lower(path.filename().native()).starts_with("dicomdir"))
        return identify_folder(folder_of(path), progress);
    // one file stands for its series, whose other files are beside it
    Input input{format, dicom_among(files_in(folder_of(path), false), progress), {}};
    for (const fs::path& file : input.files) {
        if (fs::equivalent(file, path, ignored)) input.wanted = file;
    }
    return input;
}

RawImage read_raw_header(const Input& input, const ScanOptions& options) {
    const fs::path& path = input.files[0];
    RawImage image = input.format == "NIfTI"  ? read_nifti_header(path, options.volume)
                     : input.format == "NRRD" ? read_nrrd_header(path)
                                              : read_metaimage_header(path, options.volume);
    if (image.has_spacing && options.spacing) {
        throw InputError(fmt::format("{}: has a spacing of its own; do not give one", shown(path)));
    }
    if (options.spacing) image.geometry.spacing = *options.spacing;
    return image;
}

SeriesInfo series_of(const fs::path& path, const Geometry& geometry, std::size_t files) {
    return {"", path.filename().string(), "", geometry.dims, geometry.spacing, files};
}

bool is_pictures(const Input& input) {
    return input.format == "TIFF" || input.format == "slices";
}

// Options that mean nothing for an input are refused, not passed over.
void check_options(const Input& input, const fs::path& path, const ScanOptions& options) {
    const bool dicom = input.format == "DICOM";
    if (!dicom && !options.series.empty())
        throw InputError(fmt::format("{}: has no series to choose from", shown(path)));
    if (!dicom && options.resample)
        throw InputError(
            fmt::format("{}: its samples are even already; only DICOM is resampled", shown(path)));
    if (options.volume && input.format != "NIfTI" && input.format != "MetaImage")
        throw InputError(fmt::format("{}: has no volumes to choose from", shown(path)));
}

std::string needs_spacing(const fs::path& path) {
    return fmt::format(
        "{}: does not say how far apart its samples are; give it with --spacing X,Y,Z "
        "(options.spacing), in mm",
        shown(path));
}

}  // namespace

Volume read_scan(const fs::path& path, const ScanOptions& options, ScanInfo* info) {
    const Input input = identify(path, options.progress);
    ScanInfo found;
    found.format = input.format;
    Volume volume;
    check_options(input, path, options);
    if (input.format == "DICOM") {
        volume = load_dicom(input.files, input.wanted, options, found);
    } else if (is_pictures(input)) {
        if (!options.spacing) throw GeometryError(needs_spacing(path));
        const PictureStack stack = read_picture_headers(input.files, options);
        found.series = series_of(path, stack.geometry, stack.files.size());
        volume = load_pictures(stack, options);
    } else {
        const RawImage image = read_raw_header(input, options);
        if (!image.has_spacing && !options.spacing) throw GeometryError(needs_spacing(path));
        found.series = series_of(path, image.geometry, image.files.size());
        found.warnings = image.warnings;
        volume = load_raw(image, options.progress);
    }
    if (info) *info = std::move(found);
    return volume;
}

SliceSource open_slices(const fs::path& path, const ScanOptions& options, ScanInfo* info) {
    const Input input = identify(path, options.progress);
    check_options(input, path, options);
    if (input.format != "NIfTI" && input.format != "NRRD" && input.format != "MetaImage") {
        throw InputError(
            fmt::format("{}: {} can only be read whole; without a memory limit, or convert it to NRRD, "
                        "MetaImage or NIfTI without compression",
                        shown(path), input.format));
    }
    const RawImage image = read_raw_header(input, options);
    if (!image.has_spacing && !options.spacing) throw GeometryError(needs_spacing(path));
    SliceSource source = raw_slices(image);
    if (info) *info = {input.format, series_of(path, image.geometry, image.files.size()), image.warnings};
    return source;
}

ScanReport inspect_scan(const fs::path& path, const ScanOptions& options) {
    const Input input = identify(path, options.progress);
    check_options(input, path, options);
    if (input.format == "DICOM") return inspect_dicom(input.files, input.wanted, options);
    ScanReport out{input.format, input.files.size(), {}, 0, "there is no other", {}};
    SeriesReport series;
    Geometry geometry;
    SampleType type{};
    bool has_spacing = options.spacing.has_value();
    if (is_pictures(input)) {
        const PictureStack stack = read_picture_headers(input.files, options);
        geometry = stack.geometry;
        type = stack.picture.type;
    } else {
        const RawImage image = read_raw_header(input, options);
        geometry = image.geometry;
        type = loaded_type(image);
        has_spacing |= image.has_spacing;
        series.warnings = image.warnings;
        try {
            check_claims(image);
        } catch (const Error& error) {
            series.refusal = error.what();
        }
    }
    if (!has_spacing) {
        geometry.spacing = {0, 0, 0};
        series.refusal = needs_spacing(path);
    } else {
        series.smallest_feature = 2 * *std::max_element(geometry.spacing.begin(), geometry.spacing.end());
    }
    series.series = series_of(path, geometry, input.files.size());
    series.memory = static_cast<std::uint64_t>(geometry.sample_count()) * sample_size(type);
    if (!series.refusal.empty()) {
        out.chosen.reset();
        out.reason = series.refusal;
    }
    out.series.push_back(std::move(series));
    return out;
}

std::vector<SeriesInfo> list_series(const fs::path& path, std::string* format) {
    const ScanReport report = inspect_scan(path);
    if (format) *format = report.format;
    std::vector<SeriesInfo> out;
    for (const SeriesReport& s : report.series) out.push_back(s.series);
    return out;
}

}  // namespace marrow
