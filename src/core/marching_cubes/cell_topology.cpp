// Decides ambiguous faces and tunnels by predicates that never round.
#include "cell_topology.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/exact_sum.h"

namespace marrow::internal {

namespace {

// The magnitudes of scaled values. The polynomials that decide about tunnels are sums of products of four, so
// neither these nor the rounding errors of their terms overflow or underflow.
constexpr double kLargest = 0x1p200, kLeast = 0x1p-240;

int sign_of(double x) {
    return x > 0 ? 1 : x < 0 ? -1 : 0;
}

// The sign of ad - bc. Rounding is monotonic, so rounded products are never in the wrong order.
int determinant_sign(double a, double b, double c, double d) {
    const double ad = a * d, bc = b * c;
    if (ad != bc) return ad > bc ? 1 : -1;
    const double lost_ad = std::fma(a, d, -ad), lost_bc = std::fma(b, c, -bc);
    return sign_of(lost_ad - lost_bc);
}

// The sign of f[0] f[3] - f[1] f[2], whatever their magnitudes are.
int determinant_sign_of_any(const std::array<double, 4>& f) {
    std::array<double, 4> fractions;
    std::array<int, 4> exponents;
    for (std::size_t i = 0; i < 4; ++i) fractions[i] = std::frexp(f[i], &exponents[i]);
    // Products of fractions are 0, or from 1/4 to 1. So a larger shift would give the same sign.
    const int shift = std::clamp(exponents[0] + exponents[3] - exponents[1] - exponents[2], -4, 4);
    return determinant_sign(std::ldexp(fractions[0], shift), fractions[1], fractions[2], fractions[3]);
}

// Whether the two inside corners of an ambiguous face are joined, if rounded products do not show it: whether
// the bilinear interpolant at its saddle, (inside product - outside product) / (a positive number), is at
// least the isovalue. In a tie it is.
bool joins_in_doubt(const CellValues& values, unsigned face) {
    const auto& ring = kFaceCorners[face];
    const std::array<double, 4> f{values[ring[0]], values[ring[1]], values[ring[3]], values[ring[2]]};
    if (std::any_of(f.begin(), f.end(), [](double v) { return std::isnan(v); })) return false;
    const int sign = determinant_sign_of_any(f);
    return f[0] >= 0 ? sign >= 0 : sign <= 0;
}

// Bit f of a case: corner 0 of face f is inside.
constexpr std::array<std::uint8_t, 256> kFirstInside = [] {
    std::array<std::uint8_t, 256> faces{};
    for (std::size_t c = 0; c < 256; ++c) {
        for (unsigned face = 0; face < 6; ++face)
            faces[c] |= static_cast<std::uint8_t>((c >> kFaceCorners[face][0] & 1) << face);
    }
    return faces;
}();

// The place of a shape among those of its case, by the ambiguous faces and the joined ones: bit k is set if
// the k-th ambiguous face is joined.
constexpr std::array<std::array<std::uint8_t, 64>, 64> kShapePlace = [] {
    std::array<std::array<std::uint8_t, 64>, 64> places{};
    for (unsigned ambiguous = 0; ambiguous < 64; ++ambiguous) {
        for (unsigned joined = 0; joined < 64; ++joined) {
            unsigned place = 0, bit = 1;
            for (unsigned left = ambiguous; left != 0; left &= left - 1, bit <<= 1)
                place += bit * (joined >> std::countr_zero(left) & 1);
            places[ambiguous][joined] = static_cast<std::uint8_t>(place);
        }
    }
    return places;
}();

// The ambiguous faces whose inside corners are joined.
unsigned joined_faces(const CellBatch& batch, std::size_t cell, unsigned cell_case, FaceSigns signs) {
    const unsigned ambiguous = kAmbiguousFaces[cell_case], first_inside = kFirstInside[cell_case];
    unsigned joined = (first_inside & signs.positive()) | (~first_inside & signs.negative());
    for (unsigned left = ambiguous & ~(signs.positive() | signs.negative()); left != 0; left &= left - 1) {
        const auto face = static_cast<unsigned>(std::countr_zero(left));
        if (joins_in_doubt(batch.values(cell), face)) joined |= 1u << face;
    }
    return joined & ambiguous;
}

// What is added to the determinant of a face per amount that is added to its values.
std::array<double, 4> growth_terms(double f00, double f01, double f10, double f11) {
    return {f00, f11, -f01, -f10};
}

template <std::size_t N>
int exact_sign(const std::array<double, N>& terms) {
    ExactSum sum;
    for (const double t : terms) sum.add(t);
    return sum.sign();
}

int sign_with_ties(double f00, double f01, double f10, double f11) {
    const int sign = determinant_sign(f00, f01, f10, f11);
    return sign != 0 ? sign : exact_sign(growth_terms(f00, f01, f10, f11));
}

// A sum, and the sum of the magnitudes of its terms. They bound the rounding error of a few additions and
// multiplications.
struct Bounded {
    double value, magnitude;

