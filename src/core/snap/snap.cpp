// Snapping joins points after SnapMC (Raman and Wenger 2008), with two differences: the joined point lies
// amid the points that it is made of instead of at the sample, so that the surface stays where it is; and it
// is known beforehand, from the samples round each, that all joinings together leave a manifold of the same
// topology.
//
// Slices pass one after the other:
//
// 1. A slice's points are made, and measured: to which end of its edge each belongs, and whether it is near.
// 2. Points that crowd round one of its samples become one, or move away from the sample.
// 3. With that, what became of the points of the slice before is known. Those that are left receive their numbers
//    and places.
// 4. The triangles between that slice and the one before it are made; those that collapsed are left out.
//
// At the end, a point that lies nearly on the line between the two others of a triangle is moved aside. A
// slab of slices begins a little earlier and ends a little later than what it makes, so slabs go to threads.
#include "snap.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <numeric>
#include <vector>

#include "cap_triangles.h"
#include "base/parallel.h"
#include "base/resize_discarding.h"
#include "core/grid/shares.h"
#include "merge_clusters.h"
#include "slice.h"

namespace marrow::internal {

namespace {

// What becomes of slices [begin, end). Points and triangles are numbered from its own first point on.
class SnapSlab {
  public:
    SnapSlab(const EmitInput& input, float limit, bool normals, std::int64_t begin, std::int64_t end)
        : input_(input),
          limit_(limit),
          normals_wanted_(normals),
          begin_(begin),
          end_(end),
          first_(std::max<std::int64_t>(begin - 2, 0)),
          last_(std::min(end + 1, input.bits.nz - 1)),
          first_point_(first_output(input.points, first_)) {}

    // Calls step() after each slice.
    template <class Step>
    void run(const Step& step) {
        reserve();
        if (first_ == 0) slice(-1).clear(input_.bits, false);
        for (std::int64_t z = first_; z <= std::min(end_ + 1, input_.bits.nz); ++z) {
            if (z <= last_) {
                make(z);
                if (z > first_ || z == 0)
                    join_slice(input_, limit_, z, slice(z - 1), slice(z), crowds_, one(), moved());
            }
            if (z > begin_) number(z - 1);
            if (z > begin_ + 1) make_triangles(z - 2);
            if (z >= begin_ && z < end_) step();
        }
        points.resize(point_count_);
        normals.resize(normals_wanted_ ? point_count_ : 0);
        triangles.resize(triangle_count_);
    }

    // Of memory that the mesh has not taken over.
    std::size_t bytes() const {
        std::size_t bytes = crowds_.bytes() + one_.size() * (sizeof one_[0] + sizeof moved_[0]) +
                            points.capacity() * sizeof points[0] + normals.capacity() * sizeof normals[0] +
                            triangles.capacity() * sizeof triangles[0] +
                            layer_.size() * (sizeof layer_[0] + sizeof sources_[0]);
        for (const SnapSlice& s : slices_) bytes += s.bytes();
        return bytes;
    }

    // What was made.
    Buffer<Vec3f> points, normals;
    Buffer<Triangle> triangles;
    std::vector<FlatTriangle> flat;

  private:
    std::uint64_t first_output(const HistoPyramid& pyramid, std::int64_t z) const {
        return pyramid.first_output(input_.bits.row_index(0, std::min(z, input_.bits.nz)));
    }
    SnapSlice& slice(std::int64_t z) { return slices_[static_cast<std::size_t>(z + 3) % 3]; }

    // Makes room for what there would be without snapping; what is not used is never touched. The points of
    // the slice behind are there for the last triangles.
    void reserve() {
        const std::uint64_t most =
            first_output(input_.points, end_ + 1) - first_output(input_.points, begin_) + 1;
        resize_discarding(points, most);
        resize_discarding(normals, normals_wanted_ ? most : 0);
        resize_discarding(triangles, first_output(input_.triangles, end_) - first_output(input_.triangles, begin_));
    }

    // By the slab's unsnapped points, of the last three slices.
    std::uint32_t* one() { return one_.data() - window_; }
    float* moved() { return moved_.data() - window_; }

