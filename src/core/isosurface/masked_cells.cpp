// Emission writes triangles cell by cell, and the case of a cell says how many it has. So a walk over the cells
// finds the triangles of each.
#include "masked_cells.h"

#include <hwy/highway.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <vector>

#include "core/marching_cubes/case_table.h"
#include "core/marching_cubes/classify.h"
#include "core/marching_cubes/row_bits-inl.h"

namespace marrow::internal {

namespace {

using HWY_NAMESPACE::CellBits, HWY_NAMESPACE::GridRow, HWY_NAMESPACE::RowBits;

// The cells whose corners are all set.
std::uint64_t full_cells(const CellBits& cells) {
    std::uint64_t all = ~std::uint64_t{0};
    for (const std::uint64_t corner : cells.corners) all &= corner;
    return all;
}

// The cells with both set and clear corners.
std::uint64_t active_cells(const CellBits& cells) {
    std::uint64_t some = 0;
    for (const std::uint64_t corner : cells.corners) some |= corner;
    return some & ~full_cells(cells);
}

int triangles_of(const CellBits& cells, int cell) {
    unsigned cell_case = 0;
    for (unsigned v = 0; v < 8; ++v) cell_case |= static_cast<unsigned>(cells.corners[v] >> cell & 1) << v;
    return kCases[cell_case].triangles;
}

// Moves the triangles to keep of a slice of cells, from `first` on, to the front. Returns their end.
Triangle* keep_in_slice(const InsideBits& mask, const InsideBits& bits, const ActiveWords& active,
                        std::int64_t z, Triangle* first) {
    Triangle* end = first;
    for (GridRow at(bits, bits.row_index(0, z)); at.z == z; at.advance(bits)) {
        const RowBits row(bits, at), mask_row(mask, at);
        if (!row.has_cells) continue;
        HWY_NAMESPACE::for_each_active_word(active, at.index, [&](std::size_t w) {
            const CellBits cells(row, w);
            const std::uint64_t kept = full_cells(CellBits(mask_row, w));
            for (std::uint64_t left = active_cells(cells) & row.valid(w); left != 0; left &= left - 1) {
                const int cell = std::countr_zero(left), count = triangles_of(cells, cell);
                if ((kept >> cell & 1) != 0) {
                    for (int t = 0; t < count; ++t) end[t] = first[t];
                    end += count;
                }
                first += count;
            }
        });
    }
    return end;
}

void drop_unused_points(Mesh& mesh, Buffer<float>* values) {
    std::vector<std::uint32_t> new_ids(mesh.points.size());
    for (const Triangle& triangle : mesh.triangles)
        for (const std::uint32_t p : triangle) new_ids[p] = 1;
    std::uint32_t count = 0;
    for (std::size_t p = 0; p < new_ids.size(); ++p) {
        if (new_ids[p] == 0) continue;
        mesh.points[count] = mesh.points[p];
        if (!mesh.normals.empty()) mesh.normals[count] = mesh.normals[p];
        if (values != nullptr) (*values)[count] = (*values)[p];
        new_ids[p] = count++;
    }
    mesh.points.resize(count);
    if (!mesh.normals.empty()) mesh.normals.resize(count);
    if (values != nullptr) values->resize(count);
    for (Triangle& triangle : mesh.triangles)
        for (std::uint32_t& p : triangle) p = new_ids[p];
}

}  // namespace

void keep_masked_cells(const VolumeView& mask, const InsideBits& bits, const ActiveWords& active,
                       const HistoPyramid& triangles, Mesh& mesh, Buffer<float>* values) {
    InsideBits mask_bits(mask.geometry.dims, false);
    tbb::parallel_for(std::int64_t{0}, bits.nz,
                      [&](std::int64_t z) { classify_slice(mask, 1, z, mask_bits, nullptr); });
    const auto first_of = [&](std::int64_t z) {
        return mesh.triangles.data() + triangles.first_output(bits.row_index(0, z));
    };
    std::vector<Triangle*> ends(static_cast<std::size_t>(bits.nz));
    tbb::parallel_for(std::int64_t{0}, bits.nz, [&](std::int64_t z) {
        ends[static_cast<std::size_t>(z)] = keep_in_slice(mask_bits, bits, active, z, first_of(z));
    });
    Triangle* end = ends.front();
    for (std::int64_t z = 1; z < bits.nz; ++z)
        end = std::move(first_of(z), ends[static_cast<std::size_t>(z)], end);
    mesh.triangles.resize(static_cast<std::size_t>(end - mesh.triangles.data()));
    drop_unused_points(mesh, values);
}

}  // namespace marrow::internal
