// Reads images in OME-Zarr. See https://ngff.openmicroscopy.org, versions 0.4 and 0.5.
#include "image.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

#include <marrow/error.h>

#include "base/parallel.h"
#include "io/bytes/text.h"
#include "metadata.h"

namespace marrow::internal::io {

namespace fs = std::filesystem;

namespace {

struct Axis {
    std::string name, type, unit;
    std::string orientation = {};  // anatomical: "left-to-right"
};

// Where the samples of an image are: at scale * index + translation along each axis.
struct Transform {
    std::vector<double> scale, translation;
    bool has_scale = false;
};

// What a folder's metadata say about an image.
struct Multiscales {
    Metadata image;
    std::vector<std::string> channels;  // their labels; empty where there is none
};

std::optional<Multiscales> find_multiscales(const fs::path& folder) {
    std::error_code ignored;
    std::optional<Metadata> attributes;
    if (fs::exists(folder / "zarr.json", ignored)) {
        const Metadata group(folder / "zarr.json");
        if (group.has("attributes") && group.at("attributes").has("ome"))
            attributes = group.at("attributes").at("ome");
    } else if (fs::exists(folder / ".zattrs", ignored)) {
        attributes = Metadata(folder / ".zattrs");
    }
    if (!attributes || !attributes->has("multiscales")) return {};
    const std::vector<Metadata> images = attributes->at("multiscales").elements();
    if (images.empty()) attributes->refuse("'multiscales' is empty");
    Multiscales out{images.front(), {}};
    const Metadata& versioned = images.front().has("version") ? images.front() : *attributes;
    const std::string version = versioned.has("version") ? versioned.at("version").text() : "0.4";
    if (!version.starts_with("0.4") && !version.starts_with("0.5"))
        attributes->refuse(
            fmt::format("version {} of OME-Zarr is not supported, only 0.4 and 0.5", quoted(version)));
    if (attributes->has("omero") && attributes->at("omero").has("channels")) {
        for (const Metadata& channel : attributes->at("omero").at("channels").elements())
            out.channels.push_back(channel.has("label") ? channel.at("label").text() : "");
    }
    return out;
}

// The anatomical orientation of an axis, after RFC 4; empty if there is none. One in another form is unknown.
std::string orientation_of(const Metadata& axis) {
    if (!axis.has("orientation")) return {};
    const nlohmann::json orientation = axis.at("orientation").json();
    const bool is_anatomical = orientation.is_object() &&
                               orientation.value("type", nlohmann::json()) == "anatomical" &&
                               orientation.contains("value") && orientation["value"].is_string();
    return is_anatomical ? orientation["value"].get<std::string>() : orientation.dump();
}

std::vector<Axis> read_axes(const Metadata& image) {
    std::vector<Axis> out;
    for (const Metadata& axis : image.at("axes").elements()) {
        const auto text = [&](const char* name) {
            return axis.has(name) ? axis.at(name).text() : std::string();
        };
        out.push_back({axis.at("name").text(), text("type"), text("unit"), orientation_of(axis)});
        // The type is optional.
        Axis& added = out.back();
        if (added.type.empty() && (added.name == "x" || added.name == "y" || added.name == "z"))
            added.type = "space";
    }
    return out;
}

// Applies the steps that an object lists to a transform.
void apply_steps(const Metadata& object, Transform& transform) {
    if (!object.has("coordinateTransformations")) return;
    for (const Metadata& step : object.at("coordinateTransformations").elements()) {
        const std::string type = step.at("type").text();
        if (type == "identity") continue;
        if (type != "scale" && type != "translation")
            step.refuse(fmt::format("the transformation {} is not supported", quoted(type)));
        if (!step.has(type.c_str())) step.refuse(fmt::format("a {} has no numbers in this file", type));
        const std::vector<double> numbers = step.at(type.c_str()).numbers();
        if (numbers.size() != transform.scale.size())
            step.refuse(
                fmt::format("a {} has {} numbers for {} axes", type, numbers.size(), transform.scale.size()));
        for (std::size_t a = 0; a < numbers.size(); ++a) {
            if (type == "scale") {
                transform.has_scale = true;
                if (!(numbers[a] > 0)) step.refuse("a scale is not positive");
                transform.scale[a] *= numbers[a];
                transform.translation[a] *= numbers[a];
            } else {
                transform.translation[a] += numbers[a];
            }
        }
    }
}

// The last three axes must be those of space.
void check_axes(const Metadata& image, const std::vector<Axis>& axes) {
    std::size_t space = 0;
    for (const Axis& axis : axes) space += axis.type == "space";
    if (space == 2) image.refuse("the image has two axes in space; a volume has three");
    for (std::size_t a = 0; a < axes.size(); ++a) {
        if (space != 3 || (axes[a].type == "space") != (a + 3 >= axes.size()))
            image.refuse("the last three axes are not those of space");
    }
}

// The index axes of a volume are i, j and k; the array's last axis is i.
std::size_t index_axis(std::size_t array_axis, std::size_t axes) {
    return axes - 1 - array_axis;
}

// The coordinate of LPS that an axis runs along, and its sign.
struct Direction {
    std::size_t row;
    double sign;
};

// The direction that an anatomical orientation states.
std::optional<Direction> anatomical_direction(const std::string& orientation) {
    static constexpr std::pair<std::string_view, Direction> known[] = {
        {"right-to-left", {0, 1}},         {"left-to-right", {0, -1}},
        {"anterior-to-posterior", {1, 1}}, {"posterior-to-anterior", {1, -1}},
        {"inferior-to-superior", {2, 1}},  {"superior-to-inferior", {2, -1}}};
    for (const auto& [name, direction] : known) {
        if (orientation == name) return direction;
    }
    return {};
}

// Whether the axes of space state where they run in the body.
bool is_oriented(const std::vector<Axis>& axes, ZarrImage& image) {
    constexpr const char* kTaken = "x, y and z are taken for left, posterior and superior";
    const Axis* unknown = nullptr;
    std::size_t known = 0;
    for (const Axis& axis : axes) {
        if (axis.type != "space" || axis.orientation.empty()) continue;
        if (anatomical_direction(axis.orientation))
            ++known;
        else
            unknown = &axis;
    }
    if (known == 3) return true;
    if (unknown)
        image.warnings.push_back(
            fmt::format("the orientation {} is unknown; {}", quoted(unknown->orientation), kTaken));
    else if (known > 0)
        image.warnings.push_back(
            fmt::format("only some axes state their orientation in the body; {}", kTaken));
    return false;
}

// `metadata` are those of the image, for errors.
void place(const Metadata& metadata, const std::vector<Axis>& axes, const Transform& transform,
           const ScanOptions& options, ZarrImage& image) {
    const std::size_t n = image.array.shape.size();
    // The specification demands a scale. Without one, the numbers of the metadata have no meaning.
    image.has_units = image.has_spacing = transform.has_scale;
    image.oriented = is_oriented(axes, image);
    image.geometry.direction = {{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}};
    std::array<bool, 3> taken{};
    for (std::size_t a = n - 3; a < n; ++a) {
        const std::size_t m = index_axis(a, n);
        // An axis with another name is taken by its place.
        const auto named = std::string_view("xyz").find(axes[a].name);
        const bool is_named = named != std::string_view::npos && axes[a].name.size() == 1;
        const auto [row, sign] =
            image.oriented ? *anatomical_direction(axes[a].orientation) : Direction{is_named ? named : m, 1};
        if (taken[row]) metadata.refuse(fmt::format("two axes of the image run along {}", "xyz"[row]));
        taken[row] = true;
        double mm = 1;
        if (axes[a].unit.empty()) {
            image.has_units = false;
            // The translation is in the unit of the scale, which the spacing shows.
            if (options.spacing && transform.scale[a] > 0) mm = (*options.spacing)[m] / transform.scale[a];
        } else if (const auto known = millimetres(axes[a].unit)) {
            mm = *known;
        } else {
            metadata.refuse(fmt::format("the unit {} is unknown", quoted(axes[a].unit)));
        }
        Geometry& g = image.geometry;
        g.dims[m] = image.array.shape[a];
        g.spacing[m] = transform.scale[a] * mm;
        g.origin[row] = sign * transform.translation[a] * mm;
        g.direction[row][m] = sign;
    }
    if (image.has_spacing && !image.has_units && !options.spacing)
        image.warnings.push_back(
            "the metadata state no unit of length; their numbers are taken for millimetres");
}

// Names the volumes along the axes before those of space, and chooses one.
void choose_volume(const std::vector<Axis>& axes, const std::vector<std::string>& channels,
                   const ScanOptions& options, ZarrImage& image) {
    const ZarrArray::Index& shape = image.array.shape;
    const std::size_t outer = shape.size() - 3;
    constexpr double kMost = 1 << 20;
    double count = 1;
    for (std::size_t a = 0; a < outer; ++a) count *= static_cast<double>(shape[a]);
    if (count > kMost)
        throw InputError(fmt::format("{}: Zarr metadata: the image has {:.0f} volumes",
                                     quoted(image.array.folder), count));

    image.first.assign(shape.size(), 0);
    const auto volumes = static_cast<std::int64_t>(count);
    if (options.volume && (*options.volume < 0 || *options.volume >= volumes))
        throw OptionError(fmt::format("{}: has no volume {}; there are {}, numbered from 0",
                                      quoted(image.array.folder), *options.volume, volumes));
    for (std::int64_t volume = 0; volume < volumes; ++volume) {
        std::string name;
        std::int64_t rest = volume;
        for (std::size_t a = outer; a-- > 0;) {
            const std::int64_t index = rest % shape[a];
            rest /= shape[a];
            if (volume == options.volume) image.first[a] = index;
            if (shape[a] == 1) continue;
            std::string label =
                fmt::format("{} {}", axes[a].type.empty() ? axes[a].name : axes[a].type, index);
            const auto number = static_cast<std::size_t>(index);
            if (axes[a].type == "channel" && number < channels.size() && !channels[number].empty())
                label += fmt::format(" ({})", channels[number]);
            name = name.empty() ? label : label + ", " + name;
        }
        image.volumes.push_back(name);
    }
    image.volume = volumes == 1 ? 0 : options.volume;
}

// An array without metadata of an image has three axes, and states no spacing.
ZarrImage read_plain_array(const fs::path& folder, const ScanOptions& options) {
    ZarrImage image;
    image.array = read_zarr_array(folder);
    const ZarrArray::Index& shape = image.array.shape;
    if (shape.size() != 3)
        throw InputError(
            fmt::format("{}: the Zarr array has {} axes instead of three, and no OME-Zarr metadata",
                        quoted(folder), shape.size()));
    image.geometry.dims = {shape[2], shape[1], shape[0]};
    image.levels = {image.geometry.dims};
    choose_volume({{"z", "space", ""}, {"y", "space", ""}, {"x", "space", ""}}, {}, options, image);
    return image;
}

// A folder may hold other images, which can be named instead.
[[noreturn]] void refuse_group(const fs::path& folder) {
    std::vector<std::string> images;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(folder, ignored)) {
        if (entry.is_directory(ignored) && is_zarr(entry.path()))
            images.push_back(entry.path().filename().string());
    }
    std::sort(images.begin(), images.end());
    throw InputError(images.empty()
                         ? fmt::format("{}: the Zarr group holds no image", quoted(folder))
                         : fmt::format("{}: the Zarr group is no image; name one of the folders in it: {}",
                                       quoted(folder), examples(images)));
}

// Reads the array of a dataset, whose path must not leave the folder.
ZarrArray dataset_array(const Metadata& dataset) {
    const std::string path = dataset.at("path").text();
    const fs::path array = sibling_path(dataset.file(), path);
    std::error_code ignored;
    if (!is_zarr(array)) dataset.refuse(fmt::format("the array {} is missing", quoted(path)));
    return read_zarr_array(array);
}

}  // namespace

