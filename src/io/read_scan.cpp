// Detects the format of an input and calls its reader.
#include <marrow/scan_io.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>

#include <marrow/error.h>

#include "base/progress.h"
#include "io/bytes/byte_stream.h"
#include "io/bytes/text.h"
#include "io/dicom/data_set.h"
#include "io/dicom/file.h"
#include "io/dicom/read_dicom.h"
#include "io/scan/image_stack.h"
#include "io/scan/parallel_slices.h"
#include "io/scan/raw_image.h"
#include "io/zarr/image.h"

namespace marrow {

namespace {

namespace fs = std::filesystem;
using namespace internal::io;
using internal::report_progress;
using internal::sub_progress;

struct Input {
    ScanFormat format;
    std::vector<fs::path> files;    // of a folder, only the files of that format
    std::optional<fs::path> named;  // DICOM: the file that stands for its series
    std::vector<fs::path> others;   // DICOM: volumes of other formats in its folder, which are not read
    std::vector<std::string> warnings = {};
};

// The share of the progress that the search for files takes.
constexpr double kFilesFound = 0.1;

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

// Whether a format is one of whole volumes. Discs hold many pictures that are not scans.
bool is_volume(std::optional<ScanFormat> format) {
    return format == ScanFormat::nifti || format == ScanFormat::nrrd || format == ScanFormat::metaimage;
}

fs::path folder_of(const fs::path& file) {
    return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

struct FolderContent {
    std::vector<fs::path> files;    // the regular ones, in natural order
    std::vector<fs::path> missing;  // links to files that are not there, as git-annex leaves them

    std::vector<std::string> warnings() const {
        if (missing.empty()) return {};
        return {
            fmt::format("{} to files that are missing, for example {}; if they are slices, fetch them first",
                        count_of(missing.size(), "link"), quoted(missing.front()))};
    }
};

FolderContent content_of(const fs::path& folder, bool nested, const Progress& progress) {
    FolderContent out;
    const auto add = [&](const fs::directory_entry& entry) {
        report_progress(progress, 0);  // a disc may have many files
        std::error_code ignored;
        if (entry.is_regular_file(ignored)) out.files.push_back(entry.path());
        if (entry.is_symlink(ignored) && !entry.exists(ignored)) out.missing.push_back(entry.path());
    };
    try {
        if (nested) {
            for (const auto& entry : fs::recursive_directory_iterator(folder)) add(entry);
        } else {
            for (const auto& entry : fs::directory_iterator(folder)) add(entry);
        }
    } catch (const fs::filesystem_error& error) {
        fail<IoError>(folder, "cannot be listed: {}", error.code().message());
    }
    std::sort(out.files.begin(), out.files.end(), natural_less);
    return out;
}

// A file that is cut off within its preamble counts as DICOM if others are DICOM, so that it is not silently
// missing; reading it fails later.
Input dicom_among(const std::vector<fs::path>& files, const ScanOptions& options) {
    enum class Kind : char { none, dicom, truncated, other };
    std::vector<Kind> kinds(files.size());
    for_each_slice(files.size(), options.threads, options.progress, 0, kFilesFound,
                   [&](std::size_t i, const Step& step) {
                       const std::string head = read_head(files[i], kHeadSize);
                       const bool cut = head.size() <= 132 &&
                                        head.find_first_not_of(std::string_view("\0DICM", 5)) == head.npos;
                       kinds[i] = is_dicom(head)                         ? Kind::dicom
                                  : cut                                  ? Kind::truncated
                                  : is_volume(format_of(files[i], head)) ? Kind::other
                                                                         : Kind::none;
                       step(1);
                   });
    const auto of_kind = [&](Kind kind) {
        std::vector<fs::path> out;
        for (std::size_t i = 0; i < files.size(); ++i) {
            if (kinds[i] == kind) out.push_back(files[i]);
        }
        return out;
    };
    Input out{ScanFormat::dicom, of_kind(Kind::dicom), {}, of_kind(Kind::other)};
    const std::vector<fs::path> truncated = of_kind(Kind::truncated);
    if (!out.files.empty()) out.files.insert(out.files.end(), truncated.begin(), truncated.end());
    return out;
}

Input identify_folder(const fs::path& folder, const ScanOptions& options) {
    if (is_zarr(folder)) return {ScanFormat::zarr, {folder}, {}, {}};
    const FolderContent content = content_of(folder, true, options.progress);
    const std::vector<fs::path>& all = content.files;
    Input input = dicom_among(all, options);
    input.warnings = content.warnings();
    if (!input.files.empty()) return input;
    const std::vector<fs::path> volumes = std::move(input.others);
    const FolderContent direct = content_of(folder, false, {});
    input = {ScanFormat::slices, direct.files, {}, {}, direct.warnings()};
    std::erase_if(input.files,
                  [](const fs::path& file) { return !is_image_file(read_head(file, kHeadSize)); });
    if (!input.files.empty()) return input;
    if (all.empty()) fail<InputError>(folder, "the folder holds no files");
    const std::string none =
        all.size() == 1 ? "the folder's only file is not DICOM or an image"
                        : fmt::format("none of the folder's {} files is DICOM or an image", all.size());
    if (volumes.empty()) fail<InputError>(folder, "{}", none);
    fail<InputError>(folder, "{}; open a NIfTI, NRRD or MetaImage file itself, such as {}", none,
                     quoted(volumes.front()));
}

bool is_archive(const fs::path& path, std::string_view head) {
    const std::string end = to_lower(path.extension().native());
    for (const char* archive : {".zip", ".tar", ".tgz", ".gz", ".bz2", ".xz", ".7z", ".rar"}) {
        if (end == archive) return true;
    }
    return head.starts_with("PK") || (head.size() > 262 && head.substr(257, 5) == "ustar");
}

Input identify_file(const fs::path& path, const ScanOptions& options) {
    const std::string head = read_head(path, kHeadSize);
    const std::string name = path.filename().string();
    if (name == "zarr.json" || name == ".zattrs" || name == ".zarray" || name == ".zgroup")
        return {ScanFormat::zarr, {folder_of(path)}, {}, {}};
    const std::optional<ScanFormat> format = format_of(path, head);
    if (!format) {
        if (is_archive(path, head)) fail<InputError>(path, "is an archive; unpack it first");
        fail<InputError>(path,
                         "is not a scan of a supported format (DICOM, NIfTI, NRRD, MetaImage, OME-Zarr, "
                         "TIFF, PNG, JPEG, "
                         "BMP)");
    }
    if (format != ScanFormat::dicom) return {*format, {path}, {}, {}};
    if (!is_dicom(head)) fail<InputError>(path, "is not a DICOM file");
    if (to_lower(path.filename().native()).starts_with("dicomdir"))
        return identify_folder(folder_of(path), options);
    const FolderContent beside = content_of(folder_of(path), false, options.progress);
    Input input = dicom_among(beside.files, options);
    input.warnings = beside.warnings();
    input.others.clear();  // the input is not the folder
    for (const fs::path& file : input.files) {
        std::error_code ignored;
        if (fs::equivalent(file, path, ignored)) input.named = file;
    }
    return input;
}

Input identify(const fs::path& path, const ScanOptions& options) {
    std::error_code ignored;
    return fs::is_directory(path, ignored) ? identify_folder(path, options) : identify_file(path, options);
}

// The options for what follows the search for files. They refer to `options`.
ScanOptions after_search(const ScanOptions& options) {
    ScanOptions out = options;
    out.progress = sub_progress(options.progress, kFilesFound, 1);
    return out;
}

// Takes the spacing of the options, which must not contradict one that the input states.
void apply_spacing(const fs::path& path, bool is_stated, const ScanOptions& options, Geometry& geometry) {
    if (!options.spacing) return;
    if (is_stated) {
        const Vec3d& spacing = geometry.spacing;
        fail<OptionError>(path, "states its spacing, {:g} x {:g} x {:g} mm; do not set options.spacing",
                          spacing[0], spacing[1], spacing[2]);
    }
    geometry.spacing = *options.spacing;
}

std::string needs_spacing(const fs::path& path) {
    return fmt::format("{}: does not state the spacing of its samples; give it with options.spacing, in mm",
                       quoted(path));
}

// What the headers of a scan other than DICOM say, and how its samples are read.
struct OpenedScan {
    explicit OpenedScan(fs::path opened) : path(std::move(opened)) {}

    fs::path path;
    std::size_t files = 1;
    Geometry geometry;
    SampleType type{};
    bool has_spacing = false, oriented = false;  // whether they are known
    std::vector<std::string> warnings;
    std::int64_t volume_count = 1;
    std::vector<std::string> volumes;  // what distinguishes them, if there are several and that is known
    std::vector<std::array<std::int64_t, 3>> levels;
    LabelTable labels;
    std::optional<std::string> choice;  // why a volume must be chosen; the first is described then
    std::optional<std::string> damage;  // why reading fails, as far as it is known
    std::function<Volume()> load;
    std::function<SliceSource()> slices;  // not of image stacks
    std::function<BoxSource()> boxes;     // only of Zarr

    SeriesInfo series() const {
        return {"", path.filename().string(), "", geometry.dims, geometry.spacing, files, labels};
    }
    ScanInfo info(ScanFormat format) const { return {format, series(), warnings, volume_count}; }
    // \throw GeometryError the volume or the spacing must be chosen
    void check_choices() const {
        if (choice) throw GeometryError(*choice);
        if (!has_spacing) throw GeometryError(needs_spacing(path));
    }
};

OpenedScan open_images(const Input& input, const fs::path& path, const ScanOptions& options) {
    const ImageStack stack = read_image_stack(input.files, options);
    OpenedScan out(path);
    out.files = stack.files.size();
    out.has_spacing = options.spacing.has_value();
    out.geometry = stack.geometry;
    out.type = stack.image.type;
    out.warnings = stack.warnings;
    out.load = [=] { return load_image_stack(stack, options); };
    return out;
}

OpenedScan open_zarr(const fs::path& folder, const ScanOptions& options) {
    ZarrImage image = read_zarr_image(folder, options);
    apply_spacing(folder, image.has_units, options, image.geometry);
    OpenedScan out(folder);
    out.has_spacing = image.has_spacing || options.spacing;
    out.oriented = image.oriented;
    out.geometry = image.geometry;
    out.type = loaded_type(image);
    out.warnings = image.warnings;
    out.levels = image.levels;
    const std::size_t count = image.volumes.size();
    out.volume_count = static_cast<std::int64_t>(count);
    if (!image.volume)
        out.choice = fmt::format("{}: holds {} volumes; choose one from 0 to {} with options.volume: {}",
                                 quoted(folder), count, count - 1, examples(image.volumes));
    if (count > 1) out.volumes = std::move(image.volumes);
    try {
        check_stated_geometry(folder, image.geometry);
    } catch (const GeometryError& error) {
        out.damage = error.what();
    }
    out.load = [=] { return load_zarr(image, options); };
    out.slices = [=] { return zarr_slices(image, options.threads); };
    out.boxes = [=] { return zarr_boxes(image); };
    return out;
}

OpenedScan open_raw(const Input& input, const fs::path& path, ScanOptions options) {
    OpenedScan out(path);
    const auto header = [&] {
        return input.format == ScanFormat::nifti  ? read_nifti_header(path, options.volume)
               : input.format == ScanFormat::nrrd ? read_nrrd_header(path, options.volume)
                                                  : read_metaimage_header(path, options.volume);
    };
    RawImage image;
    try {
        image = header();
    } catch (const GeometryError& error) {
        if (options.volume) throw;
        out.choice = error.what();
        options.volume = 0;
        image = header();
    }
    apply_spacing(path, image.has_spacing, options, image.geometry);
    if (options.keep_stored) keep_stored(image);
    out.files = image.files.size();
    out.geometry = image.geometry;
    out.type = loaded_type(image);
    out.has_spacing = image.has_spacing || options.spacing;
    out.oriented = image.oriented;
    out.warnings = image.warnings;
    out.volume_count = image.volumes;
    out.volumes = image.volume_names;
    out.labels = image.labels;
    try {
        check_claims(image);
    } catch (const Error& error) {
        out.damage = error.what();
    }
    out.load = [=] { return load_raw(image, options.progress); };
    out.slices = [=] { return raw_slices(image); };
    return out;
}

bool is_image_stack(const Input& input) {
    return input.format == ScanFormat::tiff || input.format == ScanFormat::slices;
}

OpenedScan open(const Input& input, const fs::path& path, const ScanOptions& options) {
    if (input.format == ScanFormat::zarr) return open_zarr(input.files[0], options);
    return is_image_stack(input) ? open_images(input, path, options) : open_raw(input, path, options);
}

// Refuses options that do not apply to the input.
void check_options(const Input& input, const fs::path& path, const ScanOptions& options) {
    const bool dicom = input.format == ScanFormat::dicom;
    if (!dicom && options.series) fail<OptionError>(path, "only DICOM has series; do not set options.series");
    if (!dicom && options.resample)
        fail<OptionError>(path, "only DICOM can be resampled; do not set options.resample");
    if (options.volume.value_or(0) != 0 && is_image_stack(input))
        fail<OptionError>(path, "images have only one volume; do not set options.volume");
    if (options.level && input.format != ScanFormat::zarr)
        fail<OptionError>(path, "only OME-Zarr has levels; do not set options.level");
}

SeriesReport report_on(const OpenedScan& scan) {
    SeriesReport out;
    Geometry geometry = scan.geometry;
    out.refusal = scan.damage ? scan.damage : scan.choice;
    if (scan.has_spacing) {
        out.smallest_feature = 2 * *std::max_element(geometry.spacing.begin(), geometry.spacing.end());
        out.geometry = geometry;
    } else {
        out.refusal = needs_spacing(scan.path);
    }
    out.series = scan.series();
    if (!scan.has_spacing) out.series.spacing = {0, 0, 0};
    out.warnings = scan.warnings;
    out.oriented = scan.oriented;
    if (!scan.damage)
        out.memory = static_cast<std::uint64_t>(geometry.sample_count()) * sample_size(scan.type);
    out.volumes = scan.volumes;
    out.volume_count = scan.volume_count;
    out.levels = scan.levels;
    return out;
}

}  // namespace

const char* scan_format_name(ScanFormat format) {
    static constexpr std::array kNames = {"DICOM", "NIfTI", "NRRD", "MetaImage", "Zarr", "TIFF", "slices"};
    const auto index = static_cast<std::size_t>(format);
    if (index >= kNames.size()) throw InputError("unknown scan format");
    return kNames[index];
}

Volume read_scan(const fs::path& path, const ScanOptions& given, ScanInfo* info) {
    const Input input = identify(path, given);
    const ScanOptions options = after_search(given);
    check_options(input, path, options);
    ScanInfo found;
    found.format = input.format;
    Volume volume;
    if (input.format == ScanFormat::dicom) {
        volume = read_dicom({input.files, input.named}, options, found);
    } else {
        const OpenedScan scan = open(input, path, options);
        scan.check_choices();
        found = scan.info(input.format);
        volume = scan.load();
    }
    found.warnings.insert(found.warnings.begin(), input.warnings.begin(), input.warnings.end());
    if (info) *info = std::move(found);
    return volume;
}

Volume read_dicom_image(const DicomImage& image, const Progress& progress) {
    return read_image(image, progress);
}

bool is_segmentation(const fs::path& path, const ScanOptions& given) {
    const Input input = identify(path, given);
    ScanOptions options = after_search(given);
    check_options(input, path, options);
    if (input.format == ScanFormat::dicom) return is_dicom_segmentation({input.files, input.named}, options);
    options.volume.reset();  // the first layer has segments
    return input.format == ScanFormat::nrrd && !open(input, path, options).labels.empty();
}

SliceSource open_slices(const fs::path& path, const ScanOptions& options, ScanInfo* info) {
    const Input input = identify(path, options);
    check_options(input, path, options);
    if (input.format == ScanFormat::dicom || is_image_stack(input)) {
        fail<InputError>(path,
                         "{} cannot be read slice by slice; read it as a whole, or convert it to "
                         "uncompressed NRRD, MetaImage or NIfTI",
                         scan_format_name(input.format));
    }
    const OpenedScan scan = open(input, path, options);
    scan.check_choices();
    if (info) *info = scan.info(input.format);
    return scan.slices();
}

BoxSource open_boxes(const fs::path& path, const ScanOptions& options) {
    const Input input = identify(path, options);
    check_options(input, path, options);
    if (input.format != ScanFormat::zarr)
        throw InputError(fmt::format("{}: {} cannot be read in boxes; convert it to OME-Zarr", quoted(path),
                                     scan_format_name(input.format)));
    const OpenedScan scan = open(input, path, options);
    scan.check_choices();
    return scan.boxes();
}

ScanReport inspect_scan(const fs::path& path, const ScanOptions& given) {
    const Input input = identify(path, given);
    const ScanOptions options = after_search(given);
    check_options(input, path, options);
    if (input.format == ScanFormat::dicom) {
        ScanReport out = inspect_dicom({input.files, input.named}, options);
        out.warnings.insert(out.warnings.begin(), input.warnings.begin(), input.warnings.end());
        if (!input.others.empty())
            out.warnings.push_back(
                fmt::format("the folder also holds {} in other formats, for example {}; "
                            "name them to inspect them",
                            count_of(input.others.size(), "volume"), quoted(input.others[0])));
        return out;
    }
    ScanReport out{input.format, input.files.size(), {}, 0, "there is no other", input.warnings};
    SeriesReport series = report_on(open(input, path, options));
    if (series.refusal) {
        out.chosen.reset();
        out.reason = *series.refusal;
    }
    out.series.push_back(std::move(series));
    return out;
}

}  // namespace marrow
