// Classifies, counts and emits a part, which is closed where the whole volume ends.
#include "part_passes.h"

#include <algorithm>
#include <string>
#include <utility>

#include "base/checked_size.h"
#include "base/parallel.h"
#include "core/grid/shares.h"
#include "core/marching_cubes/classify.h"
#include "core/marching_cubes/emit.h"
#include "core/volume/checks.h"

namespace marrow::internal {

namespace {

// The sides of the whole volume that the part touches.
ClosedSides closed_sides(const PartExtent& extent, bool closed) {
    ClosedSides sides;
    for (std::size_t a = 0; closed && a < 3; ++a) {
        sides.below[a] = extent.first[a] == 0;
        sides.above[a] = extent.first[a] + extent.dims[a] == extent.whole[a];
    }
    return sides;
}

std::array<std::int64_t, 3> volume_dims(const VolumeView& part) {
    return part.geometry.dims;
}

}  // namespace

PartExtent extent_of(const VolumeView& part, const std::array<std::int64_t, 3>& whole,
                     const IsosurfaceOptions& options) {
    if (options.snap != 0) throw InputError("a part cannot be snapped: options.snap must be 0");
    check_volume(part);
    Geometry geometry = part.geometry;
    geometry.dims = whole;
    check_geometry(geometry);
    PartExtent extent{whole, part.first, part.geometry.dims};
    for (std::size_t a = 0; a < 3; ++a) {
        const std::int64_t before = part.first[a], after = whole[a] - part.first[a] - part.geometry.dims[a];
        const std::string axis = std::to_string(a);
        if (part.geometry.dims[a] < 1) throw InputError("a part has no samples along axis " + axis);
        if (after < 0)
            throw InputError("a part leaves the whole volume, which has " + std::to_string(whole[a]) +
                             " samples along axis " + axis);
        if (options.normals && (part.below[a] < std::min<std::int64_t>(before, 1) ||
                                part.above[a] < std::min<std::int64_t>(after, 1)))
            throw InputError(
                "a part needs one sample more on each side for normals, and lacks one along axis " + axis +
                ": give it in `below` and `above`, or leave out options.normals");
        if (!options.closed) continue;
        extent.whole[a] += 2;
        extent.dims[a] += (before == 0) + (after == 0);
        extent.first[a] += before > 0;
    }
    return extent;
}

void throw_mixed_topology() {
    throw InputError("some parts have exact topology, and some have not: give all of them the same options");
}

PartPasses::PartPasses(const VolumeView& part, const PartExtent& extent, double isovalue,
                       const IsosurfaceOptions& options)
    : part_(part),
      isovalue_(isovalue),
      options_(options),
      to_physical_(part),
      bits_(volume_dims(part), closed_sides(extent, options.closed)),
      active_(bits_),
      rows_(bits_.rows()) {
    Stage stage(options.progress, 0, 0.4, 2 * static_cast<std::size_t>(bits_.nz));
    parallel_for(std::int64_t{0}, bits_.nz, [&](std::int64_t z) {
        classify_slice(part_, isovalue_, z, bits_, nullptr);
        stage.step();
    });
    if (options.topology) ambiguous_.emplace(part_, isovalue_, to_physical_, bits_);
    parallel_for(std::int64_t{0}, bits_.nz, [&](std::int64_t z) {
        if (ambiguous_)
            ambiguous_->count(z, rows_, active_);
        else
            count_rows(bits_, bits_.row_index(0, z), bits_.row_index(0, z + 1), rows_, active_);
        stage.step();
    });
    count_triangles(bits_, 0, bits_.rows(), rows_);
    if (ambiguous_) add_ambiguous_cells();
}

void PartPasses::add_ambiguous_cells() {
    for (std::int64_t z = 0; z < bits_.nz; ++z) ambiguous_->add_to(rows_, z);
    inner_points_.resize(bits_.rows());
    for (AmbiguousRows rows(&*ambiguous_, 0); rows.row() < bits_.rows(); rows.advance())
        inner_points_[rows.row()] = rows->inner_points;
}

Mesh PartPasses::emit() const {
    const HistoPyramid points(rows_.points), triangles(rows_.triangles);
    check_point_count(points.total());
    Mesh mesh;
    mesh.points.resize(checked_size(points.total(), sizeof(Vec3f)));
    mesh.normals.resize(options_.normals ? mesh.points.size() : 0);
    mesh.triangles.resize(checked_size(triangles.total(), sizeof(Triangle)));
    const EmitInput input{part_,  isovalue_, to_physical_,  bits_,         active_,
                          points, triangles, rows_.along_x, rows_.along_y, ambiguous()};
    Stage stage(options_.progress, 0.4, 1, 2 * share_count());
    Vec3f* const normals = options_.normals ? mesh.normals.data() : nullptr;
    for_each_share(points, 0, bits_.rows(), [&](std::size_t row_begin, std::size_t row_end) {
        emit_points(input, row_begin, row_end, mesh.points.data(), normals);
        stage.step();
    });
    for_each_share(triangles, 0, bits_.rows(), [&](std::size_t row_begin, std::size_t row_end) {
        emit_triangles(input, row_begin, row_end, mesh.triangles.data());
        stage.step();
    });
    report_progress(options_.progress, 1);
    return mesh;
}

}  // namespace marrow::internal
