// Extracts the surfaces of all labels of a map at once, and counts the samples of labels.
#include <marrow/labels.h>
#include <marrow/volume_filters.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>
#include <unordered_map>
#include <utility>

#include <marrow/buffer.h>

#include "base/parallel.h"
#include "base/progress.h"
#include "core/grid/index_to_physical.h"
#include "core/volume/checks.h"
#include "core/volume/rows.h"
#include "emit.h"
#include "relax.h"
#include "surface_net.h"

namespace marrow {

using namespace internal;

namespace {

// Unit normals at the points of a mesh: the sum of the normals of the triangles around each, weighted by
// area.
void add_normals(Mesh& mesh) {
    // Four numbers are faster than three; the fourth is 0.
    struct alignas(16) Vector {
        float values[4];
    };
    const std::size_t count = mesh.points.size();
    Buffer<Vector> points(count), sums(count);
    for (std::size_t p = 0; p < count; ++p) {
        const Vec3f& point = mesh.points[p];
        points[p] = {{point[0], point[1], point[2], 0}};
        sums[p] = {};
    }
    // The components of normals are in the order z, x, y, 0: value i follows from values i and i + 1 of both
    // edges. So the compiler makes vector code of these loops.
    constexpr std::size_t kNext[] = {1, 2, 0, 3};
    for (const Triangle& t : mesh.triangles) {
        const Vector &a = points[t[0]], &b = points[t[1]], &c = points[t[2]];
        Vector u, v, normal;
        for (std::size_t i = 0; i < 4; ++i) u.values[i] = b.values[i] - a.values[i];
        for (std::size_t i = 0; i < 4; ++i) v.values[i] = c.values[i] - a.values[i];
        for (std::size_t i = 0; i < 4; ++i)
            normal.values[i] = u.values[i] * v.values[kNext[i]] - u.values[kNext[i]] * v.values[i];
        for (const std::uint32_t p : t) {
            for (std::size_t i = 0; i < 4; ++i) sums[p].values[i] += normal.values[i];
        }
    }
    mesh.normals.resize(count);
    for (std::size_t p = 0; p < count; ++p) {
        const auto [z, x, y, unused] = sums[p].values;
        const float length = std::sqrt(x * x + y * y + z * z);
        // Where the triangles cancel each other, any direction will do.
        mesh.normals[p] = length > 0 ? Vec3f{x / length, y / length, z / length} : Vec3f{0, 0, 1};
    }
}

// Checks that all samples are integers.
template <class T>
void check_samples(const VolumeView& map) {
    if constexpr (std::is_floating_point_v<T>) {
        constexpr T kLargest =
            sizeof(T) == 4 ? T(1 << 24) : T(std::int64_t{1} << 53);  // beyond it, not every integer exists
        const auto [nx, ny, nz] = map.geometry.dims;
        parallel_for(std::int64_t{0}, ny * nz, [&, nx = nx, ny = ny](std::int64_t row) {
            const T* const samples = row_of<T>(map, row % ny, row / ny);
            for (std::int64_t x = 0; x < nx; ++x) {
                if (!(std::abs(samples[x]) <= kLargest) || std::trunc(samples[x]) != samples[x])
                    throw InputError(
                        "the volume has samples that are not integers, so it is not a label map; give a "
                        "volume in which each structure has one integer value");
            }
        });
    }
}

template <class T>
void check_background(std::int64_t background) {
    if (static_cast<std::int64_t>(static_cast<T>(background)) != background)
        throw InputError("the background label does not fit the sample type of the label map");
}

std::vector<LabelSurface> extract(const VolumeView& view, const LabelOptions& options) {
    const auto& [nx, ny, nz] = view.geometry.dims;
    // The passes below take samples without gaps, so a view with gaps is copied.
    VolumeView map;
    map.geometry = view.own_geometry();
    map.type = view.type;
    map.data = view.data;
    Volume copy;
    if (view.row_pitch() != nx || view.slice_pitch() != nx * ny) {
        copy = crop(view, {0, 0, 0}, {nx - 1, ny - 1, nz - 1});
        map.data = copy.data();
    }

    visit_sample_type(map.type, [&](auto sample) {
        check_background<decltype(sample)>(options.background);
        check_samples<decltype(sample)>(map);
    });
    const LabelMap label_map{map.type, map.data, map.geometry.dims, options.background};
    const Progress& progress = options.progress;
    SurfaceNet net = make_surface_net(label_map, find_borders(label_map, sub_progress(progress, 0, 0.15)),
                                      sub_progress(progress, 0.15, 0.3));
    relax(net, options.relax, sub_progress(progress, 0.3, 0.6));

    const auto background = static_cast<LabelIndex>(
        std::lower_bound(net.labels.begin(), net.labels.end(), options.background) - net.labels.begin());
    std::vector<Mesh> meshes =
        make_relaxed_meshes(net, IndexToPhysical(map), background, sub_progress(progress, 0.6, 0.9));

    std::vector<LabelSurface> surfaces;
    for (std::size_t l = 0; l < meshes.size(); ++l) {
        if (l != background) surfaces.push_back({net.labels[l], std::move(meshes[l])});
    }
    Stage stage(progress, 0.9, 1, surfaces.size());
    parallel_for(std::size_t{0}, surfaces.size(), [&](std::size_t i) {
        if (options.normals) add_normals(surfaces[i].mesh);
        stage.step();
    });
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
    if (options.relax < 0) throw InputError("the number of relaxation passes must not be negative");
    std::vector<LabelSurface> surfaces;
    if (!has_cells(map.geometry, true)) return surfaces;
    with_threads(options.threads, [&] { surfaces = extract(map, options); });
    report_progress(options.progress, 1);
    return surfaces;
}

std::map<std::int64_t, std::int64_t> count_labels(const VolumeView& map, const LabelCountOptions& options) {
    check_volume(map);
    const std::int64_t rows = map.geometry.dims[1], slices = map.geometry.dims[2];
    Stage stage(options.progress, 0, 1, static_cast<std::size_t>(slices));
    PerThread<LabelCounts> counts_of_thread;
    with_threads(options.threads, [&] {
        visit_sample_type(map.type, [&](auto sample) {
            using T = decltype(sample);
            check_samples<T>(map);
            parallel_for(std::int64_t{0}, slices, [&](std::int64_t k) {
                for (std::int64_t y = 0; y < rows; ++y) {
                    const T* const row = row_of<T>(map, y, k);
                    count_runs(row, row + map.geometry.dims[0], counts_of_thread.local());
                }
                stage.step();
            });
        });
    });
    std::map<std::int64_t, std::int64_t> all;
    for (const LabelCounts& counts : counts_of_thread) {
        for (const auto& [label, samples] : counts) all[label] += samples;
    }
    return all;
}

}  // namespace marrow
