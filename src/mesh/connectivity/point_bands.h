/// Divides the points of a mesh into bands, for work at points that goes over the triangles around them.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <marrow/mesh.h>

#include "base/parallel.h"

namespace marrow::internal {

/// The lowest and the highest index of some points.
using Reach = std::array<std::uint32_t, 2>;

/// Extends a reach to these points.
void extend_reach(Reach& reach, std::span<const std::uint32_t> points);

/// Bands of points with successive indices. Each thread takes bands of its own, so that it alone writes what
/// belongs to their points, which usually fits into a cache. Triangles and points mostly have a similar
/// order, so that few triangles concern several bands.
class PointBands {
  public:
    /// The width of a band is a multiple of this.
    static constexpr std::size_t kChunk = 512;

    /// The array of the triangles must outlive this. \pre indices are in range
    explicit PointBands(const MeshView& mesh);

    /// The points [begin, end).
    struct Band {
        std::size_t index, begin, end;

        std::size_t size() const { return end - begin; }
        bool contains(std::uint32_t p) const { return p - begin < end - begin; }
    };

    std::size_t size() const { return (points_ + width_ - 1) / width_; }
    /// The most points of a band.
    std::size_t width() const { return width_; }

    /// Calls f(band) for each band, on all threads.
    template <class F>
    void for_each(const F& f) const {
        parallel_for(std::size_t{0}, size(), [&](std::size_t i) {
            f(Band{i, i * width_, std::min((i + 1) * width_, points_)});
        });
    }

    /// Calls f(t, is_inside) for the triangles with corners in a band, and for some others, in ascending
    /// order. is_inside(p) says whether a corner is in the band; for sections of triangles that are inside as
    /// a whole, it is the constant true.
    template <class F>
    void for_each_triangle(const Band& band, const F& f) const {
        for (std::size_t s = 0; s < reaches_.size(); ++s) {
            in_section(s, band, [&](std::size_t begin, std::size_t end, const auto& is_inside) {
                for (std::size_t t = begin; t < end; ++t) f(t, is_inside);
            });
        }
    }

    /// The same in descending order.
    template <class F>
    void for_each_triangle_backward(const Band& band, const F& f) const {
        for (std::size_t s = reaches_.size(); s-- > 0;) {
            in_section(s, band, [&](std::size_t begin, std::size_t end, const auto& is_inside) {
                for (std::size_t t = end; t-- > begin;) f(t, is_inside);
            });
        }
    }

  private:
    static constexpr std::size_t kSection = 8192;  // triangles

    // Calls f(begin, end, is_inside) for the triangles of a section, if any has a corner in the band.
    template <class F>
    void in_section(std::size_t section, const Band& band, const F& f) const {
        const auto [lowest, highest] = reaches_[section];
        if (highest < band.begin || lowest >= band.end) return;
        const std::size_t begin = section * kSection, end = std::min(begin + kSection, triangles_);
        if (lowest >= band.begin && highest < band.end)
            f(begin, end, [](std::uint32_t) { return true; });
        else
            f(begin, end, [&](std::uint32_t p) { return band.contains(p); });
    }

    const std::size_t points_, triangles_;
    std::vector<Reach> reaches_;  // of the sections of successive triangles
    std::size_t width_;
};

}  // namespace marrow::internal
