// Writes Wavefront OBJ. Numbers have the fewest digits that read back to the same float, in any locale.
#include <charconv>

#include "writer.h"

namespace marrow::internal::io {
namespace {

constexpr int kFloatChars = 15;  // "-3.4028235e+38" and a space
constexpr int kIndexChars = 20;  // indices count through all meshes

char* put_vector(char* to, const char* keyword, const Vec3f& v) {
    while (*keyword) *to++ = *keyword++;
    for (const float x : v) {
        *to++ = ' ';
        to = std::to_chars(to, to + kFloatChars, x).ptr;
    }
    *to++ = '\n';
    return to;
}

char* put_index(char* to, std::uint64_t index) {
    return std::to_chars(to, to + kIndexChars, index).ptr;
}

// Indices count from the first point and normal of the file.
void write_object(MeshOutput& output, const MeshView& mesh, std::uint64_t points_before,
                  std::uint64_t normals_before) {
    constexpr std::size_t vector_chars = 3 + 3 * (kFloatChars + 1);
    output.items<vector_chars>(mesh.points.size(), 0, 0.3, [&](std::size_t i, char* to) {
        return put_vector(to, "v", output.oriented(mesh.points[i]));
    });
    output.items<vector_chars>(mesh.normals.size(), 0.3, 0.6, [&](std::size_t i, char* to) {
        return put_vector(to, "vn", output.oriented(mesh.normals[i]));
    });

    constexpr std::size_t face_chars = 2 + 3 * (2 * kIndexChars + 3);
    output.items<face_chars>(mesh.triangles.size(), 0.6, 1, [&](std::size_t i, char* to) {
        *to++ = 'f';
        for (const std::uint32_t corner : mesh.triangles[i]) {
            *to++ = ' ';
            to = put_index(to, points_before + corner + 1);
            if (mesh.normals.empty()) continue;
            *to++ = '/';
            *to++ = '/';
            to = put_index(to, normals_before + corner + 1);
        }
        *to++ = '\n';
        return to;
    });
}

}  // namespace

void write_obj(MeshOutput& output, MeshObjects objects) {
    output.text("# Marrow " + space_mark(output.space) + "\n");
    std::uint64_t points = 0, normals = 0;
    for (std::size_t i = 0; i < objects.size(); ++i) {
        output.set_share(i, objects.size());
        // Without a line of its own, an object would be a part of the one before it.
        if (objects.size() > 1 || !objects[i].name.empty()) {
            const std::string name = clean_name(name_or_number(objects, i));
            // A backslash at the end would continue the line.
            output.text("o " + name + (name.ends_with('\\') ? " \n" : "\n"));
        }
        write_object(output, objects[i].mesh, points, normals);
        points += objects[i].mesh.points.size();
        normals += objects[i].mesh.normals.size();
    }
}

}  // namespace marrow::internal::io
