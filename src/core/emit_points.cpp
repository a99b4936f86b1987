#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "emit_points.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <type_traits>

#include "dispatch.h"
#include "emit.h"
#include "row_bits-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// What is gathered from the volume, sample by sample: integers stay integers until they are in vectors.
template <class T>
using Staged = std::conditional_t<std::is_integral_v<T> && sizeof(T) <= 2, std::int32_t, Real<T>>;

// Crossed edges wait here until there are enough to interpolate as whole vectors; lanes may belong to
// different rows and axes. The output is written in the order in which edges are added.
template <class T>
class PointBatch {
  public:
    using R = Real<T>;
    using S = Staged<T>;

    PointBatch(const Frame& frame, double isovalue, Vec3f* points, Vec3f* normals)
        : frame_(frame),
          isovalue_(static_cast<R>(isovalue) * kSampleScale<T>),
          points_(points),
          normals_(normals) {}

    void set_row(const Vec3f& base) { base_ = base; }

    // An edge along `axis` from sample p at x, whose stencil lies within the volume.
    HWY_INLINE void add(const T* p, std::int64_t x, int axis, const std::int64_t (&stride)[3]) {
        const T* q = p + stride[axis];
        ends_[0][size_] = scaled(*p);
        ends_[1][size_] = scaled(*q);
        if (normals_ != nullptr) {
            for (int a = 0; a < 3; ++a) {
                slopes_[a][size_] = staged(p[stride[a]]) - staged(p[-stride[a]]);
                slopes_[3 + a][size_] = staged(q[stride[a]]) - staged(q[-stride[a]]);
            }
        }
        place(x, axis);
    }

    // The same with one-sided differences, twice as steep, where the stencil leaves the volume.
    void add_at_border(const T* p, const std::int64_t (&index)[3], int axis, const std::int64_t (&stride)[3],
                       const std::array<std::int64_t, 3>& dims) {
        const T* q = p + stride[axis];
        ends_[0][size_] = scaled(*p);
        ends_[1][size_] = scaled(*q);
        for (int a = 0; a < 3; ++a) {
            slopes_[a][size_] = slope_at_border(p, index[a], stride[a], dims[a]);
            slopes_[3 + a][size_] = slope_at_border(q, index[a] + (a == axis), stride[a], dims[a]);
        }
        place(index[0], axis);
    }

    // An edge that leaves the volume: its outer end has no value, so the point is in the middle.
    void add_leaving(std::int64_t x, int axis, bool first_inside) {
        flush();
        *points_++ = frame_.point(base_, static_cast<float>(x), axis, 0.5f);
        if (normals_ != nullptr) *normals_++ = along_edge(axis, first_inside);
    }

    void flush() {
        if (size_ == 0) return;
        // The lanes beyond the last edge compute on what lies there and are not written.
        interpolate();
        if (normals_ != nullptr) store(normal_[0], normal_[1], normal_[2], normals_);
        place_points();
        store(position_[0], position_[1], position_[2], points_);
        size_ = 0;
    }

  private:
    static constexpr std::size_t kCapacity = 64;

    static S staged(T sample) { return static_cast<S>(sample); }
    static S scaled(T sample) {
        if constexpr (std::is_floating_point_v<S>)
            return static_cast<S>(sample) * kSampleScale<T>;
        else
            return static_cast<S>(sample);
    }
    static S slope_at_border(const T* p, std::int64_t i, std::int64_t stride, std::int64_t n) {
        if (i > 0 && i + 1 < n) return staged(p[stride]) - staged(p[-stride]);
        if (i + 1 < n) return 2 * (staged(p[stride]) - staged(p[0]));
        if (i > 0) return 2 * (staged(p[0]) - staged(p[-stride]));
        return 0;
    }

    Vec3f along_edge(int axis, bool first_inside) const {
        Vec3f n = frame_.axis[axis];
        if (!first_inside) n = {-n[0], -n[1], -n[2]};
        return n;
    }

    HWY_INLINE void place(std::int64_t x, int axis) {
        x_[size_] = static_cast<float>(x);
        axis_[size_] = axis;
        for (int r = 0; r < 3; ++r) row_base_[r][size_] = base_[r];
        if (++size_ == kCapacity) flush();
    }

    template <class D, class V = hn::Vec<D>>
    static HWY_INLINE V load_staged(D d, const S* staged) {
        if constexpr (std::is_same_v<S, R>) {
            return hn::Load(d, staged);
        } else {
            return hn::ConvertTo(d, hn::Load(hn::RebindToSigned<D>(), staged));
        }
    }

