/// Surfaces of label maps.
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
    std::int64_t background = 0;  ///< the label that has no surface; beyond the volume there is nothing else
    int relax = 40;               ///< passes of relaxation against stairs; 0: none
    bool normals = true;          ///< a unit normal for each point, from the triangles around it
    int threads = 0;              ///< threads to use; 0: all
    Progress progress = {};       ///< called while extracting
};

/// The surface of the samples that have one label.
struct LabelSurface {
    std::int64_t label = 0;
    Mesh mesh;
};

/// Extracts one closed surface for each label of a map, in ascending order of labels, in a single pass over the samples.
///
/// A surface net: each cell between eight samples that holds a border has a point, and each grid edge between two labels a
/// patch between the points of the four cells around it, which both labels' surfaces have, facing opposite ways. Points are
/// moved to the middle of those they are joined with, again and again, but not out of their cells: stairs become slopes, and
/// surfaces that meet still do, point for point. Where three labels meet, their common line is smoothed as a line.
///
/// Each surface is closed and manifold. For that a cell has several points where borders pass through it without touching, and
/// where a label's parts touch at an edge or corner of the grid they are separated: on a face with two labels across its
/// diagonals, the parts of the larger label are. Parts of one label can touch at a point that it shares with two others.
///
/// What a surface encloses is not the volume of its label's samples: points start amid the middles of the grid edges that the
/// border crosses, which cuts corners off; relaxation gives some of that back to what is compact, and shrinks rods and specks by
/// up to half a sample all round. Of a large organ that is a few hundredths, of what is one or two samples thick it can be most.
/// count_labels tells what it should be.
/// The order of points and triangles, and every bit of them, does not depend on `threads`.
///
/// After Gibson 1998 (constrained elastic surface nets), Schaefer, Ju and Warren 2007 (manifold dual contouring).
/// \throw InputError bad geometry, or samples that are no integers or have more than 65535 different values; LimitError more
/// points than triangles can name; Cancelled
MARROW_EXPORT std::vector<LabelSurface> extract_labels(const VolumeView& map,
                                                       const LabelOptions& options = {});

/// How many samples have each label, the background among them; `threads` 0: all. \throw InputError bad geometry, or samples
/// that are no integers
MARROW_EXPORT std::map<std::int64_t, std::int64_t> count_labels(const VolumeView& map, int threads = 0);

}  // namespace marrow
