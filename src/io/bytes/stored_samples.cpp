// Converts samples as files store them to those of a Volume.
#include "stored_samples.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <type_traits>

#include <marrow/error.h>

#include "text.h"

namespace marrow::internal::io {

namespace {

template <class Word, class Swap>
void swap_words(void* data, std::size_t count, Swap&& swap) {
    auto* words = static_cast<Word*>(data);
    for (std::size_t i = 0; i < count; ++i) words[i] = swap(words[i]);
}

template <class S, class T>
void convert(const S* from, T* to, std::size_t count, const Rescale& rescale,
             const std::filesystem::path& path) {
    constexpr bool kMayRound = std::is_integral_v<S> && sizeof(S) == 8;
    for (std::size_t i = 0; i < count; ++i) {
        const auto value = static_cast<double>(from[i]);
        if constexpr (kMayRound) {
            if (std::abs(value) >= 9007199254740992.0) {  // 2^53
                fail<InputError>(path,
                                 "a 64-bit sample is beyond 2^53 and cannot be kept exactly; "
                                 "convert the file to a smaller type");
            }
        }
        to[i] = static_cast<T>(rescale.slope * value + rescale.intercept);
    }
}

}  // namespace

std::optional<StoredType> find_type(std::span<const TypeName> table, std::string_view name) {
    for (const auto& [names, type] : table) {
        for (std::size_t at = 0; at < names.size();) {
            const std::size_t end = std::min(names.find('|', at), names.size());
            if (names.substr(at, end - at) == name) return type;
            at = end + 1;
        }
    }
    return {};
}

void check_stated_geometry(const std::filesystem::path& path, const Geometry& geometry) {
    try {
        check_geometry(geometry);
    } catch (const InputError& error) {
        fail<GeometryError>(path, "{}", error.what());
    }
}

std::size_t stored_size(StoredType type) {
    return with_stored_type(type, [](auto v) { return sizeof v; });
}

void to_native_order(void* samples, std::size_t count, StoredType type, bool big_endian) {
    if (big_endian == (std::endian::native == std::endian::big)) return;
    const std::size_t size = stored_size(type);
    if (size == 2)
        swap_words<std::uint16_t>(samples, count, [](std::uint16_t w) { return __builtin_bswap16(w); });
    if (size == 4)
        swap_words<std::uint32_t>(samples, count, [](std::uint32_t w) { return __builtin_bswap32(w); });
    if (size == 8)
        swap_words<std::uint64_t>(samples, count, [](std::uint64_t w) { return __builtin_bswap64(w); });
}

bool can_be_kept(const Rescale& rescale) {
    const auto has_fraction = [](double number) { return number != std::floor(number); };
    return rescale.slope >= std::numeric_limits<float>::min() && std::isfinite(rescale.slope) &&
           std::isfinite(rescale.intercept) &&
           (has_fraction(rescale.slope) || has_fraction(rescale.intercept));
}

bool is_loaded_as_stored(StoredType type, const Rescale& rescale) {
    return rescale.is_identity() && type != StoredType::uint32 && type != StoredType::uint64 &&
           type != StoredType::int64;
}

SampleType loaded_type(StoredType type, const Rescale& rescale) {
    const bool exact_as_float = stored_size(type) <= 2 || type == StoredType::float32;
    if (!is_loaded_as_stored(type, rescale))
        return exact_as_float ? SampleType::float32 : SampleType::float64;
    return with_stored_type(type, []<class T>(T) {
        if constexpr (std::is_integral_v<T> && (sizeof(T) == 8 || std::is_same_v<T, std::uint32_t>))
            return SampleType::float64;  // never loaded as stored
        else
            return sample_type_of<T>();
    });
}

void load_samples(const void* from, void* to, std::size_t count, StoredType type, const Rescale& rescale,
                  const std::filesystem::path& path) {
    const bool narrow = loaded_type(type, rescale) == SampleType::float32;
    with_stored_type(type, [&]<class S>(S) {
        if (narrow)
            convert(static_cast<const S*>(from), static_cast<float*>(to), count, rescale, path);
        else
            convert(static_cast<const S*>(from), static_cast<double*>(to), count, rescale, path);
    });
}

}  // namespace marrow::internal::io
