/// Notices samples that change between two readings: what the first one counted is then wrong for the second.
#pragma once

#include <cstdint>
#include <span>

#include <marrow/error.h>

namespace marrow::internal {

/// The hash of a sequence with one number more. It is the same on every machine.
inline std::uint64_t add_to_hash(std::uint64_t hash, std::uint64_t number) {
    hash = (hash ^ number) * 0x9e3779b97f4a7c15;  // 2^64 over the golden ratio
    return hash ^ hash >> 32;
}

inline std::uint64_t hash_of(std::span<const std::uint64_t> numbers) {
    std::uint64_t hash = 0;
    for (const std::uint64_t number : numbers) hash = add_to_hash(hash, number);
    return hash;
}

/// \throw InputError always
[[noreturn]] inline void throw_samples_changed() {
    throw InputError(
        "the samples changed between the two readings; extract the surface when nothing writes to them");
}

}  // namespace marrow::internal