    // Makes room in these for points from `first` to `end`, of which those from `next` on are new.
    void move_window(std::uint32_t first, std::uint32_t next, std::uint32_t end) {
        if (end - window_ <= one_.size()) return;
        std::copy(one() + first, one() + next, one_.data());
        std::copy(moved() + first, moved() + next, moved_.data());
        window_ = first;
        if (end - window_ <= one_.size()) return;
        one_.resize(2 * (end - window_));
        moved_.resize(one_.size());
    }

    void make(std::int64_t z) {
        SnapSlice& s = slice(z);
        const std::uint64_t first = first_output(input_.points, z);
        s.start = static_cast<std::uint32_t>(first - first_point_);
        s.size = static_cast<std::uint32_t>(first_output(input_.points, z + 1) - first);
        s.clear(input_.bits, normals_wanted_);
        move_window(slice(z - 2).start, s.start, s.start + s.size);
        std::iota(one() + s.start, one() + s.start + s.size, s.start);
        std::fill_n(moved() + s.start, s.size, 0.0f);
        if (s.size == 0) return;
        emit_points(input_, input_.bits.row_index(0, z), input_.bits.row_index(0, z + 1),
                    s.points.data() - first, normals_wanted_ ? s.normals.data() - first : nullptr,
                    s.offsets.data() - first);
        measure_slice(input_, limit_, z, s);
    }

    // Gives the points that are left of a slice their numbers and places. No branch depends on the points: it
    // could not be foreseen.
    void number(std::int64_t z) {
        const SnapSlice& s = slice(z);
        std::uint32_t* const one = this->one();
        const std::uint32_t start = s.start, size = s.size;
        if (normals_wanted_) {
            std::uint32_t number = point_count_;
            for (std::uint32_t i = 0; i < size; ++i) {
                normals[number] = s.normals[i];
                number += one[start + i] == start + i;
            }
        }
        const Vec3f* const from = s.points.data();
        Vec3f* const to = points.data();
        std::uint32_t number = point_count_;
        for (std::uint32_t i = 0; i < size; ++i) {
            const std::uint32_t p = start + i, of = one[p], number_of_one = one[of];
            const std::uint32_t is_left = of == p, mask = is_left - 1;
            to[number] = from[i];
            one[p] = (number & ~mask) | (number_of_one & mask);
            number += is_left;
        }
        for (const auto& [p, of] : s.from_before) one[p] = one[of];
        if (z < end_) point_count_ = number;
    }

    // Of the cells between slices z and z + 1.
    void make_triangles(std::int64_t z) {
        const std::uint64_t first = first_output(input_.triangles, z),
                            count = first_output(input_.triangles, z + 1) - first;
        if (count == 0) return;
        layer_.resize(count);
        sources_.resize(count);
        emit_triangles(input_, input_.bits.row_index(0, z), input_.bits.row_index(0, z + 1),
                       layer_.data() - first);
        const std::uint32_t* const one = this->one() - first_point_;
        const Triangle* const layer = layer_.data();
        Triangle* const to = triangles.data() + triangle_count_;
        std::uint32_t* const sources = sources_.data();
        std::size_t left = 0;
        for (std::uint32_t t = 0; t < count; ++t) {
            const std::uint64_t a = one[layer[t][0]], b = one[layer[t][1]], c = one[layer[t][2]];
            const std::uint64_t ab = a | b << 32;
            std::memcpy(to[left].data(), &ab, sizeof ab);
            to[left][2] = static_cast<std::uint32_t>(c);
            sources[left] = t;
            left += static_cast<std::size_t>(a != b) & static_cast<std::size_t>(b != c) &
                    static_cast<std::size_t>(c != a);
        }
        flat_here_.clear();
        find_flat(points.data(), to, left, flat_here_);
        for (const std::uint32_t t : flat_here_) {
            FlatTriangle& triangle = flat.emplace_back();
            triangle.triangle = to[t];
            for (std::size_t c = 0; c < 3; ++c)
                triangle.moved[c] = moved()[layer[sources[t]][c] - first_point_];
        }
        triangle_count_ += left;
    }