ZarrImage read_zarr_image(const fs::path& folder, const ScanOptions& options) {
    const std::optional<Multiscales> found = find_multiscales(folder);
    if (!found) {
        std::error_code ignored;
        const bool is_array = fs::exists(folder / ".zarray", ignored) ||
                              (fs::exists(folder / "zarr.json", ignored) &&
                               Metadata(folder / "zarr.json").at("node_type").text() == "array");
        if (!is_array) refuse_group(folder);
        if (options.level.value_or(0) != 0)
            throw OptionError(
                fmt::format("{}: has no level {}; there is one, 0", quoted(folder), *options.level));
        return read_plain_array(folder, options);
    }
    const Metadata& metadata = found->image;
    const std::vector<Axis> axes = read_axes(metadata);
    check_axes(metadata, axes);
    const std::vector<Metadata> datasets = metadata.at("datasets").elements();
    if (datasets.empty()) metadata.refuse("'datasets' is empty");
    constexpr std::size_t kMostLevels = 64;  // each halves the size
    if (datasets.size() > kMostLevels)
        metadata.refuse(fmt::format("the image has {} levels", datasets.size()));
    const std::int64_t level = options.level.value_or(0);
    if (level < 0 || level >= static_cast<std::int64_t>(datasets.size()))
        throw OptionError(fmt::format("{}: has no level {}; there are {}, numbered from 0", quoted(folder),
                                      level, datasets.size()));

    ZarrImage image;
    for (std::size_t l = 0; l < datasets.size(); ++l) {
        ZarrArray array = dataset_array(datasets[l]);
        if (array.shape.size() != axes.size())
            datasets[l].refuse(
                fmt::format("level {} has {} axes, and the image {}", l, array.shape.size(), axes.size()));
        const std::size_t n = axes.size();
        image.levels.push_back({array.shape[n - 1], array.shape[n - 2], array.shape[n - 3]});
        if (static_cast<std::int64_t>(l) == level) image.array = std::move(array);
    }
    Transform transform{std::vector<double>(axes.size(), 1), std::vector<double>(axes.size(), 0)};
    apply_steps(datasets[static_cast<std::size_t>(level)], transform);
    apply_steps(metadata, transform);
    place(metadata, axes, transform, options, image);
    choose_volume(axes, found->channels, options, image);
    return image;
}

