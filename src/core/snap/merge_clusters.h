/// Where the surface passes close to a sample: the points that crowd round it become one, or keep away.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/marching_cubes/emit.h"
#include "slice.h"

namespace marrow::internal {

/// A sample whose points may become one.
struct Crowd {
    std::uint32_t word, bit;  ///< the sample's
    std::uint32_t points[3];  ///< by axis; where none is, `one`
    std::uint32_t one;        ///< the first of them in the sample's slice stands for all
    std::uint8_t sides[3];
    bool joins;
};

/// A word with samples that are crowded.
struct CrowdedWord {
    std::uint32_t word;
    std::int32_t first_x;  ///< of its first sample
    std::int64_t y;
    std::uint32_t first_crowd;
    std::uint64_t can;  ///< join
    std::uint64_t near[6];
};

/// Memory for the crowds of a slice, used again for the next.
struct Crowds {
    static constexpr std::size_t kSlack = 8;

    /// For a slice that has so many points together with the one before.
    void make_room(const EmitInput& input, std::size_t points);
    std::size_t bytes() const {
        return crowds.size() * (sizeof crowds[0] + 8 * sizeof(float)) + words.size() * sizeof words[0];
    }

    Buffer<Crowd> crowds;
    Buffer<CrowdedWord> words;
    /// By crowd: the points' offsets by axis, 0 where none is; 1 / how many there are; where they become one,
    /// from the sample, in edges; and how far the furthest has to go there.
    Buffer<float> offsets[3], part, middle[3], furthest;
    std::vector<std::uint64_t> no_words;  ///< a row without an active word
};

/// Joins the points that crowd round the samples of slice z, or moves them apart. By number, `one` receives
/// which point each becomes, which has its new place then, and `moved` how far each was moved, in edges. \pre
/// both slices are measured, and the one before is joined unless z is the first; the points stand for
/// themselves in `one`
void join_slice(const EmitInput& input, float limit, std::int64_t z, SnapSlice& before, SnapSlice& slice,
                Crowds& crowds, std::uint32_t* one, float* moved);

}  // namespace marrow::internal
