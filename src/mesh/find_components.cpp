// Numbers the components of a mesh, and sums up their triangles and volumes.
#include "find_components.h"

#include <algorithm>

#include "base/parallel.h"
#include "mesh/connectivity/connected_points.h"
#include "mesh/geometry/triangle_corners.h"

namespace marrow::internal {

namespace {

constexpr std::size_t kSection = 8192;  // triangles; decides the last bits of volumes
constexpr std::size_t kGrain = 8192;    // points

// Triangles of a component that follow each other.
struct Run {
    std::uint32_t lowest;  // the lowest point of the component
    std::uint32_t first_triangle;
    std::int64_t triangles = 0;
    double volume = 0;
};

// Returns the runs of each section. Volumes are relative to the lowest point of the component, because
// distant coordinates would cancel.
std::vector<std::vector<Run>> find_runs(const MeshView& mesh, const Buffer<std::uint32_t>& lowest) {
    const std::size_t triangles = mesh.triangles.size();
    std::vector<std::vector<Run>> sections((triangles + kSection - 1) / kSection);
    parallel_for(std::size_t{0}, sections.size(), [&](std::size_t s) {
        const std::size_t end = std::min((s + 1) * kSection, triangles);
        for (std::size_t i = s * kSection; i < end;) {
            Run run{lowest[mesh.triangles[i][0]], static_cast<std::uint32_t>(i)};
            const Vec3d origin = to_double(mesh.points[run.lowest]);
            for (; i < end && lowest[mesh.triangles[i][0]] == run.lowest; ++i, ++run.triangles) {
                const auto [a, b, c] = corners_of(mesh, mesh.triangles[i]);
                run.volume += dot(a - origin, cross(b - origin, c - origin)) / 6;
            }
            sections[s].push_back(run);
        }
    });
    return sections;
}

// Numbers components by their lowest points, and gives each point the number of its component. Returns the
// number of components.
std::size_t number_points(const std::vector<std::vector<Run>>& sections, const Buffer<std::uint32_t>& lowest,
                          std::vector<std::uint32_t>& of_point) {
    of_point.assign(lowest.size(), Components::kNone);
    std::vector<std::uint32_t> lowest_points;
    for (const std::vector<Run>& runs : sections) {
        for (const Run& run : runs) {
            if (of_point[run.lowest] != Components::kNone) continue;
            of_point[run.lowest] = 0;  // marks it as seen
            lowest_points.push_back(run.lowest);
        }
    }
    std::sort(lowest_points.begin(), lowest_points.end());
    for (std::size_t i = 0; i < lowest_points.size(); ++i)
        of_point[lowest_points[i]] = static_cast<std::uint32_t>(i);
    parallel_for_ranges(std::size_t{0}, lowest.size(), kGrain, [&](const auto& range) {
        for (std::size_t p = range.begin(); p < range.end(); ++p) {
            if (lowest[p] != p) of_point[p] = of_point[lowest[p]];
        }
    });
    return lowest_points.size();
}

}  // namespace

Components find_components(const MeshView& mesh, const OneRings& rings) {
    Components components;
    const Buffer<std::uint32_t> lowest = lowest_connected_points(mesh);
    const std::vector<std::vector<Run>> sections = find_runs(mesh, lowest);
    components.all.resize(number_points(sections, lowest, components.of_point));
    for (const std::vector<Run>& runs : sections) {
        for (const Run& run : runs) {
            Component& component = components.all[components.of_point[run.lowest]];
            if (component.triangles == 0) component.first_triangle = run.first_triangle;
            component.triangles += run.triangles;
            component.volume += run.volume;
        }
    }
    rings.for_each_irregular([&](std::uint32_t p) { components.all[components.of_point[p]].closed = false; });
    return components;
}

}  // namespace marrow::internal
