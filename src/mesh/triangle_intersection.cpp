#include "triangle_intersection.h"

#include <algorithm>
#include <cmath>

#include <marrow/vector.h>

namespace marrow::internal {

namespace {

// A sum of doubles without rounding: parts that do not overlap, the smallest first. After Shewchuk 1997.
class ExactSum {
  public:
    // Every part of what is left of the products below, 48 of four parts each.
    static constexpr std::size_t kMost = 192;

    void add(double x) {
        std::size_t kept = 0;
        for (std::size_t i = 0; i < count_; ++i) {
            const double sum = x + parts_[i], back = sum - x;
            const double lost = (x - (sum - back)) + (parts_[i] - back);
            if (lost != 0) parts_[kept++] = lost;
            x = sum;
        }
        if (x != 0) parts_[kept++] = x;
        count_ = kept;
    }
    void add_product(double x, double y, double z) {
        const double xy = x * y, lost = std::fma(x, y, -xy);
        for (const double part : {xy, lost}) {
            const double product = part * z;
            add(product);
            add(std::fma(part, z, -product));
        }
    }
    int sign() const { return count_ == 0 ? 0 : parts_[count_ - 1] > 0 ? 1 : -1; }

  private:
    std::array<double, kMost> parts_;
    std::size_t count_ = 0;
};

// A difference of doubles without rounding: the rounded one, and what was lost.
using ExactDifference = std::array<double, 2>;

ExactDifference exact_difference(double x, double y) {
    const double difference = x - y, back = x - difference;
    return {difference, (x - (difference + back)) + (back - y)};
}

int exact_side_of(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
    std::array<ExactDifference, 3> u, v, w;
    for (std::size_t i = 0; i < 3; ++i) {
        u[i] = exact_difference(b[i], a[i]);
        v[i] = exact_difference(c[i], a[i]);
        w[i] = exact_difference(d[i], a[i]);
    }
    ExactSum determinant;
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        for (const double x : u[i]) {
            for (std::size_t n = 0; n < 4; ++n) {
                determinant.add_product(x, v[j][n / 2], w[k][n % 2]);
                determinant.add_product(-x, v[k][n / 2], w[j][n % 2]);
            }
        }
    }
    return determinant.sign();
}

// A triangle turned so that its corner `alone` comes first.
struct Turned {
    Vec3d alone, next, last;
    int side = 0;  // on which `alone` lies of the plane
    Cut cut;
};

std::optional<Turned> turn(const std::array<Vec3d, 3>& s, const std::array<int, 3>& side) {
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        // With one corner in the plane and both others on one side of it, only that corner is shared.
        if (side[i] == 0 || side[i] * side[j] > 0 || side[i] * side[k] > 0) continue;
        return Turned{s[i], s[j], s[k], side[i], {i, side[j] != 0 ? j : side[k] != 0 ? k : Cut::kNone}};
    }
    return {};
}

std::array<int, 3> sides_of(const std::array<Vec3d, 3>& s, const std::array<Vec3d, 3>& t) {
    return {side_of(t[0], t[1], t[2], s[0]), side_of(t[0], t[1], t[2], s[1]),
            side_of(t[0], t[1], t[2], s[2])};
}

}  // namespace

int side_of(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
    constexpr double kRounding = 1e-14;  // several times what the products and sums below can lose
    const Vec3d u = b - a, v = c - a, w = d - a;
    const double determinant = dot(u, cross(v, w));
    double size = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        size += std::abs(u[i]) * (std::abs(v[j] * w[k]) + std::abs(v[k] * w[j]));
    }
    if (std::abs(determinant) > kRounding * size) return determinant > 0 ? 1 : -1;
    if (size == 0 || d == a || d == b || d == c) return 0;
    return exact_side_of(a, b, c, d);
}

// After Devillers and Guigue 2002: both triangles meet the line that their planes share in a stretch of it, from the
// edge alone-next to alone-last. Which end comes first is the side of one such edge on which another lies.
std::optional<Meeting> meet(const std::array<Vec3d, 3>& given_s, const std::array<Vec3d, 3>& given_t) {
    auto s = turn(given_s, sides_of(given_s, given_t));
    if (!s) return {};
    auto t = turn(given_t, sides_of(given_t, given_s));
    if (!t) return {};
    // To turn a triangle over turns its plane over, and so exchanges the sides on which the other one lies.
    if (s->side < 0) std::swap(t->next, t->last);
    if (t->side < 0) std::swap(s->next, s->last);
    if (side_of(s->alone, s->next, t->alone, t->next) >= 0 ||
        side_of(s->alone, s->last, t->alone, t->last) <= 0)
        return {};
    return Meeting{s->cut, t->cut};
}

bool sheets_cross(const Vec3d& p, const Vec3d& q, const std::array<Vec3d, 2>& a,
                  const std::array<Vec3d, 2>& b) {
    // 1: a place lies between a[0] and a[1], going round from the first; -1: between them the other way; 0: neither.
    const int turn = side_of(p, q, a[0], a[1]);
    const auto sector = [&](const Vec3d& place) {
        const int from = side_of(p, q, a[0], place), to = side_of(p, q, place, a[1]);
        const bool both_on = from > 0 && to > 0, both_off = from < 0 && to < 0;
        if (turn < 0 ? from > 0 || to > 0 : both_on) return 1;
        return (turn > 0 ? from < 0 || to < 0 : both_off) ? -1 : 0;
    };
    return sector(b[0]) * sector(b[1]) < 0;
}

}  // namespace marrow::internal