    int certain_sign() const {
        constexpr double kRounding = 16 * 0x1p-53;
        return std::abs(value) > kRounding * magnitude ? sign_of(value) : 0;
    }
};

Bounded operator+(Bounded a, Bounded b) {
    return {a.value + b.value, a.magnitude + b.magnitude};
}
Bounded operator-(Bounded a, Bounded b) {
    return {a.value - b.value, a.magnitude + b.magnitude};
}
Bounded operator*(Bounded a, Bounded b) {
    return {a.value * b.value, a.magnitude * b.magnitude};
}
Bounded bounded(double x) {
    return {x, std::abs(x)};
}
Bounded product(double x, double y) {
    return bounded(x * y);
}

// The terms whose sum is exactly the difference of the products of pairs.
template <std::size_t N>
std::array<double, 2 * N> product_terms(const std::array<std::array<double, 2>, N>& pairs) {
    std::array<double, 2 * N> terms;
    for (std::size_t i = 0; i < N; ++i) {
        const auto [x, y] = pairs[i];
        terms[2 * i] = x * y;
        terms[2 * i + 1] = std::fma(x, y, -terms[2 * i]);
    }
    return terms;
}

// The terms of the polynomials in a cell's values that decide about tunnels, on one axis. See
// docs/algorithm.md.
struct TunnelTerms {
    std::array<double, 4> d0, d1;            // the determinants of the two faces
    std::array<double, 8> mixed;             // the mixed determinant
    std::array<double, 4> growth0, growth1;  // of the determinants with the values
    std::array<double, 8> growth;            // of the mixed determinant: the sum of both

    explicit TunnelTerms(const OppositeFaces& s)
        : d0(product_terms<2>({{{s.p00, s.p11}, {-s.p01, s.p10}}})),
          d1(product_terms<2>({{{s.q00, s.q11}, {-s.q01, s.q10}}})),
          mixed(product_terms<4>({{{s.p00, s.q11}, {s.p11, s.q00}, {-s.p01, s.q10}, {-s.p10, s.q01}}})),
          growth0(growth_terms(s.p00, s.p01, s.p10, s.p11)),
          growth1(growth_terms(s.q00, s.q01, s.q10, s.q11)) {
        std::copy(growth0.begin(), growth0.end(), growth.begin());
        std::copy(growth1.begin(), growth1.end(), growth.begin() + 4);
    }
};

template <class A, class B>
void add_products(ExactSum& sum, double factor, const A& a, const B& b) {
    for (const double x : a) {
        for (const double y : b) sum.add_product(factor * x, y);
    }
}

int exact_hyperdeterminant_sign(const TunnelTerms& t) {
    ExactSum sum;
    add_products(sum, 1, t.mixed, t.mixed);
    add_products(sum, -4, t.d0, t.d1);
    return sum.sign();
}

int exact_level_sign(const TunnelTerms& t) {
    ExactSum sum;
    add_products(sum, 1, t.mixed, t.growth);
    add_products(sum, -2, t.d0, t.growth1);
    add_products(sum, -2, t.d1, t.growth0);
    return sum.sign();
}

// The same polynomials with rounding, and bounds of it.
struct RoundedTerms {
    Bounded d0, d1, mixed, growth0, growth1;

