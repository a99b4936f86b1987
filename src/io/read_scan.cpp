// Detects the format of an input and calls its reader.
#include <marrow/scan_io.h>

#include <fmt/format.h>

#include <algorithm>

#include <marrow/error.h>

#include "base/progress.h"
#include "io/bytes/byte_stream.h"
#include "io/bytes/text.h"
#include "io/dicom/data_set.h"
#include "io/dicom/file.h"
#include "io/dicom/read_dicom.h"
#include "io/scan/image_stack.h"
#include "io/scan/raw_image.h"

namespace marrow {

namespace {

namespace fs = std::filesystem;
using namespace internal::io;

struct Input {
    ScanFormat format;
    std::vector<fs::path> files;    // of a folder, only the files of that format
    std::optional<fs::path> named;  // DICOM: the file that stands for its series
};

constexpr std::size_t kHeadSize = 352;

// The format of a file by its first bytes, else by its name.
std::optional<ScanFormat> format_of(const fs::path& path, std::string_view head) {
    // The preamble of a DICOM file may be a TIFF header.
    if (head.size() >= 132 && head.substr(128, 4) == "DICM") return ScanFormat::dicom;
    if (head.starts_with("NRRD000")) return ScanFormat::nrrd;
    if (is_tiff(head)) return ScanFormat::tiff;
    if (is_image_file(head)) return ScanFormat::slices;
    const std::string end = extension(path);
    for (const char* nifti : {".nii", ".nii.gz", ".hdr", ".hdr.gz", ".img", ".img.gz"}) {
        if (end == nifti) return ScanFormat::nifti;
    }
    if (end == ".nrrd" || end == ".nhdr") return ScanFormat::nrrd;
    if (end == ".mha" || end == ".mhd") return ScanFormat::metaimage;
    if (end == ".dcm" || end == ".dicom" || end == ".ima" || is_dicom(head)) return ScanFormat::dicom;
    return {};
}

fs::path folder_of(const fs::path& file) {
    return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

// The regular files in a folder, in natural order.
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
        throw IoError(fmt::format("{}: cannot be listed: {}", quoted(folder), error.code().message()));
    }
    std::sort(out.begin(), out.end(), natural_less);
    return out;
}

// A file that is cut off within its preamble counts as DICOM if others are DICOM, so that it is not silently
// missing; reading it fails later.
std::vector<fs::path> dicom_among(const std::vector<fs::path>& files, const Progress& progress) {
    std::vector<fs::path> dicom, truncated;
    for (const fs::path& file : files) {
        internal::report_progress(progress, 0);  // a folder may have many files on a slow disk
        const std::string head = read_head(file, kHeadSize);
        if (is_dicom(head))
            dicom.push_back(file);
        else if (head.size() <= 132 && head.find_first_not_of(std::string_view("\0DICM", 5)) == head.npos)
            truncated.push_back(file);
    }
    if (!dicom.empty()) dicom.insert(dicom.end(), truncated.begin(), truncated.end());
    return dicom;
}

Input identify_folder(const fs::path& folder, const Progress& progress) {
    const std::vector<fs::path> all = files_in(folder, true);
    Input input{ScanFormat::dicom, dicom_among(all, progress), {}};
    if (!input.files.empty()) return input;
    input = {ScanFormat::slices, files_in(folder, false), {}};
    std::erase_if(input.files,
                  [](const fs::path& file) { return !is_image_file(read_head(file, kHeadSize)); });
    if (!input.files.empty()) return input;
    if (all.empty()) throw InputError(fmt::format("{}: the folder holds no files", quoted(folder)));
    throw InputError(fmt::format(
        "{}: none of the folder's {} files is DICOM or an image; open a NIfTI, NRRD or MetaImage file itself",
        quoted(folder), all.size()));
}

bool is_archive(const fs::path& path, std::string_view head) {
    const std::string end = to_lower(path.extension().native());
    for (const char* archive : {".zip", ".tar", ".tgz", ".gz", ".bz2", ".xz", ".7z", ".rar"}) {
        if (end == archive) return true;
    }
    return head.starts_with("PK") || (head.size() > 262 && head.substr(257, 5) == "ustar");
}

Input identify_file(const fs::path& path, const Progress& progress) {
    const std::string head = read_head(path, kHeadSize);
    const std::optional<ScanFormat> format = format_of(path, head);
    if (!format) {
        if (is_archive(path, head))
            throw InputError(fmt::format("{}: is an archive; unpack it first", quoted(path)));
        throw InputError(
            fmt::format("{}: is not a scan of a supported format (DICOM, NIfTI, NRRD, MetaImage, TIFF, PNG)",
                        quoted(path)));
    }
    if (format != ScanFormat::dicom) return {*format, {path}, {}};
    if (!is_dicom(head)) throw InputError(fmt::format("{}: is not a DICOM file", quoted(path)));
    if (to_lower(path.filename().native()).starts_with("dicomdir"))
        return identify_folder(folder_of(path), progress);
    Input input{*format, dicom_among(files_in(folder_of(path), false), progress), {}};
    for (const fs::path& file : input.files) {
        std::error_code ignored;
        if (fs::equivalent(file, path, ignored)) input.named = file;
    }
    return input;
}

Input identify(const fs::path& path, const Progress& progress) {
    std::error_code ignored;
    return fs::is_directory(path, ignored) ? identify_folder(path, progress) : identify_file(path, progress);
}

RawImage read_raw_header(const Input& input, const ScanOptions& options) {
    const fs::path& path = input.files[0];
    RawImage image = input.format == ScanFormat::nifti  ? read_nifti_header(path, options.volume)
                     : input.format == ScanFormat::nrrd ? read_nrrd_header(path)
                                                        : read_metaimage_header(path, options.volume);
    if (image.has_spacing && options.spacing) {
        const Vec3d& spacing = image.geometry.spacing;
        throw OptionError(
            fmt::format("{}: states its spacing, {:g} x {:g} x {:g} mm; do not set options.spacing",
                        quoted(path), spacing[0], spacing[1], spacing[2]));
    }
    if (options.spacing) image.geometry.spacing = *options.spacing;
    return image;
}

SeriesInfo series_of(const fs::path& path, const Geometry& geometry, std::size_t files) {
    return {"", path.filename().string(), "", geometry.dims, geometry.spacing, files};
}

bool is_image_stack(const Input& input) {
    return input.format == ScanFormat::tiff || input.format == ScanFormat::slices;
}

// Refuses options that do not apply to the input.
void check_options(const Input& input, const fs::path& path, const ScanOptions& options) {
    const bool dicom = input.format == ScanFormat::dicom;
    if (!dicom && options.series)
        throw OptionError(fmt::format("{}: only DICOM has series; do not set options.series", quoted(path)));
    if (!dicom && options.resample)
        throw OptionError(
            fmt::format("{}: only DICOM can be resampled; do not set options.resample", quoted(path)));
    if (options.volume && !dicom && input.format != ScanFormat::nifti &&
        input.format != ScanFormat::metaimage) {
        throw OptionError(
            fmt::format("{}: only DICOM, NIfTI and MetaImage have several volumes; do not set options.volume",
                        quoted(path)));
    }
}

std::string needs_spacing(const fs::path& path) {
    return fmt::format("{}: does not state the spacing of its samples; give it with options.spacing, in mm",
                       quoted(path));
}

// The header of the chosen volume; of the first if there are several and none is chosen, which is refused.
RawImage header_of_a_volume(const Input& input, ScanOptions options, std::optional<std::string>& refusal) {
    try {
        return read_raw_header(input, options);
    } catch (const GeometryError& error) {
        if (options.volume) throw;
        refusal = error.what();
    }
    options.volume = 0;
    return read_raw_header(input, options);
}

// The report on an image stack or a raw image.
SeriesReport report_on_file(const Input& input, const fs::path& path, const ScanOptions& options) {
    SeriesReport series;
    Geometry geometry;
    SampleType type{};
    bool has_spacing = options.spacing.has_value();
    if (is_image_stack(input)) {
        const ImageStack stack = read_image_stack(input.files, options);
        geometry = stack.geometry;
        type = stack.image.type;
    } else {
        const RawImage image = header_of_a_volume(input, options, series.refusal);
        series.volume_count = image.volumes;
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
    if (has_spacing) {
        series.smallest_feature = 2 * *std::max_element(geometry.spacing.begin(), geometry.spacing.end());
        series.geometry = geometry;
    } else {
        geometry.spacing = {0, 0, 0};
        series.refusal = needs_spacing(path);
    }
    series.series = series_of(path, geometry, input.files.size());
    series.memory = static_cast<std::uint64_t>(geometry.sample_count()) * sample_size(type);
    return series;
}

}  // namespace

const char* scan_format_name(ScanFormat format) {
    switch (format) {
        case ScanFormat::dicom:
            return "DICOM";
        case ScanFormat::nifti:
            return "NIfTI";
        case ScanFormat::nrrd:
            return "NRRD";
        case ScanFormat::metaimage:
            return "MetaImage";
        case ScanFormat::tiff:
            return "TIFF";
        case ScanFormat::slices:
            return "slices";
    }
    throw InputError("unknown scan format");
}

Volume read_scan(const fs::path& path, const ScanOptions& options, ScanInfo* info) {
    const Input input = identify(path, options.progress);
    ScanInfo found;
    found.format = input.format;
    Volume volume;
    check_options(input, path, options);
    if (input.format == ScanFormat::dicom) {
        volume = read_dicom({input.files, input.named}, options, found);
    } else if (is_image_stack(input)) {
        if (!options.spacing) throw GeometryError(needs_spacing(path));
        const ImageStack stack = read_image_stack(input.files, options);
        found.series = series_of(path, stack.geometry, stack.files.size());
        volume = load_image_stack(stack, options);
    } else {
        const RawImage image = read_raw_header(input, options);
        if (!image.has_spacing && !options.spacing) throw GeometryError(needs_spacing(path));
        found.series = series_of(path, image.geometry, image.files.size());
        found.warnings = image.warnings;
        found.volumes = image.volumes;
        volume = load_raw(image, options.progress);
    }
    if (info) *info = std::move(found);
    return volume;
}

Volume read_dicom_image(const DicomImage& image, const Progress& progress) {
    return read_image(image, progress);
}

bool is_segmentation(const fs::path& file) {
    try {
        if (!is_dicom(read_head(file, kHeadSize))) return false;
        const std::optional<DicomFile> header = read_dicom_header(file);
        return header && header->segmentation;
    } catch (const Error&) {
        return false;
    }
}

SliceSource open_slices(const fs::path& path, const ScanOptions& options, ScanInfo* info) {
    const Input input = identify(path, options.progress);
    check_options(input, path, options);
    if (input.format == ScanFormat::dicom || is_image_stack(input)) {
        throw InputError(
            fmt::format("{}: {} cannot be read slice by slice; read it as a whole, or convert it to "
                        "uncompressed NRRD, MetaImage or NIfTI",
                        quoted(path), scan_format_name(input.format)));
    }
    const RawImage image = read_raw_header(input, options);
    if (!image.has_spacing && !options.spacing) throw GeometryError(needs_spacing(path));
    SliceSource source = raw_slices(image);
    if (info)
        *info = {input.format, series_of(path, image.geometry, image.files.size()), image.warnings,
                 image.volumes};
    return source;
}

ScanReport inspect_scan(const fs::path& path, const ScanOptions& options) {
    const Input input = identify(path, options.progress);
    check_options(input, path, options);
    if (input.format == ScanFormat::dicom) return inspect_dicom({input.files, input.named}, options);
    ScanReport out{input.format, input.files.size(), {}, 0, "there is no other", {}};
    SeriesReport series = report_on_file(input, path, options);
    if (series.refusal) {
        out.chosen.reset();
        out.reason = *series.refusal;
    }
    out.series.push_back(std::move(series));
    return out;
}

}  // namespace marrow
