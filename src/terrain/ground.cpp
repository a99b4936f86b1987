// Extracts the surface of a block of heights.
//
// The volume holds only the sign of the density height - z: one byte per sample, extracted at 0.5. This gives
// the triangles, and the grid edge of each point, because the point is in the middle of its edge. The zero of
// the density on the edge then follows from the heights, in double: on a vertical edge it is the height
// itself; on a horizontal edge it is the crossing of the layer and the line between both heights.
#include "ground.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <marrow/isosurface.h>

namespace marrow::internal::terrain {

std::int64_t Grid::layer_below(double h) const {
    auto k = static_cast<std::int64_t>(std::floor((h - lowest_layer) / layer));
    // Rounding may be off by one; compare with the heights of the layers.
    while (height(k) > h) --k;
    while (height(k + 1) <= h) ++k;
    return k;
}

double Strip::operator()(std::int64_t i, std::int64_t j) const {
    const std::int64_t row = j - first_row;
    if (i < 0 || i >= grid.columns || j < 0 || j >= grid.rows)
        return std::numeric_limits<double>::quiet_NaN();
    return heights[static_cast<std::size_t>(row * grid.columns + i)];
}

namespace {

constexpr std::int64_t kNoGround = std::numeric_limits<std::int64_t>::min();

struct Edge {
    std::int64_t i, j, k;  // the lower end
    int axis;
};

// Horizontal edges across the raster's border have their point at the sample in the raster. All such edges of
// a sample share this point, so its name is the sample.
constexpr int kAtSample = 3;

std::uint64_t name_of(const Edge& e) {
    return static_cast<std::uint64_t>(e.i + 1) << 40 | static_cast<std::uint64_t>(e.j + 1) << 16 |
           static_cast<std::uint64_t>(e.k + 1) << 2 | static_cast<std::uint64_t>(e.axis);
}

class BlockExtractor {
  public:
    BlockExtractor(const Strip& strip, const Block& block)
        : strip_(strip), grid_(strip.grid), block_(block), width_(block.east - block.west + 1) {}

    BlockSurface extract() {
        if (!find_layers()) return {};
        const Volume inside = fill();
        const Mesh middles = extract_isosurface(inside, 0.5, {.normals = false, .threads = 1});
        BlockSurface surface;
        for (const Vec3f& middle : middles.points) add_point(edge_of(middle), surface);
        for (const Triangle& t : middles.triangles) {
            if (grid_.closed || is_known(cell_of(t, middles))) surface.triangles.push_back(t);
        }
        return surface;
    }

  private:
    // Finds the highest layer in the ground for each column, and the layers around the surface. Returns false
    // if no height is known.
    bool find_layers() {
        std::int64_t lowest = std::numeric_limits<std::int64_t>::max(), highest = kNoGround;
        for (std::int64_t j = block_.south; j <= block_.north; ++j) {
            for (std::int64_t i = block_.west; i <= block_.east; ++i) {
                const double h = strip_(i, j);
                top_.push_back(std::isnan(h) ? kNoGround : grid_.layer_below(h));
                if (top_.back() == kNoGround) continue;
                lowest = std::min(lowest, top_.back());
                highest = std::max(highest, top_.back());
            }
        }
        bottom_layer_ = grid_.closed ? -1 : lowest;
        top_layer_ = highest + 1;
        return highest != kNoGround;
    }

    Volume fill() const {
        Geometry g;
        g.dims = {width_, block_.north - block_.south + 1, top_layer_ - bottom_layer_ + 1};
        Volume inside(g, SampleType::uint8);
        std::uint8_t* sample = inside.samples<std::uint8_t>();
        for (std::int64_t k = bottom_layer_; k <= top_layer_; ++k) {
            const bool under = grid_.closed && k < 0;
            for (const std::int64_t top : top_) *sample++ = !under && k <= top;
        }
        return inside;
    }

    Edge edge_of(const Vec3f& middle) const {
        Edge e{block_.west, block_.south, bottom_layer_, 0};
        std::int64_t* const at[3] = {&e.i, &e.j, &e.k};
        for (int axis = 0; axis < 3; ++axis) {
            const float whole = std::floor(middle[static_cast<std::size_t>(axis)]);
            *at[axis] += static_cast<std::int64_t>(whole);
            if (middle[static_cast<std::size_t>(axis)] != whole) e.axis = axis;
        }
        return e;
    }

    void add_point(Edge e, BlockSurface& surface) const {
        const std::int64_t i2 = e.i + (e.axis == 0), j2 = e.j + (e.axis == 1);  // the upper end
        const double first = strip_(e.i, e.j), second = strip_(i2, j2);
        Vec3d p{static_cast<double>(e.i), static_cast<double>(e.j), grid_.height(e.k)};
        if (e.axis == 2) {
            p[2] = e.k < 0 && grid_.closed ? grid_.bottom : first;
        } else if (!in_raster(e.i, e.j)) {
            e = {i2, j2, e.k, kAtSample};
            p = {static_cast<double>(i2), static_cast<double>(j2), p[2]};
        } else if (!in_raster(i2, j2)) {
            e.axis = kAtSample;
        } else {
            const bool both = !std::isnan(first) && !std::isnan(second);
            p[static_cast<std::size_t>(e.axis)] += both ? (p[2] - first) / (second - first) : 0.5;
        }
        surface.points.push_back(p);
        surface.shared.push_back(is_shared(e) ? name_of(e) : BlockSurface::kOwn);
    }

    bool in_raster(std::int64_t i, std::int64_t j) const {
        return i >= 0 && i < grid_.columns && j >= 0 && j < grid_.rows;
    }

    bool is_shared(const Edge& e) const {
        return e.axis == kAtSample || (e.axis != 0 && (e.i == block_.west || e.i == block_.east)) ||
               (e.axis != 1 && (e.j == block_.south || e.j == block_.north));
    }

    // The south-western corner of the cell of a triangle. The centroid is inside the cell, because no
    // triangle lies in a face.
    std::array<std::int64_t, 2> cell_of(const Triangle& t, const Mesh& middles) const {
        const auto along = [&](std::size_t axis) {
            const float sum =
                middles.points[t[0]][axis] + middles.points[t[1]][axis] + middles.points[t[2]][axis];
            return static_cast<std::int64_t>(std::floor(sum / 3));
        };
        return {along(0), along(1)};
    }

    // Whether all four corners of a cell have a height. An open surface ends at other cells.
    bool is_known(const std::array<std::int64_t, 2>& cell) const {
        const auto* top = top_.data() + cell[1] * width_ + cell[0];
        return top[0] != kNoGround && top[1] != kNoGround && top[width_] != kNoGround &&
               top[width_ + 1] != kNoGround;
    }

    const Strip& strip_;
    const Grid& grid_;
    const Block block_;
    const std::int64_t width_;
    std::int64_t bottom_layer_ = 0, top_layer_ = 0;
    std::vector<std::int64_t> top_;
};

}  // namespace

BlockSurface extract_block(const Strip& strip, const Block& block) {
    return BlockExtractor(strip, block).extract();
}

}  // namespace marrow::internal::terrain
