// Merges the surfaces of parts: points by their keys, and triangles by the cells that these keys tell.

#include <algorithm>
#include <array>
#include <functional>
#include <new>
#include <queue>
#include <string>
#include <utility>
#include <vector>

#include <marrow/parts.h>

#include "base/checked_size.h"
#include "base/parallel.h"
#include "core/volume/checks.h"
#include "part_passes.h"

namespace marrow {

using namespace internal;

namespace {

// The cell of a triangle, as (z * ny + y) * nx + x of its first corner. An edge of a cell starts at the
// cell's first corner or one further, and never all edges of a triangle one further along the same axis: they
// would lie in a face, and so would the triangle. A point inside a cell tells it alone.
template <std::uint64_t kKeysPerSample>
class Cells {
  public:
    explicit Cells(const std::array<std::int64_t, 3>& whole)
        : nx_(static_cast<std::uint64_t>(whole[0])), ny_(static_cast<std::uint64_t>(whole[1])) {}

    std::uint64_t of(const PartSurface& part, std::size_t triangle) const {
        std::array<std::uint64_t, 3> first = start(part.keys[part.mesh.triangles[triangle][0]]);
        for (std::size_t k = 1; k < 3; ++k) {
            const auto other = start(part.keys[part.mesh.triangles[triangle][k]]);
            for (std::size_t a = 0; a < 3; ++a) first[a] = std::min(first[a], other[a]);
        }
        return (first[2] * ny_ + first[1]) * nx_ + first[0];
    }

  private:
    // The sample at which an edge, or the cell around a point, starts.
    std::array<std::uint64_t, 3> start(std::uint64_t key) const {
        const std::uint64_t row = key / nx_ / kKeysPerSample;
        std::uint64_t x = key % nx_;
        if constexpr (kKeysPerSample > kEdges) {
            const std::uint64_t group = key / nx_ % kKeysPerSample;
            if (group >= kEdges) x = ((group - kEdges) * nx_ + x) / (kKeysPerSample - kEdges);
        }
        return {x, row % ny_, row / ny_};
    }

    static constexpr std::uint64_t kEdges = 3;

    const std::uint64_t nx_, ny_;
};

// Elements [begin, end) of a part's ascending sequence.
struct Range {
    std::size_t part, begin, end;
};

// Calls take(part, first, last) for the elements of all ranges in ascending order of their keys, in runs.
// Elements of equal keys follow each other, in the order of the parts. `key(part, i)` is ascending in i.
template <class Key, class Take>
void merge(const std::vector<Range>& ranges, const Key& key, const Take& take) {
    struct Next {
        std::uint64_t key;
        Range range;
        bool operator>(const Next& other) const {
            return key != other.key ? key > other.key : range.part > other.range.part;
        }
    };
    std::priority_queue<Next, std::vector<Next>, std::greater<>> queue;
    for (const Range& range : ranges)
        if (range.begin < range.end) queue.push({key(range.part, range.begin), range});
    while (!queue.empty()) {
        auto [first_key, range] = queue.top();
        queue.pop();
        std::size_t i = range.begin + 1;
        if (queue.empty()) {
            i = range.end;
        } else {
            while (i < range.end && key(range.part, i) < queue.top().key) ++i;
        }
        take(range.part, range.begin, i);
        range.begin = i;
        if (i < range.end) queue.push({key(range.part, i), range});
    }
}

// The first index in [0, count) whose key is at least `bound`.
template <class Key>
std::size_t lower_bound(std::size_t count, std::uint64_t bound, const Key& key) {
    std::size_t begin = 0;
    while (count > 0) {
        const std::size_t half = count / 2;
        if (key(begin + half) < bound) {
            begin += half + 1;
            count -= half + 1;
        } else {
            count = half;
        }
    }
    return begin;
}

// The ranges of all parts, divided into shares that threads merge independently. A share has the keys of some
// slices of the whole grid, which have `per_slice` keys each.
template <class Size, class Key>
std::vector<std::vector<Range>> divide(std::size_t parts, std::int64_t slices, std::uint64_t per_slice,
                                       const Size& size, const Key& key) {
    constexpr std::int64_t kMostShares = 64;
    const std::int64_t shares = std::min(slices, kMostShares);
    std::vector<std::vector<Range>> divided(static_cast<std::size_t>(shares));
    for (std::size_t p = 0; p < parts; ++p) {
        std::size_t begin = 0;
        for (std::int64_t s = 0; s < shares; ++s) {
            const auto bound = static_cast<std::uint64_t>(slices * (s + 1) / shares) * per_slice;
            const std::size_t end =
                begin + lower_bound(size(p) - begin, bound, [&](std::size_t i) { return key(p, begin + i); });
            if (begin < end) divided[static_cast<std::size_t>(s)].push_back({p, begin, end});
            begin = end;
        }
    }
    return divided;
}

template <class F>
void for_each_index(std::size_t count, const F& f) {
    parallel_for(std::size_t{0}, count, f);
}

// Replaces counts by the sums of those before, and returns the sum of all.
std::uint64_t sum_before(std::vector<std::uint64_t>& counts) {
    std::uint64_t sum = 0;
    for (std::uint64_t& count : counts) sum += std::exchange(count, sum);
    return sum;
}

std::uint64_t cells_of(const std::array<std::int64_t, 3>& samples) {
    std::uint64_t cells = 1;
    for (const std::int64_t n : samples) cells *= static_cast<std::uint64_t>(n - 1);
    return cells;
}

void check(std::span<const PartSurface> parts) {
    const auto has_normals = [](const PartSurface& part) { return !part.mesh.normals.empty(); };
    const PartSurface* first = nullptr;  // that has points, so that it shows whether there are normals
    std::uint64_t cells = 0;
    for (const PartSurface& part : parts) {
        if (part.extent.whole != parts.front().extent.whole)
            throw InputError(
                "the parts are of different volumes, or only some are closed; extract all parts of one "
                "volume alike");
        if (part.topology != parts.front().topology) throw_mixed_topology();
        cells += cells_of(part.extent.dims);
        const std::size_t points = part.mesh.points.size();
        if (part.keys.size() != points || (has_normals(part) && part.mesh.normals.size() != points))
            throw InputError("a part does not have one key for each point, and as many normals or none");
        if (points == 0) continue;
        if (first == nullptr) first = &part;
        if (has_normals(part) != has_normals(*first))
            throw InputError("some parts have normals, and some have none");
    }
    if (cells != cells_of(parts.front().extent.whole))
        throw InputError(
            "the parts do not have each cell of the volume once; cut it into parts that share no cells, and "
            "merge all of them");
}

class Merger {
  public:
    Merger(std::span<const PartSurface> parts, const Progress& progress)
        : parts_(parts), progress_(progress), whole_(parts.front().extent.whole), numbers_(parts.size()) {
        for (std::size_t p = 0; p < parts.size(); ++p) numbers_[p].resize(parts[p].keys.size());
    }