    // Ends and slopes -> fraction along the edge and normal. The same operations, in the same order, as
    // edge_fraction.
    void interpolate() {
        const hn::ScalableTag<R> d;
        const auto isovalue = hn::Set(d, isovalue_);
        const auto huge = hn::Set(d, std::numeric_limits<R>::max());
        const auto half = hn::Set(d, R(0.5));
        const auto one = hn::Set(d, R(1));
        const auto zero = hn::Zero(d);
        for (std::size_t i = 0; i < size_; i += hn::Lanes(d)) {
            const auto first = load_staged(d, ends_[0] + i);
            const auto second = load_staged(d, ends_[1] + i);
            const auto difference = hn::Sub(second, first);
            auto t = hn::Div(hn::Sub(isovalue, first), difference);
            if constexpr (std::is_floating_point_v<T>) {
                const auto usable = hn::And(hn::Le(hn::Abs(difference), huge), hn::Eq(t, t));
                t = hn::IfThenElse(usable, t, half);
            }
            t = hn::Min(hn::Max(t, zero), one);
            hn::Store(t, d, fraction_ + i);
            if (normals_ == nullptr) continue;

            using V = hn::Vec<decltype(d)>;
            V gradient[3];
            for (int a = 0; a < 3; ++a) {
                const auto at_first = load_staged(d, slopes_[a] + i);
                const auto at_second = load_staged(d, slopes_[3 + a] + i);
                gradient[a] = hn::Add(at_first, hn::Mul(t, hn::Sub(at_second, at_first)));
            }
            if constexpr (std::is_floating_point_v<T>) {
                // Their squares must neither overflow nor vanish.
                const auto steepest =
                    hn::Max(hn::Max(hn::Abs(gradient[0]), hn::Abs(gradient[1])), hn::Abs(gradient[2]));
                for (V& g : gradient) g = hn::Div(g, steepest);
            }
            V normal[3];
            for (int r = 0; r < 3; ++r) {
                const auto& m = frame_.normal_matrix[r];
                normal[r] = hn::Add(hn::Add(hn::Mul(hn::Set(d, R(m[0])), gradient[0]),
                                            hn::Mul(hn::Set(d, R(m[1])), gradient[1])),
                                    hn::Mul(hn::Set(d, R(m[2])), gradient[2]));
            }
            const auto squared =
                hn::Add(hn::Add(hn::Mul(normal[0], normal[0]), hn::Mul(normal[1], normal[1])),
                        hn::Mul(normal[2], normal[2]));
            const auto length = hn::Sqrt(squared);
            for (int r = 0; r < 3; ++r) hn::Store(hn::Div(normal[r], length), d, normal_[r] + i);
            // Flat, or with samples that have no value: the normal follows the edge.
            const auto defined = hn::And(hn::Gt(squared, zero), hn::Le(squared, huge));
            if (HWY_UNLIKELY(!hn::AllTrue(d, defined))) {
                for (std::size_t k = i; k < std::min(i + hn::Lanes(d), size_); ++k)
                    replace_undefined_normal(k);
            }
        }
    }

    void replace_undefined_normal(std::size_t k) {
        const R n[3] = {normal_[0][k], normal_[1][k], normal_[2][k]};
        const R squared = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
        if (squared > R(0.5) && squared < R(2)) return;
        const bool first_inside =
            static_cast<R>(ends_[0][k]) >= isovalue_ && std::isfinite(static_cast<R>(ends_[0][k]));
        const Vec3f along = along_edge(axis_[k], first_inside);
        for (int r = 0; r < 3; ++r) normal_[r][k] = along[r];
    }

    // Fractions -> positions, as Frame::point.
    void place_points() {
        const hn::ScalableTag<float> d;
        const hn::RebindToSigned<decltype(d)> di;
        for (std::size_t i = 0; i < size_; i += hn::Lanes(d)) {
            const auto t = load_float(d, fraction_ + i);
            const auto x = hn::Load(d, x_ + i);
            const auto axis = hn::Load(di, axis_ + i);
            hn::Vec<decltype(d)> step[3];
            for (int a = 0; a < 3; ++a) {
                step[a] = hn::IfThenElseZero(hn::RebindMask(d, hn::Eq(axis, hn::Set(di, a))), t);
            }
            for (int r = 0; r < 3; ++r) {
                const auto& m = frame_.matrix[r];
                auto p = hn::Add(hn::Load(d, row_base_[r] + i), hn::Mul(hn::Set(d, m[0]), x));
                for (int a = 0; a < 3; ++a) p = hn::Add(p, hn::Mul(hn::Set(d, m[a]), step[a]));
                hn::Store(p, d, position_[r] + i);
            }
        }
    }

    template <class D, class Value>
    static HWY_INLINE hn::Vec<D> load_float(D d, const Value* values) {
        if constexpr (std::is_same_v<Value, float>) {
            return hn::Load(d, values);
        } else {
            HWY_ALIGN float narrow[hn::MaxLanes(D())];
            for (std::size_t k = 0; k < hn::Lanes(d); ++k) narrow[k] = static_cast<float>(values[k]);
            return hn::Load(d, narrow);
        }
    }

