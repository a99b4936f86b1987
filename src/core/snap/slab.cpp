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
        std::copy(edge_x() + first, edge_x() + next, edge_x_.data());
        begin_ = first;
        if (end - begin_ > representatives_.size()) {
            representatives_.resize(2 * (end - begin_));
            moved_.resize(representatives_.size());
            edge_x_.resize(representatives_.size() + kListSlack);
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
      cell_numbers_(input.bits),
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
    output.starts.back() = {point_count_, triangle_count_, output.caps.size()};
    // No cells start at the samples of the last slice.
    if (end_ == input_.bits.nz) {
        SliceStart& last = output.starts[output.slices() - 1];
        last.triangle = triangle_count_;
        last.cap = output.caps.size();
    }
    output.mesh.points.resize(point_count_);
    output.mesh.normals.resize(normals_wanted_ ? point_count_ : 0);
    output.mesh.triangles.resize(checked_size(triangle_count_, sizeof(Triangle)));
    output.cells.resize(output.mesh.triangles.size());
}

std::size_t SnapSlab::bytes() const {
    std::size_t bytes = clusters_.bytes() + window_.bytes() + output.bytes() +
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
    resize_discarding(output.mesh.points, most_points);
    resize_discarding(output.mesh.normals, normals_wanted_ ? most_points : 0);
    resize_discarding(output.mesh.triangles,
                      first_output(input_.triangles, end_) - first_output(input_.triangles, begin_));
    resize_discarding(output.cells, output.mesh.triangles.size());
    output.starts.resize(static_cast<std::size_t>(end_ - begin_) + 1);
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
    measure_slice(input_, limit_, z, s, window_.edge_x() + s.first_point);
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
    auto& [points, normals, triangles] = output.mesh;
    if (z < end_) output.starts[static_cast<std::size_t>(z - begin_)].point = point_count_;
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
    SliceStart& start = output.starts[static_cast<std::size_t>(z - begin_)];
    start.triangle = triangle_count_;
    start.cap = output.caps.size();
    const std::uint64_t first = first_output(input_.triangles, z),
                        count = first_output(input_.triangles, z + 1) - first;
    if (count == 0) return;
    layer_.resize(checked_size(count, sizeof(Triangle)));
    layer_indices_.resize(layer_.size());
    emit_triangles(input_, input_.bits.row_index(0, z), input_.bits.row_index(0, z + 1),
                   layer_.data() - first);
    const std::size_t remaining = renumber_layer(z);
    list_caps(remaining);
    triangle_count_ += remaining;
}

// Writes the triangles of the layer that did not collapse, with the indices of their points in the output,
// and the numbers of their cells. Returns how many there are.
std::size_t SnapSlab::renumber_layer(std::int64_t z) {
    const auto rows = input_.triangles.leaves();
    std::size_t read = 0, written = 0;
    for (std::int64_t y = 0; y < input_.bits.ny; ++y) {
        const std::size_t count = rows[input_.bits.row_index(y, z)];
        if (count == 0) continue;
        const auto cell = static_cast<std::uint32_t>(cell_numbers_.of(0, static_cast<std::size_t>(y)));
        written = renumber_row(read, count, cell, written);
        read += count;
    }
    return written;
}

// Writes the triangles of a row, which begins with this cell. `first` and `to` are where it begins in the
// layer and in what is written of it. Returns where that ends.
std::size_t SnapSlab::renumber_row(std::size_t first, std::size_t count, std::uint32_t first_cell,
                                   std::size_t to) {
    const std::uint32_t* const indices = window_.representatives() - first_point_;
    const std::uint32_t* const edge_x = window_.edge_x() - first_point_;
    const Triangle* const layer = layer_.data();
    std::uint32_t* const layer_indices = layer_indices_.data();
    Triangle* const triangles = output.mesh.triangles.data() + triangle_count_;
    std::uint32_t* const cells = output.cells.data() + triangle_count_;
    for (std::size_t t = first; t < first + count; ++t) {
        const auto [p, q, r] = layer[t];
        const std::uint64_t a = indices[p], b = indices[q], c = indices[r];
        const std::uint64_t ab = a | b << 32;
        std::memcpy(triangles[to].data(), &ab, sizeof ab);
        triangles[to][2] = static_cast<std::uint32_t>(c);
        // No triangle lies in the face of a cell at the far end. So some edge starts at the near end.
        cells[to] = first_cell + std::min({edge_x[p], edge_x[q], edge_x[r]});
        layer_indices[to] = static_cast<std::uint32_t>(t);
        to += static_cast<std::size_t>(a != b) & static_cast<std::size_t>(b != c) &
              static_cast<std::size_t>(c != a);
    }
    return to;
}

void SnapSlab::list_caps(std::size_t count) {
    const Triangle* const made = output.mesh.triangles.data() + triangle_count_;
    cap_indices_.clear();
    find_caps(output.mesh.points.data(), made, count, cap_indices_);
    for (const std::uint32_t t : cap_indices_) {
        CapTriangle& cap = output.caps.emplace_back();
        cap.triangle = made[t];
        const Triangle& unsnapped = layer_[layer_indices_[t]];
        for (std::size_t c = 0; c < 3; ++c) cap.moved[c] = window_.moved()[unsnapped[c] - first_point_];
    }
}

}  // namespace marrow::internal
