#include <marrow/labels.h>

#include <unordered_map>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include "dispatch.h"

namespace marrow {

std::map<std::int64_t, std::int64_t> count_labels(const VolumeView& map) {
    check_geometry(map.geometry);
    const auto [nx, ny, nz] = map.geometry.dims;
    using Counts = std::unordered_map<std::int64_t, std::int64_t>;
    tbb::enumerable_thread_specific<Counts> of_thread;
    internal::with_sample_type(map.type, [&, nx = nx, ny = ny, nz = nz](auto sample) {
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
    std::map<std::int64_t, std::int64_t> all;
    for (const Counts& counts : of_thread) {
        for (const auto& [label, samples] : counts) all[label] += samples;
    }
    return all;
}

}  // namespace marrow
