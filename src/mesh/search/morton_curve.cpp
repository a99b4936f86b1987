// Computes the Morton keys of triangles and sorts by them.
#include "morton_curve.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/parallel.h"
#include "base/radix_sort.h"

namespace marrow::internal {

namespace {

// A counting sort of triangles by the cells of their first corners.
class CellSort {
  public:
    explicit CellSort(const MeshView& mesh)
        : keys_(mesh.triangles.size()), triangles_(mesh.triangles.size()) {
        // About as many cells as triangles, so that small meshes take little time.
        while (axis_cells_ < kMostAxisCells && cells() < mesh.triangles.size()) axis_cells_ *= 2;
        set_keys(mesh);
        // Each thread counts and lists the triangles of some of the cells.
        const auto parts = static_cast<std::size_t>(thread_count());
        std::vector<std::uint32_t> count(parts + 1, 0);
        Buffer<std::uint32_t> ends(cells());
        const auto for_each_part = [&](const auto& f) {
            parallel_for(std::size_t{0}, parts, [&](std::size_t part) {
                f(part, static_cast<std::uint32_t>(cells() * part / parts),
                  static_cast<std::uint32_t>(cells() * (part + 1) / parts));
            });
        };
        for_each_part([&](std::size_t part, std::uint32_t begin, std::uint32_t end) {
            std::fill(ends.data() + begin, ends.data() + end, 0u);
            for (const std::uint32_t key : keys_) {
                if (key - begin < end - begin) ++ends[key];
            }
            for (std::uint32_t cell = begin; cell < end; ++cell) count[part + 1] += ends[cell];
        });
        std::partial_sum(count.begin(), count.end(), count.begin());
        for_each_part([&](std::size_t part, std::uint32_t begin, std::uint32_t end) {
            std::uint32_t sum = count[part];
            for (std::uint32_t cell = begin; cell < end; ++cell) {
                const std::uint32_t first = sum;
                sum += ends[cell];
                ends[cell] = first;
            }
            for (std::uint32_t t = 0; t < keys_.size(); ++t) {
                const std::uint32_t key = keys_[t];
                if (key - begin < end - begin) triangles_[ends[key]++] = t;
            }
        });
    }
    Buffer<std::uint32_t> take() { return std::move(triangles_); }

  private:
    static constexpr std::uint32_t kMostAxisCells = 64;

    std::size_t cells() const { return std::size_t{axis_cells_} * axis_cells_ * axis_cells_; }

    void set_keys(const MeshView& mesh) {
        const auto cells = static_cast<float>(axis_cells_);
        const CellKeys keys(bounds_of_triangles(mesh), cells, cells - 1);
        parallel_for_ranges(std::size_t{0}, keys_.size(), 4096, [&](const auto& range) {
            for (std::size_t t = range.begin(); t < range.end(); ++t)
                keys_[t] = keys.at(mesh.points[mesh.triangles[t][0]]);
        });
    }

    std::uint32_t axis_cells_ = 1;
    Buffer<std::uint32_t> keys_, triangles_;
};

}  // namespace

Buffer<MortonKey> along_morton_curve(const MeshView& mesh) {
    const CellKeys cells(bounds_of_triangles(mesh), 1023, 1023, 3);
    Buffer<MortonKey> keys(mesh.triangles.size());
    parallel_for(std::size_t{0}, keys.size(), [&](std::size_t i) {
        const Triangle& t = mesh.triangles[i];
        Vec3f sum;
        for (std::size_t axis = 0; axis < 3; ++axis)
            sum[axis] = mesh.points[t[0]][axis] + mesh.points[t[1]][axis] + mesh.points[t[2]][axis];
        keys[i] = {cells.at(sum), static_cast<std::uint32_t>(i)};
    });
    radix_sort(keys, 30, [](const MortonKey& k) { return k.key; });
    return keys;
}

Buffer<std::uint32_t> by_morton_cells(const MeshView& mesh) {
    return CellSort(mesh).take();
}

}  // namespace marrow::internal
