/// Surfaces of label maps that are larger than one machine, extracted in parts by any number of processes.
///
/// A part has whole rows of samples along x. Relaxation moves points by what lies around them, so a part
/// also reads `label_part_halo(options)` samples around it along y and z, where the map has them. What
/// remains is done for all parts together, in the memory of one process: points go back where surfaces
/// would pass through themselves, and normals are summed up. The results have the bytes of
/// extract_labels of the whole map.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/export.h>
#include <marrow/labels.h>
#include <marrow/mesh.h>
#include <marrow/volume.h>

namespace marrow {

/// The triangles of a part's rows, and the points that they name.
struct LabelPart {
    /// A label's triangles on the borders that begin in the part's rows.
    struct Surface {
        std::int64_t label = 0;
        Buffer<std::uint64_t> keys;        ///< of points, in the order of the whole surface
        Buffer<std::uint32_t> net_points;  ///< for each point, which one of the net it is
        Buffer<Triangle> triangles;
    };

    std::array<std::int64_t, 3> whole{};  ///< samples of the whole map
    std::array<std::int64_t, 3> first{};  ///< index of the part's first sample
    std::array<std::int64_t, 3> dims{};   ///< samples of the part; no other part has them
    /// The net's points, which the surfaces of several labels share: keys, in the order
    /// of the whole net, and positions.
    Buffer<std::uint64_t> net_keys;
    Buffer<Vec3f> positions;
    Buffer<Vec3f> positions_before_relaxation;  ///< empty if there was none
    std::vector<Surface> surfaces;              ///< in ascending order of labels
};

/// The samples around a part that it needs along y and z.
inline std::int64_t label_part_halo(const LabelOptions& options) {
    return std::int64_t{options.relax} + 2;
}

/// Extracts the surfaces of a part. The samples of `part` belong to it alone; `below` and `above` say how
/// many more there are around it. `whole` are the dims of the whole map, of which `part.first` and
/// `part.geometry` speak; `options.normals` is not used. \throw as extract_labels; InputError the part does
/// not have whole rows, or not enough samples around it
MARROW_EXPORT LabelPart extract_label_part(const VolumeView& part, const std::array<std::int64_t, 3>& whole,
                                           const LabelOptions& options = {});

/// Merges parts, in any order, which together have each row of a map once: the bytes of extract_labels.
/// Only `normals`, `threads` and `progress` of the options are used. \pre extract_label_part() made the
/// parts, with equal options. \throw InputError parts of different maps, or that overlap or leave a gap;
/// LimitError as extract_labels; Cancelled
MARROW_EXPORT std::vector<LabelSurface> merge_label_parts(std::span<const LabelPart> parts,
                                                          const LabelOptions& options = {});

}  // namespace marrow
