// Spans the bands of a tunnel between its loops and its ring.
#include "tunnel_triangles.h"

#include <algorithm>
#include <compare>
#include <functional>
#include <optional>
#include <queue>
#include <span>
#include <vector>

#include "tunnel_bands.h"
#include "tunnel_crossings.h"

namespace marrow::internal {

namespace {

using Loop = std::span<const std::uint8_t>;
using Points = TunnelTriangles::Points;

Points points_of(const CellTopology& topology, const CellValues& f) {
    Points points{};
    for (std::size_t edge = 0; edge < kCellEdges; ++edge) {
        if ((topology.shape().crossed >> edge & 1) != 0) points[edge] = edge_point(f, edge);
    }
    std::array<Vec3d, CellTopology::kTunnelPoints> ring;
    place_inner_points(topology, f, ring);
    std::copy(ring.begin(), ring.end(), points.begin() + kCellEdges);
    return points;
}

// A loop, and the squared distances of its points from those of the ring.
struct TunnelEnd {
    Loop loop;
    Band::Distances squared;

    TunnelEnd(Loop edges, const Points& points) : loop(edges) {
        for (std::size_t i = 0; i < loop.size(); ++i) {
            for (std::size_t j = 0; j < Band::kRing; ++j) {
                const Vec3d link = points[kCellEdges + j] - points[loop[i]];
                squared[i][j] = dot(link, link);
            }
        }
    }
};

void add_band(Loop loop, const Band& band, TunnelTriangles& triangles) {
    const auto ring = [&](std::size_t step) { return kCellEdges + band.ring_point(step); };
    std::size_t j = 0;
    for (std::size_t i = 0; i < loop.size(); ++i) {
        for (std::size_t step = 0; step < band.steps[i]; ++step, ++j)
            triangles.add(loop[i], ring(j + 1), ring(j));
        triangles.add(loop[i], loop[(i + 1) % loop.size()], ring(j));
    }
}

// A cell with a tunnel, and the triangles that its bands give.
class TunnelCell {
  public:
    TunnelCell(const CellTopology& topology, const CellValues& f)
        : topology_(topology),
          points_(points_of(topology, f)),
          first_(topology.shape().loop(topology.tunnel.first_loop), points_),
          second_(topology.shape().loop(topology.tunnel.second_loop), points_) {}

    // The surface runs around the tunnel: seen along it, one loop is clockwise, and the other
    // counter-clockwise. So their bands go around the ring in opposite directions.
    TunnelTriangles of_shortest_bands() const {
        const auto firsts = shortest_bands(first_.squared, first_.loop.size()),
                   seconds = shortest_bands(second_.squared, second_.loop.size());
        const std::size_t backwards =
            firsts[0].cost + seconds[1].cost <= firsts[1].cost + seconds[0].cost ? 0 : 1;
        return triangles_of(firsts[backwards], seconds[1 - backwards]);
    }

    // The shortest pair of bands whose triangles do not cross. No cell is known that has none.
    std::optional<TunnelTriangles> without_crossings() const {
        std::array<std::vector<Band>, 2> firsts, seconds;
        // For each of the firsts, the shortest pair that was not tried yet.
        std::priority_queue<BandPair, std::vector<BandPair>, std::greater<>> pairs;
        const auto add = [&](std::size_t backwards, std::size_t i, std::size_t j) {
            if (j < seconds[backwards].size())
                pairs.push({firsts[backwards][i].cost + seconds[backwards][j].cost, backwards, i, j});
        };
        for (std::size_t backwards = 0; backwards < 2; ++backwards) {
            firsts[backwards] = all_bands(first_.squared, first_.loop.size(), backwards != 0);
            seconds[backwards] = all_bands(second_.squared, second_.loop.size(), backwards == 0);
            for (std::size_t i = 0; i < firsts[backwards].size(); ++i) add(backwards, i, 0);
        }
        while (!pairs.empty()) {
            const auto [cost, backwards, i, j] = pairs.top();
            pairs.pop();
            const TunnelTriangles triangles = triangles_of(firsts[backwards][i], seconds[backwards][j]);
            if (!has_crossings(triangles)) return triangles;
            add(backwards, i, j + 1);
        }
        return {};
    }

    bool has_crossings(const TunnelTriangles& triangles) const {
        return have_crossings(triangles, points_, topology_.shape().loops);
    }

  private:
    struct BandPair {
        double cost;
        std::size_t backwards, first, second;  // which direction and bands

        auto operator<=>(const BandPair&) const = default;
    };

    TunnelTriangles triangles_of(const Band& first, const Band& second) const {
        TunnelTriangles triangles;
        add_band(first_.loop, first, triangles);
        add_band(second_.loop, second, triangles);
        for (std::size_t k = 0; k < topology_.shape().loops; ++k) {
            if (k == topology_.tunnel.first_loop || k == topology_.tunnel.second_loop) continue;
            const Loop loop = topology_.shape().loop(k);  // a triangle
            triangles.add(loop[0], loop[1], loop[2]);
        }
        return triangles;
    }

    const CellTopology& topology_;
    const Points points_;
    const TunnelEnd first_, second_;
};

}  // namespace

void TunnelTriangles::add(std::size_t a, std::size_t b, std::size_t c) {
    std::uint8_t* to = corners.data() + 3 * count++;
    to[0] = static_cast<std::uint8_t>(a);
    to[1] = static_cast<std::uint8_t>(b);
    to[2] = static_cast<std::uint8_t>(c);
}

TunnelTriangles triangulate_tunnel(const CellTopology& topology, const CellValues& values) {
    const TunnelCell cell(topology, well_scaled(values));
    const TunnelTriangles shortest = cell.of_shortest_bands();
    if (!cell.has_crossings(shortest)) return shortest;
    return cell.without_crossings().value_or(shortest);
}

}  // namespace marrow::internal