SampleType loaded_type(const ZarrImage& image) {
    return loaded_type(image.array.type, {});
}

namespace {

// Reads a box of samples; x, y, z. Samples that are stored in another type are all read.
void read_box(const ZarrImage& image, const std::array<std::int64_t, 3>& first,
              const std::array<std::int64_t, 3>& dims, void* to, const std::function<void()>& done,
              const BoxSource::KnownChunks& known = {}) {
    const ZarrArray& array = image.array;
    const std::size_t axes = array.shape.size();
    ZarrArray::Index begin = image.first, end = begin;
    for (std::size_t a = 0; a + 3 < axes; ++a) ++end[a];
    for (std::size_t a = 0; a < 3; ++a) {
        begin[axes - 1 - a] += first[a];
        end[axes - 1 - a] = begin[axes - 1 - a] + dims[a];
    }
    if (is_loaded_as_stored(array.type, {})) {
        if (!known) return read_zarr(array, begin, end, to, done);
        return read_zarr(array, begin, end, to, done, [&](const ZarrArray::Index& chunk) {
            return known({chunk[axes - 1], chunk[axes - 2], chunk[axes - 3]});
        });
    }
    const auto count = static_cast<std::size_t>(dims[0] * dims[1] * dims[2]);
    std::vector<std::byte> stored(count * stored_size(array.type));
    read_zarr(array, begin, end, stored.data(), done);
    load_samples(stored.data(), to, count, array.type, {}, array.folder);
}

// Reads the samples of slices [z_begin, z_end).
void read_slices(const ZarrImage& image, std::int64_t z_begin, std::int64_t z_end, void* to,
                 const std::function<void()>& done) {
    const auto& dims = image.geometry.dims;
    read_box(image, {0, 0, z_begin}, {dims[0], dims[1], z_end - z_begin}, to, done);
}

std::size_t chunk_bytes(const ZarrArray& array) {
    std::size_t bytes = stored_size(array.type);
    for (const std::int64_t size : array.chunk) bytes *= static_cast<std::size_t>(size);
    return bytes;
}

// The number of chunks of the volume.
std::size_t chunks_of(const ZarrImage& image) {
    ZarrArray::Index end = image.array.shape;
    for (std::size_t a = 0; a + 3 < end.size(); ++a) end[a] = image.first[a] + 1;
    return count_chunks(image.array, image.first, end);
}

// Slices that are in the same chunks.
std::int64_t slices_at_once(const ZarrImage& image) {
    return image.array.chunk[image.array.shape.size() - 3];
}

// Chunks that are missing take no room on disk: an array can be larger than any machine.
void check_memory(const ZarrImage& image) {
    check_stated_geometry(image.array.folder, image.geometry);
    const double needed = static_cast<double>(image.geometry.sample_count()) *
                          static_cast<double>(sample_size(loaded_type(image)));
    const double present =
        static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
    if (needed > present)
        throw LimitError(
            fmt::format("{}: needs {:.1f} GiB of memory, and this machine has {:.1f}; read a coarser level "
                        "with options.level, or read it slice by slice",
                        quoted(image.array.folder), needed / (1 << 30), present / (1 << 30)));
}

}  // namespace

