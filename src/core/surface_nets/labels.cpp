#include <marrow/labels.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <marrow/buffer.h>

#include "core/grid/index_to_physical.h"
#include "core/volume/checks.h"
#include "emit.h"
#include "relax.h"
#include "surface_net.h"

namespace marrow {

using namespace internal;

namespace {

// Unit normals from the triangles around each point, by area.
void add_normals(Mesh& mesh) {
    // Four numbers to a point are quicker than three.
    using Four = float __attribute__((vector_size(16)));
    const std::size_t count = mesh.points.size();
    Buffer<Four> at(count), sums(count);
    for (std::size_t p = 0; p < count; ++p) {
        const Vec3f& point = mesh.points[p];
        at[p] = Four{point[0], point[1], point[2], 0};
        sums[p] = Four{};
    }
    const auto turned = [](Four v) { return __builtin_shufflevector(v, v, 1, 2, 0, 3); };
    for (const Triangle& t : mesh.triangles) {
        const Four u = at[t[1]] - at[t[0]], v = at[t[2]] - at[t[0]];
        const Four n = turned(u * turned(v) - turned(u) * v);  // the cross product
        for (const std::uint32_t p : t) sums[p] += n;
    }
    mesh.normals.resize(count);
    for (std::size_t p = 0; p < count; ++p) {
        const Four& n = sums[p];
        const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        // Where triangles cancel any direction is as good.
        mesh.normals[p] = length > 0 ? Vec3f{n[0] / length, n[1] / length, n[2] / length} : Vec3f{0, 0, 1};
    }
}

template <class T>
void check_samples(const VolumeView& map, std::int64_t background) {
    if (static_cast<std::int64_t>(static_cast<T>(background)) != background)
        throw InputError("the background label does not fit the map's samples");
    if constexpr (std::is_floating_point_v<T>) {
        const T* samples = static_cast<const T*>(map.data);
        constexpr T kMost = sizeof(T) == 4 ? T(1 << 24) : T(std::int64_t{1} << 53);
        tbb::parallel_for(
            tbb::blocked_range<std::int64_t>(0, map.geometry.sample_count(), 1 << 16),
            [&](const auto& range) {
                for (std::int64_t i = range.begin(); i < range.end(); ++i) {
                    if (!(std::abs(samples[i]) <= kMost) || std::trunc(samples[i]) != samples[i])
                        throw InputError(
                            "the samples are no labels, as they are not all integers; label maps hold "
                            "integers");
                }
            });
    }
}

// The story: find borders, labels and points; relax; part the points by labels and join them.
std::vector<LabelSurface> extract(const VolumeView& map, const LabelOptions& options) {
    visit_sample_type(map.type,
                      [&](auto sample) { check_samples<decltype(sample)>(map, options.background); });
    LabelNet net = make_net({map.type, map.data, map.geometry.dims, options.background}, options.progress);
    relax(net, options.relax, options.progress);

    const IndexToPhysical frame(map.geometry);
    const auto background = static_cast<Place>(
        std::lower_bound(net.values.begin(), net.values.end(), options.background) - net.values.begin());
    Stage emitting(options.progress, 0.6, 0.9, 2 * net.pieces.size());
    std::vector<Mesh> meshes = emit(net, frame, background, emitting);

    std::vector<LabelSurface> surfaces;
    for (std::size_t place = 0; place < meshes.size(); ++place) {
        if (place != background) surfaces.push_back({net.values[place], std::move(meshes[place])});
    }
    Stage stage(options.progress, 0.9, 1, surfaces.size());
    tbb::parallel_for(std::size_t{0}, surfaces.size(), [&](std::size_t i) {
        if (options.normals) add_normals(surfaces[i].mesh);
        stage.step();
    });
    return surfaces;
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

std::map<std::int64_t, std::int64_t> count_labels(const VolumeView& map, int threads) {
    check_volume(map);
    const auto [nx, ny, nz] = map.geometry.dims;
    using Counts = std::unordered_map<std::int64_t, std::int64_t>;
    tbb::enumerable_thread_specific<Counts> of_thread;
    with_threads(threads, [&, nx = nx, ny = ny, nz = nz] {
        visit_sample_type(map.type, [&](auto sample) {
            check_samples<decltype(sample)>(map, 0);
            const auto* const samples = static_cast<const decltype(sample)*>(map.data);
            tbb::parallel_for(std::int64_t{0}, nz, [&](std::int64_t k) {
                Counts& counts = of_thread.local();
                const auto* next = samples + k * ny * nx;
                const auto* const end = next + ny * nx;
                while (next != end) {  // labels come in long runs
                    const auto label = *next;
                    const auto* const first = next;
                    while (next != end && *next == label) ++next;
                    counts[static_cast<std::int64_t>(label)] += next - first;
                }
            });
        });
    });
    std::map<std::int64_t, std::int64_t> all;
    for (const Counts& counts : of_thread) {
        for (const auto& [label, samples] : counts) all[label] += samples;
    }
    return all;
}

}  // namespace marrow
