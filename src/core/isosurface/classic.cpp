// Traditional marching cubes (Lorensen and Cline 1987, in the form of Bourke 1994): visits every cell, looks
// up its case, interpolates, and gives every triangle three points of its own. It uses no bits, no pyramids
// and no shared points.
#include <cmath>
#include <limits>

#include <marrow/error.h>
#include <marrow/isosurface.h>

#include "core/grid/index_to_physical.h"
#include "core/grid/threshold.h"
#include "core/marching_cubes/case_table.h"
#include "core/volume/checks.h"
#include "core/volume/rows.h"

namespace marrow {

using namespace internal;

namespace {

template <class T>
struct Field {
    const VolumeView& volume;
    T threshold;
    Real<T> isovalue;

    const T* at(std::int64_t x, std::int64_t y, std::int64_t z) const {
        const auto& dims = volume.geometry.dims;
        const bool within = x >= 0 && x < dims[0] && y >= 0 && y < dims[1] && z >= 0 && z < dims[2];
        return within ? row_of<T>(volume, y, z) + x : nullptr;
    }
    bool inside(const T* sample) const { return sample != nullptr && is_inside(*sample, threshold); }
};

template <class T>
Vec3f edge_point(const Field<T>& field, const IndexToPhysical& to_physical,
                 const std::array<std::int64_t, 3>& cell, int edge, const T* (&corners)[8]) {
    const int first = kEdgeCorners[edge][0], second = kEdgeCorners[edge][1];
    const std::size_t axis = second - first == 1 ? 0 : second - first == 2 ? 1 : 2;
    Real<T> t = Real<T>(0.5);
    if (corners[first] != nullptr && corners[second] != nullptr) {
        t = edge_fraction<Real<T>>(static_cast<Real<T>>(*corners[first]) * kSampleScale<T>,
                                   static_cast<Real<T>>(*corners[second]) * kSampleScale<T>, field.isovalue);
    }
    const std::int64_t x = cell[0] + (first & 1), y = cell[1] + (first >> 1 & 1), z = cell[2] + (first >> 2);
    return to_physical.point(to_physical.row_base(y, z), static_cast<float>(to_physical.first[0] + x), axis,
                             static_cast<float>(t));
}

template <class T>
Mesh march(const VolumeView& volume, double isovalue, bool closed) {
    Mesh mesh;
    const auto threshold = inside_threshold<T>(isovalue);
    if (!threshold) return mesh;
    const Field<T> field{volume, *threshold, static_cast<Real<T>>(isovalue) * kSampleScale<T>};
    const IndexToPhysical to_physical(volume);
    const auto& dims = volume.geometry.dims;
    const std::int64_t low = closed ? -1 : 0, high = closed ? 0 : 1;
    for (std::int64_t z = low; z + high < dims[2]; ++z) {
        for (std::int64_t y = low; y + high < dims[1]; ++y) {
            for (std::int64_t x = low; x + high < dims[0]; ++x) {
                const T* corners[8];
                unsigned cell_case = 0;
                for (int v = 0; v < 8; ++v) {
                    corners[v] = field.at(x + (v & 1), y + (v >> 1 & 1), z + (v >> 2));
                    cell_case |= unsigned{field.inside(corners[v])} << v;
                }
                const Case& c = kCases[cell_case];
                for (int t = 0; t < c.triangles; ++t) {
                    const auto first = static_cast<std::uint32_t>(mesh.points.size());
                    for (int corner = 0; corner < 3; ++corner) {
                        mesh.points.push_back(
                            edge_point<T>(field, to_physical, {x, y, z}, c.edges[3 * t + corner], corners));
                    }
                    if (to_physical.mirrored)
                        mesh.triangles.push_back({first, first + 2, first + 1});
                    else
                        mesh.triangles.push_back({first, first + 1, first + 2});
                }
            }
        }
    }
    return mesh;
}

}  // namespace

Mesh extract_isosurface_classic(const VolumeView& volume, double isovalue, bool closed) {
    check_volume(volume);
    const double sample_isovalue = checked_isovalue(isovalue, volume.rescale);
    return visit_sample_type(
        volume.type, [&](auto sample) { return march<decltype(sample)>(volume, sample_isovalue, closed); });
}

}  // namespace marrow
