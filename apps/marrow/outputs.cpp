// Names, checks, writes and verifies the files of surfaces.
#include "outputs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string_view>

#include <fmt/format.h>

#include "shared/console.h"
#include "shared/output_checks.h"
#include "shared/report_progress.h"
#include "trust_steps.h"

namespace marrow::apps {
namespace fs = std::filesystem;
namespace {

std::map<fs::path, std::vector<MeshObject>> objects_by_file(const std::vector<Surface>& surfaces) {
    std::map<fs::path, std::vector<MeshObject>> objects;
    for (const Surface& surface : surfaces) {
        if (surface.output.empty()) continue;
        auto& of_file = objects[surface.output];
        of_file.push_back({surface.mesh, surface.name, surface.colour});
        add_point_data(surface, of_file.back());
    }
    return objects;
}

bool is_one_of(MeshFormat format, MeshFormat first, MeshFormat second) {
    return format == first || format == second;
}

MeshFormat format_of(const fs::path& file) {
    try {
        return mesh_format(file);
    } catch (const InputError& error) {
        throw UsageError(error.what());
    }
}

// Calls fail(index) for the first triangle whose corners differ by more than tolerance(coordinate).
template <class Tolerance, class Fail>
void compare_triangles(std::span<const MeshObject> objects, const Mesh& found, const Tolerance& tolerance,
                       const Fail& fail) {
    std::size_t at = 0;
    for (const MeshObject& object : objects) {
        for (const Triangle& t : object.mesh.triangles) {
            for (std::size_t c = 0; c < 3; ++c) {
                const Vec3f &a = object.mesh.points[t[c]], &b = found.points[found.triangles[at][c]];
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    if (!(std::abs(a[axis] - b[axis]) <= tolerance(a[axis]))) fail(at);
                }
            }
            ++at;
        }
    }
}

}  // namespace

std::vector<fs::path> files_for(const fs::path& output, const std::vector<std::string>& names) {
    std::vector<fs::path> files(names.size());
    if (output.empty()) return files;
    if (output == "-")
        throw UsageError(
            "a mesh cannot be written to standard output, where its reader could not tell a complete mesh "
            "from a "
            "part: give -o FILE");
    std::string pattern = output.string();
    std::error_code ignored;
    if (!output.has_filename() || fs::is_directory(output, ignored))
        pattern = (output / "{name}.stl").string();
    format_of(pattern);
    const bool is_pattern = pattern.find(kNamePlaceholder) != pattern.npos;
    const auto with_name = [&pattern](const std::string& name) {
        std::string file = pattern;
        for (std::size_t at = file.find(kNamePlaceholder); at != file.npos;
             at = file.find(kNamePlaceholder, at + name.size()))
            file.replace(at, kNamePlaceholder.size(), name);
        return file;
    };
    if (has_placeholder(with_name("")))
        throw UsageError(fmt::format("'{}' has a placeholder that does not exist: the only one is {}",
                                     pattern, kNamePlaceholder));
    std::transform(names.begin(), names.end(), files.begin(), with_name);
    if (is_pattern && std::set<fs::path>(files.begin(), files.end()).size() < files.size())
        throw UsageError("two surfaces of the same name would be written to one file: give each only once");
    return files;
}

bool is_shared_file(const std::vector<fs::path>& files) {
    return files.size() > 1 && !files[0].empty() && files[0] == files[1];
}

bool is_dicom_output(const fs::path& output) {
    std::error_code ignored;
    return !output.empty() && output.has_filename() && output != "-" && !fs::is_directory(output, ignored) &&
           format_of(output) == MeshFormat::dicom;
}

std::vector<fs::path> surface_files(const fs::path& output, Space space,
                                    const std::vector<std::string>& names) {
    std::vector<fs::path> files = files_for(output, names);
    if (output.empty() || files.empty()) return files;
    const MeshFormat format = format_of(files.front());
    if (has_fixed_axes(format) && space != Space::LPS)
        throw UsageError("--space does not go with .glb and .dcm, whose axes are fixed");
    if (is_shared_file(files) && !holds_several(format))
        throw UsageError(
            fmt::format("the file '{}' can hold only one surface: give a .3mf, .glb, .vtp or .obj file, a "
                        "folder, or a pattern such as '{{name}}.stl'",
                        files.front().string()));
    return files;
}

void write_surfaces(const std::vector<Surface>& surfaces, const MeshWriteOptions& options) {
    MeshFiles files;
    for (const auto& [file, objects] : objects_by_file(surfaces)) files.write(objects, file, options);
    files.commit();
}

void verify_surfaces(const std::vector<Surface>& surfaces, Space space, const Progress& progress) {
    const auto by_file = objects_by_file(surfaces);
    const auto files = static_cast<double>(by_file.size());
    double read = 0;
    for (const auto& [file, objects] : by_file) {
        verify(objects, file, space, share_of(progress, read / files, (read + 1) / files));
        ++read;
    }
}

void verify(std::span<const MeshObject> objects, const fs::path& file, Space space,
            const Progress& progress) {
    const auto fail = [&](const std::string& why) {
        throw CheckFailed(fmt::format("'{}' differs from what was written: {}", file.string(), why));
    };
    Space stated = Space::none;
    const Mesh found = read_mesh(file, &stated, progress);
    if (stated != space) fail("it states another space");
    std::size_t points = 0, triangles = 0;
    for (const MeshObject& object : objects) {
        points += object.mesh.points.size();
        triangles += object.mesh.triangles.size();
    }
    if (found.triangles.size() != triangles)
        fail(fmt::format("it has {} triangles instead of {}", found.triangles.size(), triangles));
    const MeshFormat format = mesh_format(file);
    // STL has no list of points: the reader merges those of the same coordinates.
    if (found.points.size() != points && !is_one_of(format, MeshFormat::stl, MeshFormat::dicom))
        fail(fmt::format("it has {} points instead of {}", found.points.size(), points));
    // A coordinate is rounded twice on its way to metres and back; tiny ones to a step of the least floats.
    const auto tolerance = [&](float coordinate) {
        using Limits = std::numeric_limits<float>;
        return format == MeshFormat::glb
                   ? Limits::epsilon() * std::abs(coordinate) + 1000 * Limits::denorm_min()
                   : 0;
    };
    compare_triangles(objects, found, tolerance, [&](std::size_t triangle) {
        fail(fmt::format("triangle {} has other corners or another orientation", triangle));
    });
}

}  // namespace marrow::apps