    Mesh merge_points_and_triangles() {
        merge_points();
        if (parts_.front().topology)
            merge_triangles(Cells<PartSurface::keys_per_sample(true)>(whole_));
        else
            merge_triangles(Cells<PartSurface::keys_per_sample(false)>(whole_));
        return std::move(mesh_);
    }

  private:
    void merge_points() {
        const auto key = [&](std::size_t p, std::size_t i) { return parts_[p].keys[i]; };
        const auto shares = divide(
            parts_.size(), whole_[2], parts_.front().keys_per_sample() * slice_samples(),
            [&](std::size_t p) { return parts_[p].keys.size(); }, key);
        // Calls emit(part, point, number in the share) for each point, and returns how many different ones
        // there are.
        const auto for_each_point = [&](const std::vector<Range>& share, const auto& emit) {
            std::uint64_t count = 0, last = ~std::uint64_t{0};
            merge(share, key, [&](std::size_t p, std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) {
                    if (count == 0 || parts_[p].keys[i] != last) ++count;
                    last = parts_[p].keys[i];
                    emit(p, i, count - 1);
                }
            });
            return count;
        };
        std::vector<std::uint64_t> first(shares.size());
        Stage counting(progress_, 0, 0.2, shares.size()), writing(progress_, 0.2, 0.6, shares.size());
        for_each_index(shares.size(), [&](std::size_t s) {
            first[s] = for_each_point(shares[s], [](auto...) {});
            counting.step();
        });
        const std::uint64_t points = sum_before(first);
        check_point_count(points);
        bool normals = false;
        for (const PartSurface& part : parts_) normals |= !part.mesh.normals.empty();
        mesh_.points.resize(checked_size(points, sizeof(Vec3f)));
        mesh_.normals.resize(normals ? mesh_.points.size() : 0);
        for_each_index(shares.size(), [&](std::size_t s) {
            for_each_point(shares[s], [&](std::size_t p, std::size_t i, std::uint64_t number) {
                number += first[s];
                numbers_[p][i] = static_cast<std::uint32_t>(number);
                const std::size_t point = numbers_[p][i];
                mesh_.points[point] = parts_[p].mesh.points[i];
                if (normals) mesh_.normals[point] = parts_[p].mesh.normals[i];
            });
            writing.step();
        });
    }

    void merge_triangles(const auto& cells) {
        const auto key = [&](std::size_t p, std::size_t i) { return cells.of(parts_[p], i); };
        const auto shares = divide(
            parts_.size(), whole_[2], slice_samples(),
            [&](std::size_t p) { return parts_[p].mesh.triangles.size(); }, key);
        std::vector<std::uint64_t> first(shares.size());
        for (std::size_t s = 0; s < shares.size(); ++s) {
            for (const Range& range : shares[s]) first[s] += range.end - range.begin;
        }
        mesh_.triangles.resize(checked_size(sum_before(first), sizeof(Triangle)));
        Stage stage(progress_, 0.6, 1, shares.size());
        for_each_index(shares.size(), [&](std::size_t s) {
            Triangle* out = mesh_.triangles.data() + first[s];
            std::uint64_t last_cell = ~std::uint64_t{0};
            std::size_t last_part = 0;
            merge(shares[s], key, [&](std::size_t p, std::size_t begin, std::size_t end) {
                if (last_part != p && last_cell == key(p, begin))
                    throw InputError(
                        "two parts have a common cell; cut the volume into parts that share no cells");
                for (std::size_t i = begin; i < end; ++i) {
                    const Triangle& t = parts_[p].mesh.triangles[i];
                    *out++ = {numbers_[p][t[0]], numbers_[p][t[1]], numbers_[p][t[2]]};
                }
                last_cell = key(p, end - 1);
                last_part = p;
            });
            stage.step();
        });
    }

    std::uint64_t slice_samples() const { return static_cast<std::uint64_t>(whole_[0] * whole_[1]); }

    const std::span<const PartSurface> parts_;
    const Progress& progress_;
    const std::array<std::int64_t, 3> whole_;
    std::vector<Buffer<std::uint32_t>> numbers_;  // of each part's points in the whole surface
    Mesh mesh_;
};

}  // namespace

Mesh merge_parts(std::span<const PartSurface> parts, const Progress& progress) {
    if (parts.empty()) return {};
    check(parts);
    try {
        return Merger(parts, progress).merge_points_and_triangles();
    } catch (const std::bad_alloc&) {
        throw LimitError("there is not enough memory to merge " + std::to_string(parts.size()) +
                         " parts; write them to a file in parts instead");
    }
}

}  // namespace marrow
