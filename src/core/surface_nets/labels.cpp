// Extracts the surfaces of all labels of a map at once, and counts the samples of labels.
#include <marrow/labels.h>

#include <algorithm>
#include <cstdint>
#include <unordered_map>
#include <utility>

#include "base/parallel.h"
#include "base/progress.h"
#include "core/grid/index_to_physical.h"
#include "core/volume/checks.h"
#include "core/volume/rows.h"
#include "emit.h"
#include "label_normals.h"
#include "label_samples.h"
#include "relaxed_net.h"

namespace marrow {

using namespace internal;

namespace {

std::vector<LabelSurface> extract(const VolumeView& view, const LabelOptions& options) {
    const Progress& progress = options.progress;
    auto [net, background] = make_relaxed_net(view, options, sub_progress(progress, 0, 0.6));
    VolumeView alone = view;  // positions are those of the view by itself
    alone.geometry = view.own_geometry();
    alone.first = {};
    LabelMeshes relaxed =
        make_relaxed_meshes(net, IndexToPhysical(alone), background, sub_progress(progress, 0.6, 0.9));
    std::vector<LabelSurface> surfaces;
    for (std::size_t l = 0; l < relaxed.meshes.size(); ++l) {
        if (l == background) continue;
        surfaces.push_back({net.labels[l], std::move(relaxed.meshes[l]), relaxed.held_back_points[l]});
    }
    if (options.normals) add_label_normals(surfaces, sub_progress(progress, 0.9, 1));
    return surfaces;
}

using LabelCounts = std::unordered_map<std::int64_t, std::int64_t>;

// Adds up the samples of each label in [begin, end). Labels come in long runs, so runs are counted first.
template <class T>
void count_runs(const T* begin, const T* end, LabelCounts& counts) {
    while (begin != end) {
        const T* const run_end = std::find_if(begin, end, [label = *begin](T s) { return s != label; });
        counts[static_cast<std::int64_t>(*begin)] += run_end - begin;
        begin = run_end;
    }
}

}  // namespace

std::vector<LabelSurface> extract_labels(const VolumeView& map, const LabelOptions& options) {
    check_volume(map);
    check_not_rescaled(map);
    check_label_options(options);
    std::vector<LabelSurface> surfaces;
    if (!has_cells(map.geometry, true)) return surfaces;
    with_threads(options.threads, [&] { surfaces = extract(map, options); });
    report_progress(options.progress, 1);
    return surfaces;
}

std::map<std::int64_t, std::int64_t> count_labels(const VolumeView& map, const LabelCountOptions& options) {
    check_volume(map);
    check_not_rescaled(map);
    const std::int64_t rows = map.geometry.dims[1], slices = map.geometry.dims[2];
    Stage stage(options.progress, 0.3, 0.8, static_cast<std::size_t>(slices));
    PerThread<LabelCounts> counts_of_thread;
    with_threads(options.threads, [&] {
        visit_sample_type(map.type, [&](auto sample) {
            using T = decltype(sample);
            check_label_samples<T>(map, sub_progress(options.progress, 0, 0.3));
            parallel_for(std::int64_t{0}, slices, [&](std::int64_t k) {
                for (std::int64_t y = 0; y < rows; ++y) {
                    const T* const row = row_of<T>(map, y, k);
                    count_runs(row, row + map.geometry.dims[0], counts_of_thread.local());
                }
                stage.step();
            });
        });
    });
    // A map grows faster in the order of its keys.
    std::vector<std::pair<std::int64_t, std::int64_t>> entries;
    for (const LabelCounts& counts : counts_of_thread)
        entries.insert(entries.end(), counts.begin(), counts.end());
    std::sort(entries.begin(), entries.end());
    std::map<std::int64_t, std::int64_t> all;
    constexpr std::size_t kTogether = 65536;
    Stage adding(options.progress, 0.8, 1, (entries.size() + kTogether - 1) / kTogether);
    for (std::size_t i = 0; i < entries.size(); ++i) {
        if (i % kTogether == 0) adding.step();
        all.emplace_hint(all.end(), entries[i].first, 0)->second += entries[i].second;
    }
    return all;
}

}  // namespace marrow