    explicit RoundedTerms(const OppositeFaces& s)
        : d0(product(s.p00, s.p11) - product(s.p01, s.p10)),
          d1(product(s.q00, s.q11) - product(s.q01, s.q10)),
          mixed((product(s.p00, s.q11) + product(s.p11, s.q00)) -
                (product(s.p01, s.q10) + product(s.p10, s.q01))),
          growth0((bounded(s.p00) + bounded(s.p11)) - (bounded(s.p01) + bounded(s.p10))),
          growth1((bounded(s.q00) + bounded(s.q11)) - (bounded(s.q01) + bounded(s.q10))) {}
};

// The sign of the mixed determinant; in a tie that of its growth.
int mixed_sign(const OppositeFaces& s) {
    if (const int sign = RoundedTerms(s).mixed.certain_sign(); sign != 0) return sign;
    const TunnelTerms terms(s);
    const int sign = exact_sign(terms.mixed);
    return sign != 0 ? sign : exact_sign(terms.growth);
}

// Half of what the hyperdeterminant grows by with the values. At a body saddle in a tunnel it has the sign of
// the interpolant.
int level_sign(const OppositeFaces& s) {
    const RoundedTerms r(s);
    const Bounded two = bounded(2);
    const Bounded level = r.mixed * (r.growth0 + r.growth1) - two * (r.d0 * r.growth1 + r.d1 * r.growth0);
    if (const int sign = level.certain_sign(); sign != 0) return sign;
    return exact_level_sign(TunnelTerms(s));
}

// Whether Cayley's hyperdeterminant is positive, and so every axis has two slices whose contour is a cross.
// In a tie its growth decides, and then the growth of that, a square.
bool has_two_crosses(const OppositeFaces& s) {
    const RoundedTerms r(s);
    const Bounded hyperdeterminant = r.mixed * r.mixed - bounded(4) * (r.d0 * r.d1);
    if (const int sign = hyperdeterminant.certain_sign(); sign != 0) return sign > 0;
    const TunnelTerms terms(s);
    if (const int sign = exact_hyperdeterminant_sign(terms); sign != 0) return sign > 0;
    if (const int sign = level_sign(s); sign != 0) return sign > 0;
    std::array<double, 8> difference = terms.growth;
    for (std::size_t i = 4; i < 8; ++i) difference[i] = -difference[i];
    return exact_sign(difference) != 0;
}

// Whether the surface has a waist in the cell: on each axis both crosses lie in it. Then `tunnel` gets the
// signs of the determinants of the faces across each axis.
bool has_waist(const CellValues& f, CellTopology::Tunnel& tunnel) {
    if (!has_two_crosses(OppositeFaces(f, 0))) return false;
    unsigned positive = 0;
    for (unsigned axis = 0; axis < 3; ++axis) {
        const OppositeFaces s(f, axis);
        const int sign = sign_with_ties(s.p00, s.p01, s.p10, s.p11);
        if (sign == 0 || sign_with_ties(s.q00, s.q01, s.q10, s.q11) != sign || mixed_sign(s) != -sign)
            return false;
        positive |= (sign > 0 ? 1u : 0u) << axis;
    }
    tunnel.positive_faces = positive & 7;
    return true;
}

int loop_size(const CellShape& shape, unsigned loop) {
    return shape.loop_ends[loop] - (loop == 0 ? 0 : shape.loop_ends[loop - 1]);
}

// The corner that all edges of a loop of three share.
unsigned corner_of_loop(const CellShape& shape, unsigned loop) {
    unsigned shared = 255;
    for (int i = shape.loop_ends[loop] - 3; i < shape.loop_ends[loop]; ++i) {
        const auto& ends = kEdgeCorners[shape.loop_edges[static_cast<std::size_t>(i)]];
        shared &= 1u << ends[0] | 1u << ends[1];
    }
    return static_cast<unsigned>(std::countr_zero(shared));
}

// Chooses the loops that a tunnel joins, if there is one. Two loops are those. Of three, in a cell whose
// corners all alternate, it joins the one of six points with the triangle around an inside corner or with
// that around an outside corner. Any other loops are without a tunnel.
bool choose_loops(unsigned cell_case, const CellValues& f, const CellShape& shape,
                  CellTopology::Tunnel& tunnel) {
    tunnel.first_loop = 0;
    tunnel.second_loop = 1;
    if (shape.loops != 3) return shape.loops == 2;
    unsigned of_six = 0;               // how many loops have six points
    std::array<unsigned, 2> around{};  // how many are triangles around an outside corner, and an inside one
    const int joins_inside = level_sign(OppositeFaces(f, 0)) >= 0 ? 1 : 0;
    for (std::uint8_t loop = 0; loop < 3; ++loop) {
        if (loop_size(shape, loop) == 6) {
            ++of_six;
            tunnel.first_loop = loop;
        } else if (loop_size(shape, loop) == 3) {
            const unsigned inside = cell_case >> corner_of_loop(shape, loop) & 1;
            ++around[inside];
            if (inside == static_cast<unsigned>(joins_inside)) tunnel.second_loop = loop;
        }
    }
    return of_six == 1 && around[0] == 1 && around[1] == 1;
}

void find_tunnel(unsigned cell_case, const CellValues& values, CellTopology& topology) {
    const CellShape& shape = topology.shape();
    if (shape.loops != 2 && shape.loops != 3) return;
    if (std::any_of(values.begin(), values.end(), [](double v) { return std::isnan(v); })) return;
    const CellValues f = well_scaled(values);
    // Values that became larger could have a tunnel that the faces exclude, which the true ones decide.
    if (std::any_of(f.begin(), f.end(), [](double v) { return v != 0 && std::abs(v) <= kLeast; })) return;
    if (has_waist(f, topology.tunnel) && choose_loops(cell_case, f, shape, topology.tunnel))
        topology.inner_points = CellTopology::kTunnelPoints;
}

}  // namespace

int CellTopology::triangles() const {
    if (!has_tunnel()) return shape().triangles;
    return std::popcount(shape().crossed) - 2 * shape().loops + 4 + 2 * kTunnelPoints;
}

void decide_topologies(const CellBatch& batch, const std::uint8_t (&cases)[CellBatch::kCells],
                       std::size_t count, CellTopology* topologies) {
    FaceSigns signs[CellBatch::kCells];
    find_signs(batch, signs);
    for (std::size_t i = 0; i < count; ++i) {
        const unsigned joined = joined_faces(batch, i, cases[i], signs[i]);
        const std::size_t place = kShapePlace[kAmbiguousFaces[cases[i]]][joined];
        const auto shape = static_cast<std::uint16_t>(kFirstShape[cases[i]] + place);
        topologies[i] = {shape, {}, kShapeChanges[shape].inner_points};
        if (signs[i].may_have_waist()) find_tunnel(cases[i], batch.values(i), topologies[i]);
    }
}

CellTopology decide_topology(unsigned cell_case, const CellValues& values) {
    CellBatch batch;
    batch.set(0, values);
    CellTopology topology;
    decide_topologies(batch, {static_cast<std::uint8_t>(cell_case)}, 1, &topology);
    return topology;
}

CellValues well_scaled(const CellValues& values) {
    double largest = 0, least = kLargest;
    for (const double v : values) {
        if (v == 0) continue;
        largest = std::max(largest, std::abs(v));
        least = std::min(least, std::abs(v));
    }
    if (largest <= kLargest && least >= kLeast) return values;
    int exponent = 0;
    std::frexp(largest, &exponent);
    CellValues scaled = values;
    for (double& v : scaled) {
        if (v == 0) continue;
        v = std::ldexp(v, std::ilogb(kLargest) - exponent);
        if (std::abs(v) < kLeast) v = std::copysign(kLeast, v);
    }
    return scaled;
}

OppositeFaces::OppositeFaces(const CellValues& f, unsigned axis) {
    const unsigned across = 1u << axis, u = 1u << (axis + 1) % 3, v = 1u << (axis + 2) % 3;
    p00 = f[0], p01 = f[v], p10 = f[u], p11 = f[u | v];
    q00 = f[across], q01 = f[across | v], q10 = f[across | u], q11 = f[across | u | v];
}

}  // namespace marrow::internal
