/// What is left round points that become one.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace marrow::internal {

/// The rim of a crowd: of each triangle with one corner in it, the edge between the others, in the triangle's
/// direction. Points that hang together without a hole have one rim, closed or, at the surface's border, open.
class Fan {
  public:
    /// Of points by their numbers, where `counts`.
    void add(std::uint32_t from, std::uint32_t to, bool counts) {
        edges_[size_ % kSlots] = {from, to};
        size_ += counts;
    }

    /// Whether the surface stays a manifold of the same topology when the crowd becomes one point and others'
    /// points become `joined`: whether no point is on the rim twice, neither as it is now nor as it will be.
    bool is_simple(const std::uint32_t* joined, bool open) const {
        if (size_ >= kSlots) return false;
        std::array<std::uint64_t, 4> seen{}, seen_joined{};  // bits, by the last eight of the numbers'
        std::uint64_t again = 0;
        std::uint32_t left = 0;
        for (std::uint32_t k = 0; k < size_; ++k) {
            const std::uint32_t from = edges_[k].from, a = joined[from], b = joined[edges_[k].to];
            const std::uint64_t bit = std::uint64_t{1} << from % 64;
            const std::uint64_t joined_bit = static_cast<std::uint64_t>(a != b) << a % 64;
            std::uint64_t &word = seen[from / 64 % 4], &joined_word = seen_joined[a / 64 % 4];
            again |= (word & bit) | (joined_word & joined_bit);
            word |= bit;
            joined_word |= joined_bit;
            left += a != b;
        }
        if (!open && left < 3) return false;
        if (!open && again == 0) return true;
        return is_simple_by_search(joined, open);
    }

  private:
    struct Edge {
        std::uint32_t from, to;
    };
    // One more than edges: where the next one goes, also one that does not count.
    static constexpr std::uint32_t kSlots = 16;

    bool is_simple_by_search(const std::uint32_t* joined, bool open) const {
        std::array<Edge, kSlots> left;
        std::uint32_t count = 0;
        for (std::uint32_t k = 0; k < size_; ++k) {
            const Edge edge{joined[edges_[k].from], joined[edges_[k].to]};
            for (std::uint32_t i = 0; i < k; ++i) {
                if (edges_[i].from == edges_[k].from || edges_[i].to == edges_[k].to) return false;
            }
            if (edge.from == edge.to) continue;
            for (std::uint32_t i = 0; i < count; ++i) {
                if (left[i].from == edge.from || left[i].to == edge.to) return false;
            }
            left[count++] = edge;
        }
        if (!open) return count >= 3;
        // The rim's one beginning must not be its end, too.
        for (std::uint32_t k = 0; k < count; ++k) {
            if (std::none_of(left.begin(), left.begin() + count,
                             [&](const Edge& edge) { return edge.to == left[k].from; }))
                return true;
        }
        return false;
    }

    std::uint32_t size_ = 0;
    std::array<Edge, kSlots> edges_;
};

}  // namespace marrow::internal
