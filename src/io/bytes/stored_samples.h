/// Samples as files store them: their types, byte order and scale.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>

#include <marrow/volume.h>

namespace marrow::internal::io {

/// The sample types of files. A Volume lacks some of them; those become float64, or an error if that is not
/// exact.
enum class StoredType { uint8, int8, uint16, int16, uint32, int32, uint64, int64, float32, float64 };

/// What a header calls a sample type; several names are separated by "|".
struct TypeName {
    std::string_view names;
    StoredType type;
};

/// The type with this name, if the table has it.
std::optional<StoredType> find_type(std::span<const TypeName> table, std::string_view name);

/// Calls `f` with a value of the C++ type of `type`.
template <class F>
auto with_stored_type(StoredType type, F&& f) {
    switch (type) {
        case StoredType::uint8:
            return f(std::uint8_t{});
        case StoredType::int8:
            return f(std::int8_t{});
        case StoredType::uint16:
            return f(std::uint16_t{});
        case StoredType::int16:
            return f(std::int16_t{});
        case StoredType::uint32:
            return f(std::uint32_t{});
        case StoredType::int32:
            return f(std::int32_t{});
        case StoredType::uint64:
            return f(std::uint64_t{});
        case StoredType::int64:
            return f(std::int64_t{});
        case StoredType::float32:
            return f(float{});
        default:
            return f(double{});
    }
}

/// Checks a geometry that a file states. \throw GeometryError what check_geometry() refuses, with the file
void check_stated_geometry(const std::filesystem::path& path, const Geometry& geometry);

/// Bytes of a sample.
std::size_t stored_size(StoredType type);

/// Reverses the bytes of each sample unless they are in this machine's order.
void to_native_order(void* samples, std::size_t count, StoredType type, bool big_endian);

/// Whether a Volume can keep stored samples and rescale them itself: their values have a fraction, and are in
/// the order of the samples.
bool can_be_kept(const Rescale& rescale);

/// The type of the samples in memory: as stored, or float32 if they are rescaled. It is float64 if float32
/// would not be exact, and for types that a Volume lacks.
SampleType loaded_type(StoredType type, const Rescale& rescale);

/// Whether samples in memory are the stored ones, in native order.
bool is_loaded_as_stored(StoredType type, const Rescale& rescale);

/// Converts samples in native order to loaded_type(). `path` names the file in errors.
/// \throw InputError a 64-bit sample is not exact as float64
void load_samples(const void* from, void* to, std::size_t count, StoredType type, const Rescale& rescale,
                  const std::filesystem::path& path);

}  // namespace marrow::internal::io
