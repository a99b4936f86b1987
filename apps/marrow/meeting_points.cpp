#include "meeting_points.h"

#include <algorithm>

#include <fmt/format.h>

#include <marrow/mesh_io.h>

namespace marrow {
namespace {

std::size_t meeting_points(const Mesh& mesh) {
    std::vector<Vec3f> points(mesh.points.begin(), mesh.points.end());
    std::sort(points.begin(), points.end());
    std::size_t meeting = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
        meeting +=
            (i > 0 && points[i] == points[i - 1]) || (i + 1 < points.size() && points[i] == points[i + 1]);
    return meeting;
}

}  // namespace

void warn_of_meeting_points(const std::vector<Surface>& surfaces, const std::string& remedy,
                            std::vector<std::string>& warnings) {
    std::size_t points = 0, files = 0;
    for (const Surface& surface : surfaces) {
        if (surface.output.empty() || mesh_format(surface.output) != MeshFormat::stl) continue;
        const std::size_t meeting = meeting_points(surface.mesh);
        points += meeting;
        files += meeting > 0;
    }
    if (points > 0)
        warnings.push_back(fmt::format(
            "{} points in {} of {} surfaces lie where others do; STL cannot keep them apart, so a "
            "reader may find edges that more than two triangles share: {}",
            points, files, surfaces.size(), remedy));
}

}  // namespace marrow
