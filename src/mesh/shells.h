/// The connected pieces of a mesh, measured one by one.
#pragma once

#include <cstdint>
#include <vector>

#include <marrow/mesh.h>

namespace marrow::internal {

/// Triangles connected through shared points.
struct Shell {
    std::uint32_t first_triangle = 0;
    std::int64_t triangles = 0;
    double volume = 0;   ///< mm^3 enclosed; negative where it faces inward
    bool closed = true;  ///< every edge has two triangles, which agree in orientation

    /// The wall of a hollow. An open shell encloses nothing, so that it is none.
    bool is_cavity() const { return closed && volume < 0; }
};

struct Shells {
    std::vector<Shell> all;               ///< in the order of their lowest points
    std::vector<std::uint32_t> of_point;  ///< kNoShell where no triangle has it
    static constexpr std::uint32_t kNoShell = ~std::uint32_t{0};

    std::uint32_t of(const Triangle& t) const { return of_point[t[0]]; }
};

/// In near-linear time. \pre triangles name points that are there
Shells find_shells(const Mesh& mesh);

}  // namespace marrow::internal
