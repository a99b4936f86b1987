// Extracts the surface of a part, and reads the key of each point off the inside bits.
#include <hwy/highway.h>

#include <array>
#include <bit>
#include <new>

#include <marrow/error.h>
#include <marrow/parts.h>

#include "base/parallel.h"
#include "core/marching_cubes/row_bits-inl.h"
#include "core/volume/checks.h"
#include "part_passes.h"

namespace marrow {

using namespace internal;

namespace {

using namespace internal::HWY_NAMESPACE;

// Writes the keys of the points of a row of the part's grid. `inner` has not passed the row yet.
void write_keys(const PartPasses& passes, const PartExtent& extent, std::size_t r, AmbiguousRows& inner,
                std::uint64_t* keys) {
    const InsideBits& bits = passes.bits();
    const GridRow at(bits, r);
    const RowBits row(bits, at);
    const auto nx = static_cast<std::uint64_t>(extent.whole[0]);
    const std::int64_t whole_row = (extent.first[2] + at.z) * extent.whole[1] + extent.first[1] + at.y;
    const std::uint64_t row_key = static_cast<std::uint64_t>(whole_row) *
                                  PartSurface::keys_per_sample(passes.ambiguous() != nullptr) * nx;
    // Before the samples there are bits of a closed surface, of which the last is the grid's first sample.
    const std::int64_t first_bit = bits.first_x == 0 ? 0 : bits.first_x - 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::uint64_t first_key = row_key + axis * nx + static_cast<std::uint64_t>(extent.first[0]);
        for_each_active_word(passes.active(), r, [&](std::size_t w) {
            const std::uint64_t crossed = axis == 0   ? row.crossed_x(kRow, w)
                                          : axis == 1 ? row.crossed_y(w)
                                                      : row.crossed_z(w);
            const std::int64_t x = 64 * static_cast<std::int64_t>(w) - first_bit;
            for (std::uint64_t left = crossed; left != 0; left &= left - 1)
                *keys++ = first_key + static_cast<std::uint64_t>(x + std::countr_zero(left));
        });
    }
    if (!inner.reach(r)) return;
    static_assert(PartSurface::keys_per_sample(true) == 3 + CellTopology::kTunnelPoints);
    for (const AmbiguousCell& cell : inner.cells()) {
        const std::int64_t x = cell.x - first_bit + extent.first[0];
        for (std::uint64_t i = 0; i < cell.topology.inner_points; ++i)
            *keys++ = row_key + 3 * nx + CellTopology::kTunnelPoints * static_cast<std::uint64_t>(x) + i;
    }
}

Buffer<std::uint64_t> keys_of(const PartPasses& passes, const PartExtent& extent, std::size_t count) {
    Buffer<std::uint64_t> keys(count);
    const HistoPyramid points(passes.rows().points);
    const InsideBits& bits = passes.bits();
    parallel_for(std::int64_t{0}, bits.nz, [&](std::int64_t z) {
        std::uint64_t first = points.first_output(bits.row_index(0, z));
        AmbiguousRows inner(passes.ambiguous(), bits.row_index(0, z));
        for (std::size_t r = bits.row_index(0, z); r < bits.row_index(0, z + 1); ++r) {
            if (points.leaves()[r] != 0) write_keys(passes, extent, r, inner, keys.data() + first);
            first += points.leaves()[r];
        }
    });
    return keys;
}

}  // namespace

std::uint64_t PartSurface::key_count() const {
    std::uint64_t count = keys_per_sample();
    for (const std::int64_t n : extent.whole) {
        if (__builtin_mul_overflow(count, static_cast<std::uint64_t>(n), &count))
            throw LimitError(
                "the volume has more edges and cells than 64 bits can number; crop or coarsen it");
    }
    return count;
}

PartSurface extract_part(const VolumeView& part, const std::array<std::int64_t, 3>& whole, double isovalue,
                         const IsosurfaceOptions& options) {
    PartSurface surface{extent_of(part, whole, options), {}, {}, options.topology};
    const double sample_isovalue = checked_isovalue(isovalue, part.rescale);
    surface.key_count();  // throws if it does not fit in 64 bits
    if (!has_cells(surface.extent)) return surface;
    try {
        with_threads(options.threads, [&] {
            const PartPasses passes(part, surface.extent, sample_isovalue, options);
            surface.mesh = passes.emit();
            surface.keys = keys_of(passes, surface.extent, surface.mesh.points.size());
        });
    } catch (const std::bad_alloc&) {
        throw_out_of_memory(part.geometry);
    }
    return surface;
}

}  // namespace marrow
