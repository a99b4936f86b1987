// Smooths a mesh, reduces its triangles within a bound on the error, and checks that it can be printed.
//
//     example_simplify MESH RESULT
#include <marrow/marrow.h>

#include <cstdio>

int main(int argc, char** argv) try {
    if (argc != 3) throw marrow::InputError("usage: example_simplify MESH RESULT");
    const marrow::Mesh mesh = marrow::read_mesh(argv[1]);

    const marrow::Mesh smoothed = marrow::smooth(mesh, {.iterations = 20});
    marrow::SimplifyStats stats;
    const marrow::Mesh reduced = marrow::simplify(smoothed, {.max_error = 0.1}, &stats);  // mm
    std::printf("%zu triangles became %zu, at most %.2f mm away\n", mesh.triangles.size(),
                reduced.triangles.size(), stats.deviation.max);

    const marrow::MeshCheck check = marrow::check_mesh(reduced, {.min_wall = 0.8});  // mm
    std::printf("closed: %d, manifold: %d, thin triangles: %lld\n", check.is_closed(), check.is_manifold(),
                static_cast<long long>(check.thin_triangles));
    marrow::write_mesh(reduced, argv[2]);
    return check.is_sound() ? 0 : 1;
} catch (const marrow::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