Volume load_zarr(const ZarrImage& image, const ScanOptions& options) {
    check_memory(image);
    Volume volume(image.geometry, loaded_type(image));
    const std::int64_t nz = image.geometry.dims[2], step = slices_at_once(image);
    const std::size_t slice_bytes = volume.bytes() / static_cast<std::size_t>(nz);
    report_progress(options.progress, 0);
    Stage stage(options.progress, 0, 1, chunks_of(image));
    with_threads(options.threads, [&] {
        for (std::int64_t z = 0; z < nz; z += step)
            read_slices(image, z, std::min(z + step, nz),
                        static_cast<std::byte*>(volume.data()) + slice_bytes * static_cast<std::size_t>(z),
                        [&] { stage.step(); });
    });
    return volume;
}

SliceSource zarr_slices(ZarrImage image, int threads) {
    check_stated_geometry(image.array.folder, image.geometry);
    const Geometry geometry = image.geometry;
    const SampleType type = loaded_type(image);
    const std::int64_t together = slices_at_once(image);
    const std::size_t slice_samples = static_cast<std::size_t>(geometry.dims[0] * geometry.dims[1]),
                      slice_bytes = slice_samples * sample_size(type);
    const bool as_stored = is_loaded_as_stored(image.array.type, {});
    // Each thread holds a chunk as it is stored and as it is decoded. Samples of another type are converted a
    // layer of chunks at a time.
    const auto most =
        static_cast<std::size_t>(threads > 0 ? std::min(threads, thread_count()) : thread_count());
    std::size_t read_bytes = std::min(most, chunks_of(image)) * 2 * chunk_bytes(image.array);
    if (!as_stored)
        read_bytes += static_cast<std::size_t>(std::min(together, geometry.dims[2])) * slice_samples *
                      stored_size(image.array.type);
    const auto read = [=, image = std::move(image)](std::int64_t z_begin, std::int64_t z_end, void* samples) {
        const std::int64_t step = as_stored ? z_end - z_begin : together;
        for (std::int64_t z = z_begin; z < z_end; z += step)
            read_slices(
                image, z, std::min(z + step, z_end),
                static_cast<std::byte*>(samples) + slice_bytes * static_cast<std::size_t>(z - z_begin),
                [] {});
    };
    return {geometry, type, read, together, {}, read_bytes};
}

BoxSource zarr_boxes(ZarrImage image) {
    check_stated_geometry(image.array.folder, image.geometry);
    const Geometry geometry = image.geometry;
    const SampleType type = loaded_type(image);
    const std::size_t axes = image.array.shape.size();
    const std::array<std::int64_t, 3> chunk{image.array.chunk[axes - 1], image.array.chunk[axes - 2],
                                            image.array.chunk[axes - 3]};
    const auto read = [image = std::move(image)](const std::array<std::int64_t, 3>& first,
                                                 const std::array<std::int64_t, 3>& dims, void* samples,
                                                 const BoxSource::KnownChunks& known) {
        for (std::size_t a = 0; a < 3; ++a) {
            if (first[a] < 0 || dims[a] < 1 || first[a] > image.geometry.dims[a] - dims[a])
                throw InputError(fmt::format("{}: a box leaves the volume", quoted(image.array.folder)));
        }
        read_box(
            image, first, dims, samples, [] {}, known);
    };
    return {geometry, type, chunk, read};
}

}  // namespace marrow::internal::io
