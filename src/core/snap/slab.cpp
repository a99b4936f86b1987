// Snaps a slab slice by slice. Only three slices are in memory at a time.
#include "slab.h"

#include <algorithm>
#include <cstring>
#include <numeric>

#include "base/checked_size.h"
#include "base/resize_discarding.h"
#include "measure_slice.h"

namespace marrow::internal {

void PointWindow::append(std::uint32_t first, std::uint32_t next, std::uint32_t end) {
    if (end - begin_ > representatives_.size()) {
        std::copy(representatives() + first, representatives() + next, representatives_.data());
        std::copy(moved() + first, moved() + next, moved_.data());
        begin_ = first;
        if (end - begin_ > representatives_.size()) {
            representatives_.resize(2 * (end - begin_));
            moved_.resize(representatives_.size());
        }
    }
    std::iota(representatives() + next, representatives() + end, next);
    std::fill(moved() + next, moved() + end, 0.0f);
}

SnapSlab::SnapSlab(const EmitInput& input, const SnapExceptions& exceptions, float limit, bool normals,
                   std::int64_t begin, std::int64_t end)
    : input_(input),
      exceptions_(exceptions),
      limit_(limit),
      normals_wanted_(normals),
      begin_(begin),
      end_(end),
      first_(std::max<std::int64_t>(begin - 2, 0)),
      last_(std::min(end + 1, input.bits.nz - 1)),
      first_point_(first_output(input.points, first_)) {}

void SnapSlab::run(Stage& stage) {
    reserve();
    if (first_ == 0) slice(-1).clear(input_.bits, false);
    for (std::int64_t z = first_; z <= std::min(end_ + 1, input_.bits.nz); ++z) {
        if (z <= last_) {
            make_points(z);
            if (z > first_ || z == 0) merge_slice(z);
        }
        // No later slice changes the points of slice z - 1.
        if (z > begin_) number_points(z - 1);
        if (z > begin_ + 1) make_triangles(z - 2);
        if (z >= begin_ && z < end_) stage.step();
    }
    points.resize(point_count_);
    normals.resize(normals_wanted_ ? point_count_ : 0);
    triangles.resize(checked_size(triangle_count_, sizeof(Triangle)));
}

std::size_t SnapSlab::bytes() const {
    std::size_t bytes = clusters_.bytes() + window_.bytes() + points.capacity() * sizeof points[0] +
                        normals.capacity() * sizeof normals[0] + triangles.capacity() * sizeof triangles[0] +
                        layer_.size() * (sizeof layer_[0] + sizeof layer_indices_[0]);
    for (const SnapSlice& s : slices_) bytes += s.bytes();
    return bytes;
}

std::uint64_t SnapSlab::first_output(const HistoPyramid& pyramid, std::int64_t z) const {
    return pyramid.first_output(input_.bits.row_index(0, std::min(z, input_.bits.nz)));
}

// Makes room for as much output as there would be without snapping. Memory that is not needed is never
// touched. The last triangles also use points of slice `end`.
void SnapSlab::reserve() {
    const std::uint64_t most_points =
        first_output(input_.points, end_ + 1) - first_output(input_.points, begin_) + 1;
    resize_discarding(points, most_points);
    resize_discarding(normals, normals_wanted_ ? most_points : 0);
    resize_discarding(triangles,
                      first_output(input_.triangles, end_) - first_output(input_.triangles, begin_));
}

void SnapSlab::make_points(std::int64_t z) {
    SnapSlice& s = slice(z);
    const std::uint64_t first = first_output(input_.points, z);
    s.first_point = static_cast<std::uint32_t>(first - first_point_);
    s.point_count = static_cast<std::uint32_t>(first_output(input_.points, z + 1) - first);
    s.clear(input_.bits, normals_wanted_);
    window_.append(slice(z - 2).first_point, s.first_point, s.first_point + s.point_count);
    if (s.point_count == 0) return;
    emit_points(input_, input_.bits.row_index(0, z), input_.bits.row_index(0, z + 1), s.points.data() - first,
                normals_wanted_ ? s.normals.data() - first : nullptr, s.offsets.data() - first);
    measure_slice(input_, limit_, z, s);
}

void SnapSlab::merge_slice(std::int64_t z) {
    merge_clusters({input_, exceptions_, limit_, z, slice(z - 1), slice(z), clusters_,
                    window_.representatives(), window_.moved()});
}

// Writes the remaining points of a slice to the output, and replaces representatives by their indices there.
// A branch for each point would be unpredictable. Instead each is written, and overwritten if it merged.
void SnapSlab::number_points(std::int64_t z) {
    const SnapSlice& s = slice(z);
    std::uint32_t* const representatives = window_.representatives();
    const std::uint32_t first = s.first_point, count = s.point_count;
    if (normals_wanted_) {
        std::uint32_t index = point_count_;
        for (std::uint32_t i = 0; i < count; ++i) {
            normals[index] = s.normals[i];
            index += representatives[first + i] == first + i;
        }
    }
    const Vec3f* const from = s.points.data();
    Vec3f* const to = points.data();
    std::uint32_t index = point_count_;
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t p = first + i, representative = representatives[p],
                            representative_index = representatives[representative];
        const std::uint32_t remains = representative == p, mask = remains - 1;
        to[index] = from[i];
        representatives[p] = (index & ~mask) | (representative_index & mask);
        index += remains;
    }
    for (const auto& [point, representative] : s.merged_before)
        representatives[point] = representatives[representative];
    if (z < end_) point_count_ = index;
}

