/// Extracts the surfaces of the labels of a label map, such as a segmented CT scan.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include <marrow/export.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>
#include <marrow/volume.h>

namespace marrow {

struct LabelOptions {
    std::int64_t background = 0;  ///< the label that has no surface; it also surrounds the volume
    int relax = 40;               ///< smoothing passes, which remove the steps between samples; 0: none
    bool normals = true;          ///< compute a unit normal for each point
    int threads = 0;              ///< threads to use; 0: all
    Progress progress = {};       ///< called while extracting
};

/// The surface of the samples with one label.
struct LabelSurface {
    std::int64_t label = 0;
    Mesh mesh;
    /// Points that relaxation moved less far than it otherwise would, so that no surface is folded or passes
    /// through itself or another.
    std::int64_t held_back_points = 0;
};

/// Extracts one closed surface for each label of a map, in ascending order of labels.
///
/// The method is a surface net. Each cell with a border between labels has a point. Each grid edge between
/// two labels has a quad, whose corners are the points of the four cells around the edge. Both labels have
/// this quad, facing opposite ways. Relaxation moves each point towards the mean of its neighbours, but not
/// out of its cell: steps between samples become slopes, and neighbouring surfaces keep common points. A line
/// where three labels meet is smoothed along the line. Points are held back where surfaces would be
/// folded or pass through themselves or each other.
///
/// Each surface is manifold. For this, a cell with several separate borders has several points. Parts of a
/// label that touch only at an edge or corner of the grid are separated; where two labels cross on a face of
/// a cell (a b / b a), the parts of the larger label are. Parts of a label can still have points at the same
/// position, where two other labels meet them.
///
/// A surface does not enclose exactly the volume of its label's samples, which count_labels returns. The
/// points begin near the middles of grid edges, which cuts off corners. Relaxation restores some volume of
/// compact shapes, and shrinks rods and specks by up to half a sample on each side. A large organ keeps
/// its volume within about 1 %; a structure of one or two samples can lose most of it.
///
/// A normal is the mean of the normals of the triangles around its point, weighted by area. The result does
/// not depend on the number of threads. A map with gaps between rows or slices is copied first.
///
/// After Gibson 1998 (constrained elastic surface nets), and Schaefer, Ju and Warren 2007 (manifold dual
/// contouring).
/// \throw InputError bad geometry, a null view, a rescale, samples that are not integers or, in float32,
/// beyond 2^24, more than 65535 labels besides the background, a background that the samples' type does not
/// have as a label, or a negative `relax`; LimitError more points than triangles can name, or 2^32 triangles
/// or more to relax; Cancelled
MARROW_EXPORT std::vector<LabelSurface> extract_labels(const VolumeView& map,
                                                       const LabelOptions& options = {});

struct LabelCountOptions {
    int threads = 0;         ///< threads to use; 0: all
    Progress progress = {};  ///< called while counting
};

/// Counts the samples of each label of a map, including the background.
/// \throw InputError bad geometry, a null view, a rescale, or samples that are not integers or, in float32,
/// beyond 2^24; Cancelled
MARROW_EXPORT std::map<std::int64_t, std::int64_t> count_labels(const VolumeView& map,
                                                                const LabelCountOptions& options = {});

}  // namespace marrow