    const EmitInput& input_;
    const float limit_;
    const bool normals_wanted_;
    const std::int64_t begin_, end_, first_, last_;  // first, last: slices that are looked at
    const std::uint64_t first_point_;                // of the first of them: points are counted from it
    std::array<SnapSlice, 3> slices_;
    Crowds crowds_;
    Buffer<std::uint32_t> one_;  // which point each becomes, later that one's number in the output
    Buffer<float> moved_;        // how far each was moved, in edges
    std::uint32_t window_ = 0;   // the point of which these two have the first
    std::uint32_t point_count_ = 0;
    std::uint64_t triangle_count_ = 0;
    Buffer<Triangle> layer_;
    Buffer<std::uint32_t> sources_;  // in the layer, of the triangles that are left
    std::vector<std::uint32_t> flat_here_;
};

std::vector<SnapSlab> make_slabs(const EmitInput& input, float limit, bool normals) {
    constexpr std::int64_t kFewest = 16;  // slices, of which four more are looked at
    const auto threads = static_cast<std::int64_t>(share_count() / kSharesPerThread);
    const std::int64_t nz = input.bits.nz, slabs = threads == 1 ? 1 : 4 * threads;
    const std::int64_t slices = std::max((nz + slabs - 1) / slabs, kFewest);
    std::vector<SnapSlab> result;
    for (std::int64_t z = 0; z < nz; z += slices)
        result.emplace_back(input, limit, normals, z, std::min(z + slices, nz));
    return result;
}

// Copies what the slabs made to where it goes. Returns their flat triangles.
std::vector<FlatTriangle> gather(const std::vector<SnapSlab>& slabs, bool normals, Mesh& mesh) {
    std::vector<FlatTriangle> flat;
    std::vector<std::uint64_t> first_point{0}, first_triangle{0};
    const auto shifted = [](Triangle triangle, std::uint64_t by) {
        for (std::uint32_t& p : triangle) p += static_cast<std::uint32_t>(by);
        return triangle;
    };
    for (const SnapSlab& slab : slabs) {
        for (const FlatTriangle& t : slab.flat)
            flat.push_back({shifted(t.triangle, first_point.back()), t.moved});
        first_point.push_back(first_point.back() + slab.points.size());
        first_triangle.push_back(first_triangle.back() + slab.triangles.size());
    }
    mesh.points.resize(first_point.back());
    mesh.normals.resize(normals ? first_point.back() : 0);
    mesh.triangles.resize(first_triangle.back());
    tbb::parallel_for(std::size_t{0}, slabs.size(), [&](std::size_t s) {
        const SnapSlab& slab = slabs[s];
        const auto point = static_cast<std::ptrdiff_t>(first_point[s]),
                   triangle = static_cast<std::ptrdiff_t>(first_triangle[s]);
        std::copy(slab.points.begin(), slab.points.end(), mesh.points.begin() + point);
        if (normals) std::copy(slab.normals.begin(), slab.normals.end(), mesh.normals.begin() + point);
        std::transform(slab.triangles.begin(), slab.triangles.end(), mesh.triangles.begin() + triangle,
                       [&](const Triangle& t) { return shifted(t, first_point[s]); });
    });
    return flat;
}

}  // namespace

std::size_t snap(const EmitInput& input, double limit, bool normals, const Progress& progress, Mesh& mesh) {
    std::vector<SnapSlab> slabs = make_slabs(input, static_cast<float>(limit), normals);
    const auto swap_with_mesh = [&](SnapSlab& slab) {
        slab.points.swap(mesh.points);
        slab.normals.swap(mesh.normals);
        slab.triangles.swap(mesh.triangles);
    };
    // The only one makes the mesh in its own memory.
    if (slabs.size() == 1) swap_with_mesh(slabs[0]);
    Stage stage(progress, 0, 1, static_cast<std::size_t>(input.bits.nz));
    tbb::parallel_for(std::size_t{0}, slabs.size(),
                      [&](std::size_t s) { slabs[s].run([&] { stage.step(); }); });
    if (slabs.size() == 1) {
        swap_with_mesh(slabs[0]);
        move_aside(input, limit, slabs[0].flat, mesh);
    } else {
        move_aside(input, limit, gather(slabs, normals, mesh), mesh);
    }
    report_progress(progress, 1);
    std::size_t bytes = 0;
    for (const SnapSlab& slab : slabs) bytes += slab.bytes();
    return bytes;
}

}  // namespace marrow::internal