// Makes the triangles of the cells between slices z and z + 1.
void SnapSlab::make_triangles(std::int64_t z) {
    const std::uint64_t first = first_output(input_.triangles, z),
                        count = first_output(input_.triangles, z + 1) - first;
    if (count == 0) return;
    layer_.resize(checked_size(count, sizeof(Triangle)));
    layer_indices_.resize(layer_.size());
    emit_triangles(input_, input_.bits.row_index(0, z), input_.bits.row_index(0, z + 1),
                   layer_.data() - first);
    Triangle* const made = triangles.data() + triangle_count_;
    const std::size_t remaining = renumber_layer(made);
    list_caps(made, remaining);
    triangle_count_ += remaining;
}

// Writes the triangles of the layer that did not collapse, with the indices of their points in the output.
// Returns how many there are.
std::size_t SnapSlab::renumber_layer(Triangle* to) {
    const std::uint32_t* const indices = window_.representatives() - first_point_;
    const Triangle* const layer = layer_.data();
    std::uint32_t* const layer_indices = layer_indices_.data();
    const auto count = static_cast<std::uint32_t>(layer_.size());
    std::size_t written = 0;
    for (std::uint32_t t = 0; t < count; ++t) {
        const std::uint64_t a = indices[layer[t][0]], b = indices[layer[t][1]], c = indices[layer[t][2]];
        const std::uint64_t ab = a | b << 32;
        std::memcpy(to[written].data(), &ab, sizeof ab);
        to[written][2] = static_cast<std::uint32_t>(c);
        layer_indices[written] = t;
        written += static_cast<std::size_t>(a != b) & static_cast<std::size_t>(b != c) &
                   static_cast<std::size_t>(c != a);
    }
    return written;
}

void SnapSlab::list_caps(const Triangle* made, std::size_t count) {
    cap_indices_.clear();
    find_caps(points.data(), made, count, cap_indices_);
    for (const std::uint32_t t : cap_indices_) {
        CapTriangle& cap = caps.emplace_back();
        cap.triangle = made[t];
        const Triangle& unsnapped = layer_[layer_indices_[t]];
        for (std::size_t c = 0; c < 3; ++c) cap.moved[c] = window_.moved()[unsnapped[c] - first_point_];
    }
}

}  // namespace marrow::internal
