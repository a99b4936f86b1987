// Compares only triangles of the same cell and of neighbouring cells.
//
// Without snapping, each triangle is in its cell. Snapping moves no point further than T < 1/2 of an edge
// along any axis of the grid, and a triangle is where its corners are. So it stays within T of its cell, and
// two triangles whose cells are not neighbours are at least 1 - 2 T > 0 apart. All this holds for indices,
// hence for any geometry.
#include "find_intersections.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "base/for_each_range.h"
#include "close_triangles.h"
#include "mesh/connectivity/one_rings.h"
#include "mesh/intersections/self_intersections.h"

namespace marrow::internal {

namespace {

// The most that coordinates of points in neighbouring cells can differ by.
double reach(const EmitInput& input) {
    double most = 0;
    for (const Vec3d& row : input.to_physical.exact)
        most = std::max(most, 3 * (std::abs(row[0]) + std::abs(row[1]) + std::abs(row[2])));
    return most;
}

// Whether rounding changes no coordinate so much that triangles could meet whose cells are not neighbours,
// and no product overflows or underflows.
bool neighbours_suffice(const EmitInput& input, double limit) {
    constexpr std::uint64_t kMostCells = std::uint64_t{1}
                                         << 26;  // whose triangles' corners have 32-bit indices
    constexpr double kError = 1e-6;              // of a coordinate, relative to the largest
    const IndexToPhysical& map = input.to_physical;
    const Mat3d to_index = inverse(map.exact);
    double furthest = 0, widest = 0;
    for (std::size_t r = 0; r < 3; ++r) {
        double coordinate = std::abs(map.origin[r]), index = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            const auto size = static_cast<double>(input.volume.geometry.dims[a]);
            coordinate +=
                std::abs(map.exact[r][a]) * (std::abs(static_cast<double>(map.first[a])) + size + 1);
            index += std::abs(to_index[r][a]);
        }
        furthest = std::max(furthest, coordinate);
        widest = std::max(widest, index);
    }
    const double gap = 1 - 2 * limit, length = reach(input);
    return 4 * kError * furthest * widest < gap && length > 1e-6 && length < 1e6 &&
           CellNumbers(input.bits).end(input.bits) < kMostCells;
}

// Lists the pairs of some layers that may pass through each other.
class CandidateFinder {
  public:
    CandidateFinder(const EmitInput& input, const SnapOutput& surface)
        : surface_(surface),
          cells_per_row_(CellNumbers(input.bits).per_row),
          most_apart_(static_cast<float>(reach(input))) {}

    // Adds the pairs whose first triangle is in layer z.
    void find_in(std::size_t z, std::vector<TrianglePair>& found) {
        const LayerTriangles &here = layer(z), &next = layer(z + 1);
        list_neighbours(here, next, cells_per_row_, pairs_[0], pairs_[1]);
        for (std::size_t step = 0; step < 2; ++step) {
            close_.clear();
            find_close_pairs(here, step == 0 ? here : next, pairs_[step], most_apart_, close_);
            for (const auto& [s, t] : close_) {
                const TrianglePair pair{first_triangle(z) + s, first_triangle(z + step) + t};
                if (may_pass_through(surface_.mesh, pair)) found.push_back(pair);
            }
        }
    }

  private:
    static constexpr std::size_t kNone = ~std::size_t{0};

    std::uint32_t first_triangle(std::size_t z) const {
        return static_cast<std::uint32_t>(surface_.starts[std::min(z, surface_.slices())].triangle);
    }
    const LayerTriangles& layer(std::size_t z) {
        LayerTriangles& packed = layers_[z % 2];
        if (packed_[z % 2] != z) pack_layer(surface_, first_triangle(z), first_triangle(z + 1), packed);
        packed_[z % 2] = z;
        return packed;
    }

    const SnapOutput& surface_;
    const std::uint64_t cells_per_row_;
    const float most_apart_;
    LayerTriangles layers_[2];
    std::size_t packed_[2] = {kNone, kNone};
    LayerPairs pairs_[2];  // with triangles of the same layer and of the next
    std::vector<TrianglePair> close_;
};

// Adds the triangles in the cell of a triangle and in its neighbours. They include all that share a point
// with it: these are in the cells around the edge of each of its points, or around the sample of its cluster.
void add_around(const SnapOutput& surface, std::uint64_t cells_per_row, std::uint32_t triangle,
                Buffer<std::uint32_t>& triangles) {
    const auto& starts = surface.starts;
    const auto after = std::upper_bound(starts.begin(), starts.end(), triangle,
                                        [](std::uint32_t t, const SliceStart& s) { return t < s.triangle; });
    const auto z = static_cast<std::size_t>(after - starts.begin()) - 1;
    const std::uint64_t cell = surface.cells[triangle];
    for (std::size_t k = z > 0 ? z - 1 : 0; k < std::min(z + 2, surface.slices()); ++k) {
        const auto at = [&](std::uint64_t t) {
            return surface.cells.begin() + static_cast<std::ptrdiff_t>(t);
        };
        const auto begin = at(starts[k].triangle), end = at(starts[k + 1].triangle);
        for (std::uint64_t row = cell - cells_per_row; row <= cell + cells_per_row; row += cells_per_row) {
            for (auto t = std::lower_bound(begin, end, row - 1); t < end && *t <= row + 1; ++t)
                triangles.push_back(static_cast<std::uint32_t>(t - surface.cells.begin()));
        }
    }
}

}  // namespace

std::vector<TrianglePair> find_intersections(const EmitInput& input, double limit, const SnapOutput& surface,
                                             const std::vector<std::uint8_t>& layers,
                                             const Progress& progress, double begin, double end) {
    const Mesh& mesh = surface.mesh;
    if (!neighbours_suffice(input, limit))
        return find_self_intersections(mesh, OneRings(mesh), progress, begin, end);
    std::mutex mutex;
    std::vector<TrianglePair> candidates;
    PerThread<CandidateFinder> finders([&] { return CandidateFinder(input, surface); });
    for_each_range(surface.slices(), 8, progress, begin, end, [&](std::size_t first, std::size_t last) {
        CandidateFinder& finder = finders.local();
        std::vector<TrianglePair> found;
        for (std::size_t z = first; z < last; ++z) {
            const bool next_is_wanted = z + 1 < layers.size() && layers[z + 1] != 0;
            if (layers[z] != 0 || next_is_wanted) finder.find_in(z, found);
        }
        const std::lock_guard lock(mutex);
        candidates.insert(candidates.end(), found.begin(), found.end());
    });
    if (candidates.empty()) return {};
    Buffer<std::uint32_t> around;
    for (const TrianglePair& pair : candidates) {
        for (const std::uint32_t t : pair) add_around(surface, CellNumbers(input.bits).per_row, t, around);
    }
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    return find_self_intersections_among(mesh, around, progress, end, end);
}

}  // namespace marrow::internal
