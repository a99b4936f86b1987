/// The triangle mesh that Marrow extracts, changes, measures and writes.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <marrow/buffer.h>
#include <marrow/vector.h>

namespace marrow {

/// The indices of a triangle's points, counter-clockwise as seen from outside.
using Triangle = std::array<std::uint32_t, 3>;

/// A triangle mesh whose triangles share their points.
struct Mesh {
    Buffer<Vec3f> points;        ///< mm, in the patient space of the volume (LPS)
    Buffer<Vec3f> normals;       ///< one outward unit vector per point, or empty
    Buffer<Triangle> triangles;  ///< indices into `points`
};

// With it, clang warns of a view that outlives a temporary mesh.
#if __has_cpp_attribute(clang::lifetimebound)
#define MARROW_LIFETIMEBOUND [[clang::lifetimebound]]
#else
#define MARROW_LIFETIMEBOUND
#endif

/// A borrowed mesh, for functions that only read one. The arrays must outlive the view and not be resized.
struct MeshView {
    MeshView() = default;
    MeshView(const Mesh& mesh MARROW_LIFETIMEBOUND)
        : points(mesh.points), normals(mesh.normals), triangles(mesh.triangles) {}
    MeshView(std::span<const Vec3f> point_span, std::span<const Triangle> triangle_span,
             std::span<const Vec3f> normal_span = {})
        : points(point_span), normals(normal_span), triangles(triangle_span) {}

    std::span<const Vec3f> points;
    std::span<const Vec3f> normals;  ///< one per point, or empty
    std::span<const Triangle> triangles;
};

/// A borrowed mesh that is kept for later, and so cannot be a temporary one.
struct KeptMeshView : MeshView {
    using MeshView::MeshView;
    KeptMeshView(const MeshView& view) : MeshView(view) {}
    KeptMeshView(const Mesh&&) = delete;  // the view would outlive its arrays
};

}  // namespace marrow
