// Wavefront OBJ: text. Shortest digits that read back to the same float; independent of the locale.
#include <charconv>

#include "mesh_output.h"

namespace marrow {
namespace {

constexpr int kFloatChars = 15;  // "-3.4028235e+38" and a space
constexpr int kIndexChars = 10;  // "4294967296"

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

}  // namespace

void write_obj(MeshOutput& output, const Mesh& mesh) {
    const auto& points = mesh.points;
    const auto& normals = mesh.normals;
    const auto& triangles = mesh.triangles;
    output.text("# Marrow " + space_mark(output.space) + "\n");

    constexpr std::size_t vector_chars = 3 + 3 * (kFloatChars + 1);
    output.items<vector_chars>(points.size(), 0, 0.3, [&](std::size_t i, char* to) {
        return put_vector(to, "v", output.oriented(points[i]));
    });
    output.items<vector_chars>(normals.size(), 0.3, 0.6, [&](std::size_t i, char* to) {
        return put_vector(to, "vn", output.oriented(normals[i]));
    });

    constexpr std::size_t face_chars = 2 + 3 * (2 * kIndexChars + 3);
    output.items<face_chars>(triangles.size(), 0.6, 1, [&](std::size_t i, char* to) {
        *to++ = 'f';
        for (const std::uint32_t corner : triangles[i]) {
            const std::uint64_t one_based = std::uint64_t{corner} + 1;
            *to++ = ' ';
            to = put_index(to, one_based);
            if (normals.empty()) continue;
            *to++ = '/';
            *to++ = '/';
            to = put_index(to, one_based);
        }
        *to++ = '\n';
        return to;
    });
}

}  // namespace marrow
