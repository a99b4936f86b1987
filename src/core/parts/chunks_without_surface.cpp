// Finds the chunks of samples whose values the surface of a part does not depend on.
#include <algorithm>
#include <array>
#include <new>
#include <optional>

#include <marrow/error.h>
#include <marrow/parts.h>

#include "base/parallel.h"
#include "core/marching_cubes/classify.h"
#include "core/marching_cubes/inside_bits.h"
#include "core/volume/checks.h"
#include "core/volume/enlarged.h"
#include "part_passes.h"

namespace marrow {

using namespace internal;

namespace {

// An edge that the surface crosses reads the samples at its ends, and gradients one more around these. So a
// sample is read only if there is another one on the other side of the surface within this distance. The same
// holds for a point inside a cell, which reads gradients at all corners: one of them is on the other side.
constexpr std::int64_t kReach = 2;

// The chunks along an axis that a view overlaps.
class Chunks {
  public:
    Chunks(std::int64_t first, std::int64_t samples, std::int64_t chunk)
        : first_(first), samples_(samples), chunk_(std::min(chunk, kMost)), begin_(first / chunk_) {}

    std::int64_t count() const { return (first_ + samples_ - 1) / chunk_ + 1 - begin_; }
    // The samples of the view, counted in it, that decide about chunk c.
    std::int64_t begin(std::int64_t c) const {
        return std::max<std::int64_t>((begin_ + c) * chunk_ - kReach - first_, 0);
    }
    std::int64_t end(std::int64_t c) const {
        return std::min((begin_ + c + 1) * chunk_ + kReach - first_, samples_);
    }
    // Whether they would also lie beyond the whole volume.
    bool touches_border(std::int64_t c, std::int64_t whole) const {
        return (begin_ + c) * chunk_ < kReach || (begin_ + c + 1) * chunk_ + kReach > whole;
    }

  private:
    static constexpr std::int64_t kMost = std::int64_t{1} << 40;  // more samples than any axis has

    const std::int64_t first_, samples_, chunk_, begin_;
};

// The value that all bits from `begin` to `end` have in all rows of a box, if they are equal. `any` and `all`
// are the disjunction and the conjunction of the rows' words.
std::optional<bool> common_value(const std::vector<std::uint64_t>& any, const std::vector<std::uint64_t>& all,
                                 std::int64_t begin, std::int64_t end) {
    bool some = false, every = true;
    for (std::int64_t bit = begin; bit < end;) {
        const std::int64_t stop = std::min((bit / 64 + 1) * 64, end);
        const std::uint64_t mask = ~std::uint64_t{0} >> (64 - (stop - bit)) << (bit % 64);
        const auto word = static_cast<std::size_t>(bit / 64);
        some |= (any[word] & mask) != 0;
        every &= (all[word] & mask) == mask;
        bit = stop;
    }
    return some == every ? std::optional(some) : std::nullopt;
}

}  // namespace

std::vector<std::uint8_t> chunks_without_surface(const VolumeView& part,
                                                 const std::array<std::int64_t, 3>& whole,
                                                 const std::array<std::int64_t, 3>& chunk, double isovalue,
                                                 const IsosurfaceOptions& given_options) {
    IsosurfaceOptions options = given_options;
    options.normals = false;  // the samples around the part are taken if they are there
    extent_of(part, whole, options);
    const double sample_isovalue = checked_isovalue(isovalue, part.rescale);
    if (*std::min_element(chunk.begin(), chunk.end()) < 1)
        throw InputError("a chunk has at least one sample along each axis");
    std::array<std::int64_t, 3> before{}, after{};
    for (std::size_t a = 0; a < 3; ++a) {
        before[a] = std::min<std::int64_t>(part.below[a], 1);
        after[a] = std::min<std::int64_t>(part.above[a], 1);
    }
    const VolumeView view = enlarged(part, before, after);
    const auto& dims = view.geometry.dims;
    const Chunks along_x(view.first[0], dims[0], chunk[0]), along_y(view.first[1], dims[1], chunk[1]),
        along_z(view.first[2], dims[2], chunk[2]);
    const std::int64_t nx = along_x.count(), ny = along_y.count();
    try {
        std::vector<std::uint8_t> result(static_cast<std::size_t>(nx * ny * along_z.count()));
        with_threads(options.threads, [&] {
            InsideBits bits(dims, ClosedSides{});
            Stage stage(options.progress, 0, 1, static_cast<std::size_t>(bits.nz + ny * along_z.count()));
            parallel_for(std::int64_t{0}, bits.nz, [&](std::int64_t z) {
                classify_slice(view, sample_isovalue, z, bits, nullptr);
                stage.step();
            });
            parallel_for(std::int64_t{0}, ny * along_z.count(), [&](std::int64_t column) {
                const std::int64_t cy = column % ny, cz = column / ny;
                std::vector<std::uint64_t> any(bits.words_per_row, 0),
                    all(bits.words_per_row, ~std::uint64_t{0});
                for (std::int64_t z = along_z.begin(cz); z < along_z.end(cz); ++z) {
                    for (std::int64_t y = along_y.begin(cy); y < along_y.end(cy); ++y) {
                        const std::uint64_t* const row = bits.row(bits.row_index(y, z));
                        for (std::size_t w = 0; w < bits.words_per_row; ++w)
                            any[w] |= row[w], all[w] &= row[w];
                    }
                }
                for (std::int64_t cx = 0; cx < nx; ++cx) {
                    const std::optional<bool> inside =
                        common_value(any, all, along_x.begin(cx), along_x.end(cx));
                    const bool is_closed = options.closed && (along_x.touches_border(cx, whole[0]) ||
                                                              along_y.touches_border(cy, whole[1]) ||
                                                              along_z.touches_border(cz, whole[2]));
                    result[static_cast<std::size_t>(column * nx + cx)] = inside && !(*inside && is_closed);
                }
                stage.step();
            });
        });
        return result;
    } catch (const std::bad_alloc&) {
        throw_out_of_memory(part.geometry);
    }
}

}  // namespace marrow
