// Checks a label map, finds its net, and relaxes it.
#include "relaxed_net.h"

#include <algorithm>
#include <type_traits>
#include <utility>

#include <marrow/error.h>
#include <marrow/volume_filters.h>

#include "base/progress.h"
#include "label_samples.h"
#include "relax.h"

namespace marrow::internal {
namespace {

template <class T>
void check_background(std::int64_t background) {
    bool fits = false;
    if constexpr (std::is_floating_point_v<T>)
        fits = background >= -kLargestLabel<T> && background <= kLargestLabel<T>;
    else
        fits = static_cast<std::int64_t>(static_cast<T>(background)) == background;
    if (!fits) throw InputError("the background label does not fit the sample type of the label map");
}

}  // namespace

void check_label_options(const LabelOptions& options) {
    if (options.relax < 0) throw InputError("labels: the number of relaxation passes must be 0 or more");
}

RelaxedNet make_relaxed_net(const VolumeView& view, const LabelOptions& options, const Progress& progress) {
    const auto& [nx, ny, nz] = view.geometry.dims;
    // The passes below take samples without gaps, so a view with gaps is copied.
    VolumeView map;
    map.geometry.dims = view.geometry.dims;
    map.type = view.type;
    map.data = view.data;
    Volume copy;
    if (view.row_pitch() != nx || view.slice_pitch() != nx * ny) {
        copy = crop(view, {0, 0, 0}, {nx - 1, ny - 1, nz - 1});
        map.data = copy.data();
    }

    visit_sample_type(map.type, [&](auto sample) {
        check_background<decltype(sample)>(options.background);
        check_label_samples<decltype(sample)>(map, sub_progress(progress, 0, 0.1));
    });
    const LabelMap label_map{map.type, map.data, map.geometry.dims, options.background};
    SurfaceNet net = make_surface_net(label_map, find_borders(label_map, sub_progress(progress, 0.1, 0.25)),
                                      sub_progress(progress, 0.25, 0.5));
    relax(net, options.relax, sub_progress(progress, 0.5, 1));

    const auto background = static_cast<LabelIndex>(
        std::lower_bound(net.labels.begin(), net.labels.end(), options.background) - net.labels.begin());
    return {std::move(net), background};
}

}  // namespace marrow::internal
