// Reads the metadata of Zarr arrays. See https://zarr-specs.readthedocs.io, versions 2 and 3.
#include "array.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include <marrow/error.h>

#include "io/bytes/text.h"
#include "metadata.h"

namespace marrow::internal::io {

namespace fs = std::filesystem;

namespace {

constexpr double kLargestChunk = 2147483647;  // bytes; Blosc's limit

// Whether a number is one of an integer type. The bounds of doubles are exact.
template <class T>
bool is_whole(double value) {
    return value == std::floor(value) && value >= static_cast<double>(std::numeric_limits<T>::min()) &&
           value < std::ldexp(1.0, std::numeric_limits<T>::digits);
}

// The value of a number, or of a string that stands for one.
std::vector<std::byte> read_fill(const Metadata& metadata, StoredType type) {
    std::vector<std::byte> out(stored_size(type));
    if (!metadata.has("fill_value")) return out;
    const Metadata member = metadata.at("fill_value");
    const nlohmann::json& value = member.json();
    const auto refuse = [&] {
        metadata.refuse(
            fmt::format("the fill_value {} is not a value of the array's data type", quoted(value.dump())));
    };
    with_stored_type(type, [&]<class T>(T) {
        T fill{};
        if (value.is_boolean()) {
            fill = static_cast<T>(value.get<bool>());
        } else if (value.is_string() &&
                   value.get<std::string>().starts_with("0x")) {  // the bits of the sample
            const auto text = value.get<std::string>();
            std::uint64_t bits = 0;
            const auto [end, error] = std::from_chars(text.data() + 2, text.data() + text.size(), bits, 16);
            if (error != std::errc() || end != text.data() + text.size() || text.size() != 2 + 2 * sizeof(T))
                refuse();
            for (std::size_t i = 0; i < sizeof(T); ++i) out[i] = static_cast<std::byte>(bits >> 8 * i);
            to_native_order(out.data(), 1, type, false);
            return;
        } else if constexpr (std::is_floating_point_v<T>) {
            constexpr T kInfinity = std::numeric_limits<T>::infinity();
            if (value == "NaN")
                fill = std::numeric_limits<T>::quiet_NaN();
            else if (value == "Infinity" || value == "-Infinity")
                fill = value == "Infinity" ? kInfinity : -kInfinity;
            else if (value.is_number())
                fill = static_cast<T>(value.get<double>());
            else
                refuse();
        } else if (value.is_number_unsigned() &&
                   value.get<std::uint64_t>() <= static_cast<std::uint64_t>(std::numeric_limits<T>::max())) {
            fill = static_cast<T>(value.get<std::uint64_t>());
        } else if (value.is_number_integer() && !value.is_number_unsigned() && std::is_signed_v<T> &&
                   value.get<std::int64_t>() >= static_cast<std::int64_t>(std::numeric_limits<T>::min())) {
            fill = static_cast<T>(value.get<std::int64_t>());
        } else if (value.is_number_float() && is_whole<T>(value.get<double>())) {
            fill = static_cast<T>(value.get<double>());
        } else {
            refuse();
        }
        std::memcpy(out.data(), &fill, sizeof fill);
    });
    return out;
}

// \throw InputError the sizes make no array, or its chunks are too large
void check_sizes(const Metadata& metadata, const ZarrArray& array, const ZarrArray::Index& file) {
    const std::size_t axes = array.shape.size();
    if (axes == 0 || axes > 8) metadata.refuse(fmt::format("the array has {} axes", axes));
    if (array.chunk.size() != axes || file.size() != axes)
        metadata.refuse("the shape has another number of axes than the chunks");
    double bytes = static_cast<double>(stored_size(array.type));
    for (const std::int64_t size : array.chunk) bytes *= static_cast<double>(size);
    if (bytes > kLargestChunk) metadata.refuse(fmt::format("a chunk has {:g} bytes, more than 2 GiB", bytes));
    double chunks = 1;  // in a file
    for (std::size_t a = 0; a < axes; ++a)
        chunks *= static_cast<double>(file[a]) / static_cast<double>(array.chunk[a]);
    if (16 * chunks > kLargestChunk) metadata.refuse(fmt::format("a shard has {:g} chunks", chunks));
}

std::vector<std::size_t> c_order(std::size_t axes) {
    std::vector<std::size_t> order(axes);
    std::iota(order.begin(), order.end(), std::size_t{0});
    return order;
}

ZarrArray read_version_2(const fs::path& folder) {
    static constexpr TypeName kTypes[] = {
        {"b1", StoredType::uint8},   {"u1", StoredType::uint8},  {"i1", StoredType::int8},
        {"u2", StoredType::uint16},  {"i2", StoredType::int16},  {"u4", StoredType::uint32},
        {"i4", StoredType::int32},   {"u8", StoredType::uint64}, {"i8", StoredType::int64},
        {"f4", StoredType::float32}, {"f8", StoredType::float64}};
    const Metadata metadata(folder / ".zarray");
    ZarrArray array;
    array.folder = folder;
    array.shape = metadata.at("shape").integers(1);
    array.chunk = metadata.at("chunks").integers(1);
    const std::string type = metadata.at("dtype").text();
    const auto known = type.empty() ? std::nullopt : find_type(kTypes, std::string_view(type).substr(1));
    if (!known || std::string_view("<>|").find(type[0]) == std::string_view::npos)
        metadata.refuse(fmt::format("samples of type {} are not supported", quoted(type)));
    array.type = *known;
    array.big_endian = type[0] == '>';
    check_sizes(metadata, array, array.chunk);

    array.fill = read_fill(metadata, array.type);
    array.order = c_order(array.shape.size());
    if (metadata.has("order") && metadata.at("order").text() == "F")
        std::reverse(array.order.begin(), array.order.end());
    if (metadata.has("filters") && !metadata.at("filters").elements().empty())
        metadata.refuse(fmt::format("filters such as {} are not supported",
                                    quoted(metadata.at("filters").elements()[0].at("id").text())));
    if (metadata.has("compressor")) {
        const std::string name = metadata.at("compressor").at("id").text();
        array.codecs.compressor = find_compressor(name);
        if (!array.codecs.compressor)
            metadata.refuse(fmt::format("the compressor {} is not supported", quoted(name)));
    }
    array.separator = metadata.has("dimension_separator") ? metadata.at("dimension_separator").text() : ".";
    if (array.separator != "." && array.separator != "/")
        metadata.refuse("the dimension_separator is neither '.' nor '/'");
    return array;
}

// Reads the codecs of chunks, in the order of writing: transpose, bytes, a compressor,
// crc32c; each but bytes may be absent.
void read_codecs(const std::vector<Metadata>& codecs, ZarrArray& array) {
    array.order = c_order(array.shape.size());
    bool is_bytes = false;  // what the codecs so far have made
    for (const Metadata& codec : codecs) {
        const std::string name = codec.extension_name();
        const bool has_options = codec.has("configuration");
        if (name == "transpose" && !is_bytes) {
            const auto order = codec.at("configuration").at("order").integers(0);
            if (!std::is_permutation(order.begin(), order.end(), array.order.begin(), array.order.end()))
                codec.refuse("the order of a transpose codec is not a permutation of the axes");
            std::vector<std::size_t> next;
            for (const std::int64_t axis : order) next.push_back(array.order[static_cast<std::size_t>(axis)]);
            array.order = next;
        } else if (name == "bytes" && !is_bytes) {
            is_bytes = true;
            array.big_endian = has_options && codec.at("configuration").has("endian") &&
                               codec.at("configuration").at("endian").text() == "big";
        } else if (name == "crc32c" && is_bytes && !array.codecs.checksum) {
            array.codecs.checksum = true;
        } else if (find_compressor(name) && is_bytes && !array.codecs.compressor && !array.codecs.checksum) {
            array.codecs.compressor = find_compressor(name);
        } else {
            codec.refuse(fmt::format("the codec {} is not supported, or not at this place", quoted(name)));
        }
    }
    if (!is_bytes && !codecs.empty()) codecs.front().refuse("the codecs lack 'bytes'");
}

ZarrArray::ShardIndex read_shards(const Metadata& codec, const ZarrArray::Index& file, ZarrArray& array) {
    const Metadata options = codec.at("configuration");
    ZarrArray::ShardIndex index;
    array.chunk = options.at("chunk_shape").integers(1);
    if (array.chunk.size() != file.size()) codec.refuse("a shard has another number of axes than its chunks");
    for (std::size_t a = 0; a < file.size(); ++a) {
        if (file[a] % array.chunk[a] != 0) codec.refuse("a shard is not made of whole chunks");
        index.chunks.push_back(file[a] / array.chunk[a]);
    }
    index.at_start = options.has("index_location") && options.at("index_location").text() == "start";
    for (const Metadata& step : options.at("index_codecs").elements()) {
        const std::string name = step.extension_name();
        const bool big = step.has("configuration") && step.at("configuration").has("endian") &&
                         step.at("configuration").at("endian").text() == "big";
        if (name == "crc32c")
            index.checksum = true;
        else if (name != "bytes" || big)
            step.refuse(fmt::format("the codec {} of a shard's index is not supported", quoted(name)));
    }
    read_codecs(options.at("codecs").elements(), array);
    return index;
}

ZarrArray read_version_3(const fs::path& folder) {
    static constexpr TypeName kTypes[] = {
        {"bool", StoredType::uint8},      {"uint8", StoredType::uint8},    {"int8", StoredType::int8},
        {"uint16", StoredType::uint16},   {"int16", StoredType::int16},    {"uint32", StoredType::uint32},
        {"int32", StoredType::int32},     {"uint64", StoredType::uint64},  {"int64", StoredType::int64},
        {"float32", StoredType::float32}, {"float64", StoredType::float64}};
    const Metadata metadata(folder / "zarr.json");
    if (metadata.at("node_type").text() != "array") metadata.refuse("is of a group, not of an array");
    ZarrArray array;
    array.folder = folder;
    array.shape = metadata.at("shape").integers(1);
    if (!metadata.at("data_type").json().is_string())
        metadata.refuse("samples of this data_type are not supported");
    const std::string type = metadata.at("data_type").text();
    const auto known = find_type(kTypes, type);
    if (!known) metadata.refuse(fmt::format("samples of type {} are not supported", quoted(type)));
    array.type = *known;
    const Metadata grid = metadata.at("chunk_grid");
    if (grid.extension_name() != "regular")
        metadata.refuse(fmt::format("the chunk grid {} is not supported", quoted(grid.extension_name())));
    const ZarrArray::Index file = grid.at("configuration").at("chunk_shape").integers(1);
    array.chunk = file;
    if (metadata.has("storage_transformers") && !metadata.at("storage_transformers").elements().empty())
        metadata.refuse("storage transformers are not supported");

    const std::vector<Metadata> codecs = metadata.at("codecs").elements();
    if (codecs.size() == 1 && codecs[0].extension_name() == "sharding_indexed") {
        array.index = read_shards(codecs[0], file, array);
    } else {
        if (codecs.empty()) metadata.refuse("the codecs lack 'bytes'");
        read_codecs(codecs, array);
    }
    check_sizes(metadata, array, file);
    array.fill = read_fill(metadata, array.type);

    const Metadata keys = metadata.at("chunk_key_encoding");
    const std::string naming = keys.extension_name();
    if (naming != "default" && naming != "v2")
        metadata.refuse(fmt::format("the chunk key encoding {} is not supported", quoted(naming)));
    array.separator = std::string(naming == "default" ? "/" : ".");
    if (keys.has("configuration") && keys.at("configuration").has("separator"))
        array.separator = keys.at("configuration").at("separator").text();
    if (array.separator != "." && array.separator != "/")
        metadata.refuse("the separator of chunk keys is neither '.' nor '/'");
    if (naming == "default") array.prefix = fmt::format("c{}", array.separator);
    return array;
}

}  // namespace

bool is_zarr(const fs::path& folder) {
    std::error_code ignored;
    for (const char* name : {"zarr.json", ".zarray", ".zgroup"}) {
        if (fs::is_regular_file(folder / name, ignored)) return true;
    }
    return false;
}

ZarrArray read_zarr_array(const fs::path& folder) {
    std::error_code ignored;
    return fs::exists(folder / "zarr.json", ignored) ? read_version_3(folder) : read_version_2(folder);
}

}  // namespace marrow::internal::io
