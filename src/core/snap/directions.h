/// The six directions along the axes of the grid, and sets of samples by direction, 64 samples to a word.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace marrow::internal {

/// The directions of the edges from a sample. A direction is twice its axis, plus 1 if it is negative.
///
///            +y = 2
///               |    +z = 4
///               |   /
///               |  /
///               | /
///  -x = 1 ------o------ +x = 0
///             / |
///            /  |
///           /   |
///      -z = 5   |
///            -y = 3
///
/// An edge starts at its lower end, and its data are stored with that sample. So the data of the edges in
/// positive directions are at the sample itself, and those of the others at a neighbour:
///
///   -x   one bit lower; for bit 0, at bit 63 of the word before
///   -y   at the same bit in the row before
///   -z   at the same bit in the slice before
enum Direction : std::uint32_t { kPlusX, kMinusX, kPlusY, kMinusY, kPlusZ, kMinusZ };
inline constexpr std::uint32_t kDirections = 6;

constexpr std::uint32_t axis_of(std::uint32_t direction) {
    return direction / 2;
}
constexpr bool is_negative(std::uint32_t direction) {
    return direction % 2 == 1;
}
constexpr std::uint32_t opposite(std::uint32_t direction) {
    return direction ^ 1;
}

/// A bit for each of 64 samples along x, in each direction:
///
///          bit 63  ...  3 2 1 0
///   [+x]        .  ...  . . 1 .
///   [-x]        .  ...  . . . .
///   [+y]        .  ...  . . 1 .      sample 1 has a point in the directions +x, +y and -z,
///   [-y]        .  ...  1 . . .      sample 3 has one in the direction -y
///   [+z]        .  ...  . . . .
///   [-z]        .  ...  . . 1 .
using DirectionBits = std::array<std::uint64_t, kDirections>;

/// The samples that have a bit in any direction.
inline std::uint64_t any(const DirectionBits& bits) {
    return (bits[0] | bits[1]) | (bits[2] | bits[3]) | (bits[4] | bits[5]);
}

/// The samples that have bits in two or more directions.
inline std::uint64_t two_or_more(const DirectionBits& bits) {
    std::uint64_t one = 0, two = 0;
    for (const std::uint64_t b : bits) {
        two |= one & b;
        one |= b;
    }
    return two;
}

/// For each sample, the bit of the sample before it along x.
inline std::uint64_t shift_x(std::uint64_t bits, std::uint64_t word_before) {
    return bits << 1 | word_before >> 63;
}

constexpr std::uint64_t bit_at(std::uint32_t bit) {
    return std::uint64_t{1} << bit;
}

/// The number of bits below `bit`.
inline std::uint32_t count_below(std::uint64_t bits, std::uint32_t bit) {
    return static_cast<std::uint32_t>(std::popcount(bits & (bit_at(bit) - 1)));
}

/// Calls f(bit) for each bit that is set, in ascending order.
template <class F>
void for_each_bit(std::uint64_t bits, const F& f) {
    for (; bits != 0; bits &= bits - 1) f(static_cast<std::uint32_t>(std::countr_zero(bits)));
}

}  // namespace marrow::internal
