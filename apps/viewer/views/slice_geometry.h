// Slices in patient orientation: which samples a slice shows, where, and where the isosurface meets it.
#pragma once

#include <array>
#include <vector>

#include <QLineF>
#include <QPointF>
#include <QSizeF>
#include <QString>
#include <QVector>

#include <marrow/mesh.h>

#include "model/session.h"

namespace marrow::viewer {

/// How a plane of samples is shown: as radiologists hang it, with the patient's right on the left of axial and coronal
/// slices and anterior on the left of sagittal ones. Slices are those of the scan's own axes, each taken for the
/// patient's axis that it is nearest to, so that they show samples as they are.
struct SliceFrame {
    int across = 0, down = 1, through = 2;   ///< axes of the index
    bool across_flipped = false;             ///< the index grows to the left
    bool down_flipped = false;               ///< the index grows upwards
    std::array<std::int64_t, 2> size{0, 0};  ///< samples across and down
    QSizeF pixel;                            ///< mm between samples
    QString left, right, top, bottom;        ///< patient directions: L R A P S I

    /// Where an index lies in the slice, in samples from the top left one.
    QPointF to_slice(const Vec3d& index) const;
    /// The index at a place in the slice; along `through` that of `elsewhere`.
    Vec3d to_index(const QPointF& place, const Vec3d& elsewhere) const;
};

/// The frame of a plane. \pre a scan with samples
SliceFrame slice_frame(const Geometry& geometry, Plane plane);

/// Which samples of a slice lie in a box: columns and rows from the first to the last, both included; none where the slice
/// lies beside the box.
struct SliceRange {
    std::array<std::int64_t, 2> first{0, 0}, last{-1, -1};

    bool empty() const { return last[0] < first[0] || last[1] < first[1]; }
    bool holds(std::int64_t u, std::int64_t v) const {
        return u >= first[0] && u <= last[0] && v >= first[1] && v <= last[1];
    }
};

SliceRange slice_range(const SliceFrame& frame, const SampleBox& box, std::int64_t through);

/// The samples of the slice at index `through`, row by row from the top left.
std::vector<float> slice_samples(const Volume& volume, const SliceFrame& frame, std::int64_t through);

/// Where the isosurface of the samples in a range meets a slice, in samples from the top left one: on the edges between
/// samples, and with inside corners apart where a face is ambiguous, as the surface has it. If `closed`, also round the
/// range, half a sample beyond its border.
QVector<QLineF> slice_contour(const std::vector<float>& samples, std::array<std::int64_t, 2> size,
                              const SliceRange& range, double isovalue, bool closed);

/// Where a mesh meets a slice, in samples from the top left one. `box` is what the mesh was made of: on its outer slices,
/// it is the border of the mesh that meets them. Tries every triangle: some ms for a million.
QVector<QLineF> slice_mesh(const Mesh& mesh, const Geometry& geometry, const SampleBox& box,
                           const SliceFrame& frame, std::int64_t through);

}  // namespace marrow::viewer