    // The first size_ triples to the output, which they end.
    template <class Value>
    void store(const Value* a, const Value* b, const Value* c, Vec3f*& output) {
        const hn::ScalableTag<float> d;
        const std::size_t lanes = hn::Lanes(d);
        float* out = output->data();
        std::size_t i = 0;
        for (; i + lanes <= size_; i += lanes) {
            hn::StoreInterleaved3(load_float(d, a + i), load_float(d, b + i), load_float(d, c + i), d,
                                  out + 3 * i);
        }
        for (; i < size_; ++i) {
            out[3 * i] = static_cast<float>(a[i]);
            out[3 * i + 1] = static_cast<float>(b[i]);
            out[3 * i + 2] = static_cast<float>(c[i]);
        }
        output += size_;
    }

    const Frame& frame_;
    const R isovalue_;
    Vec3f* points_;
    Vec3f* normals_;
    Vec3f base_{};
    std::size_t size_ = 0;

    alignas(64) S ends_[2][kCapacity] = {};
    alignas(64) S slopes_[6][kCapacity] = {};
    alignas(64) float x_[kCapacity] = {};
    alignas(64) std::int32_t axis_[kCapacity] = {};
    alignas(64) float row_base_[3][kCapacity] = {};
    alignas(64) R fraction_[kCapacity] = {};
    alignas(64) R normal_[3][kCapacity];
    alignas(64) float position_[3][kCapacity];
};

// Calls f with the position of every set bit of a row's words.
template <class Words, class F>
HWY_INLINE void for_each_bit(std::size_t words, const Words& word, const F& f) {
    for (std::size_t w = 0; w < words; ++w) {
        for (std::uint64_t bits = word(w); bits != 0; bits &= bits - 1) {
            f(static_cast<std::int64_t>(64 * w) + __builtin_ctzll(bits));
        }
    }
}

template <class T>
void emit_points_of(const EmitInput& input, std::size_t row_begin, std::size_t row_end, Vec3f* points,
                    Vec3f* normals) {
    const auto& dims = input.volume.geometry.dims;
    const InsideBits& bits = input.bits;
    const std::int64_t pad = bits.pad;
    const std::int64_t stride[3] = {1, dims[0], dims[0] * dims[1]};
    const T* samples = static_cast<const T*>(input.volume.data);
    PointBatch<T> batch(input.frame, input.isovalue, points, normals);

    for (std::size_t r = row_begin; r < row_end; ++r) {
        if (input.points.leaves()[r] == 0) continue;
        const RowBits row(bits, r);
        const std::int64_t y = static_cast<std::int64_t>(r) % bits.dims[1] - pad;
        const std::int64_t z = static_cast<std::int64_t>(r) / bits.dims[1] - pad;
        const T* row_samples = samples + z * stride[2] + y * stride[1];
        const bool inner_row = y >= 1 && y + 2 < dims[1] && z >= 1 && z + 2 < dims[2];
        batch.set_row(input.frame.row_base(y, z));

        const auto add = [&](std::int64_t grid_x, int axis) HWY_ATTR {
            const std::int64_t x = grid_x - pad;
            if (HWY_LIKELY(inner_row && x >= 1 && x + 2 < dims[0])) {
                batch.add(row_samples + x, x, axis, stride);
                return;
            }
            const std::int64_t first[3] = {x, y, z};
            bool leaves = false;
            for (int a = 0; a < 3; ++a) {
                leaves |= first[a] < 0 || first[a] + (a == axis) >= dims[a];
            }
            if (leaves) {
                batch.add_leaving(x, axis, first[axis] >= 0);
            } else {
                batch.add_at_border(row_samples + x, first, axis, stride, dims);
            }
        };
        for_each_bit(
            row.words, [&](std::size_t w) HWY_ATTR { return row.crossed_x(kRow, w); },
            [&](std::int64_t x) HWY_ATTR { add(x, 0); });
        for_each_bit(
            row.words, [&](std::size_t w) HWY_ATTR { return row.crossed_y(w); },
            [&](std::int64_t x) HWY_ATTR { add(x, 1); });
        for_each_bit(
            row.words, [&](std::size_t w) HWY_ATTR { return row.crossed_z(w); },
            [&](std::int64_t x) HWY_ATTR { add(x, 2); });
    }
    batch.flush();
}

void emit_points_any(const EmitInput& input, std::size_t row_begin, std::size_t row_end, Vec3f* points,
                     Vec3f* normals) {
    with_sample_type(input.volume.type, [&](auto sample) {
        emit_points_of<decltype(sample)>(input, row_begin, row_end, points, normals);
    });
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(emit_points_any);

void emit_points(const EmitInput& input, std::size_t row_begin, std::size_t row_end, Vec3f* points,
                 Vec3f* normals) noexcept {
    const std::uint64_t first = input.points.first_output(row_begin);
    HWY_DYNAMIC_DISPATCH(emit_points_any)
    (input, row_begin, row_end, points + first, normals ? normals + first : nullptr);
}

}  // namespace marrow::internal
#endif
