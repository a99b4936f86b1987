/// The geometry of slices in patient orientation, and the lines in which surfaces meet them.
#pragma once

#include <array>
#include <vector>

#include <QLineF>
#include <QPointF>
#include <QString>
#include <QTransform>
#include <QVector>

#include <marrow/mesh.h>

#include "model/session.h"

namespace marrow::viewer {

/// The orientation of a slice: as in radiology, the patient's right is on the left of axial and coronal
/// slices, and anterior is on the left of sagittal ones. Slices follow the index axes of the scan, so that
/// they show unchanged samples; each index axis stands for the nearest patient axis. A tilted gantry shears
/// the scan: then the slice is a parallelogram, and the index axis that is nearer to its patient axis stays
/// upright or level on the screen.
struct SliceGeometry {
    int across = 0, down = 1, through = 2;   ///< index axes
    bool across_flipped = false;             ///< the index grows to the left
    bool down_flipped = false;               ///< the index grows upwards
    std::array<std::int64_t, 2> size{0, 0};  ///< samples across and down
    QTransform to_mm;                        ///< from samples to mm to the right and down, true to scale
    QString left, right, top, bottom;        ///< patient directions: L R A P S I

    /// The point of an index in the slice, in samples from the top left sample.
    QPointF to_slice(const Vec3d& index) const;
    /// The index of a point in the slice; along `through` it is that of `other`.
    Vec3d to_index(const QPointF& point, const Vec3d& other) const;
};

/// The geometry of the slices of a plane. \pre the scan has samples
SliceGeometry slice_geometry(const Geometry& geometry, Plane plane);

/// The samples of a slice that are inside a box: columns and rows from `first` to `last`, both inclusive.
/// Empty if the slice does not meet the box.
struct SliceRange {
    std::array<std::int64_t, 2> first{0, 0}, last{-1, -1};

    bool empty() const { return last[0] < first[0] || last[1] < first[1]; }
    bool contains(std::int64_t u, std::int64_t v) const {
        return u >= first[0] && u <= last[0] && v >= first[1] && v <= last[1];
    }
};

SliceRange slice_range(const SliceGeometry& slice, const SampleBox& box, std::int64_t through);

/// The values of the samples of the slice at index `through`, row by row from the top left.
std::vector<float> slice_samples(const Volume& volume, const SliceGeometry& slice, std::int64_t through);

/// The isovalue for samples of slice_samples. Where these are only the nearest floats of the values, it is
/// the nearest float, too: otherwise a sample at the isovalue might be below it.
double slice_isovalue(const Volume& volume, double isovalue);

/// Neighbouring slices that are shown as one: the maximum intensity projection or the mean of their samples.
struct Slab {
    enum class Mode { maximum, mean };
    Mode mode = Mode::maximum;
    double thickness = 0;  ///< mm; 0: a single slice
    bool operator==(const Slab&) const = default;
};

/// How many slices are in a slab, at least one. They are stacked along the scan's own axis.
std::int64_t slices_in(const Slab& slab, const Geometry& geometry, const SliceGeometry& slice);

/// The values of a slab around the slice at index `through`, like slice_samples. The slab ends at the border
/// of the scan. Those that are not finite do not count.
std::vector<float> slab_samples(const Volume& volume, const SliceGeometry& slice, std::int64_t through,
                                const Slab& slab);

/// The lines in which the isosurface of the samples in a range meets a slice, in samples from the top left
/// sample. As on the surface itself, ends are on the edges between samples. An ambiguous face separates its
/// inside corners; with `topology`, the samples decide whether it joins them. A closed surface is also closed
/// half a sample beyond the range.
QVector<QLineF> slice_contour(const std::vector<float>& samples, std::array<std::int64_t, 2> size,
                              const SliceRange& range, double isovalue, bool closed, bool topology);

/// The lines in which a mesh meets a slice, in samples from the top left sample. `box` holds the samples of
/// the mesh; its outer slices show the border of the mesh. Tests every triangle: a few ms for a million.
QVector<QLineF> slice_mesh(const Mesh& mesh, const Geometry& geometry, const SampleBox& box,
                           const SliceGeometry& slice, std::int64_t through);

}  // namespace marrow::viewer
