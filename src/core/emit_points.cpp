#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "emit_points.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
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

// Crossed edges wait here until there are enough to fetch their samples in one long loop and to interpolate
// them as whole vectors; neighbours in the batch may belong to different rows and axes. The output is written
// in the order in which edges are added.
template <class T>
class PointBatch {
  public:
    using R = Real<T>;
    using S = Staged<T>;

    PointBatch(const EmitInput& input, Vec3f* points, Vec3f* normals)
        : dims_(input.volume.geometry.dims),
          stride_{1, dims_[0], dims_[0] * dims_[1]},
          frame_(input.frame),
          isovalue_(static_cast<R>(input.isovalue) * kSampleScale<T>),
          points_(points),
          normals_(normals) {}

    // From now on, edges start in the row of samples (y, z), of which `samples` is the first.
    void set_row(std::int64_t y, std::int64_t z, const T* samples) {
        finish_row();
        y_ = y;
        z_ = z;
        row_ = samples;
        base_ = frame_.row_base(y, z);
    }
    // From now on, they run along this axis.
    void set_axis(int axis) {
        finish_axis();
        axis_ = axis;
    }

    // The edges from the samples x + i of the row, i the bits that are set; their stencils lie within the volume.
    HWY_INLINE void add(std::uint64_t bits, std::int32_t x) {
        if (HWY_UNLIKELY(size_ > kCapacity - 64)) flush();
        const auto count = static_cast<std::size_t>(__builtin_popcountll(bits));
        std::int32_t* xs = x_ + size_;
        // Most words have few. Write so many without asking, and overwrite what was too much.
        for (std::size_t k = 0; k < count; k += 4) {
            for (std::size_t i = k; i < k + 4; ++i) {
                xs[i] = x + std::countr_zero(bits);
                bits &= bits - 1;
            }
        }
        size_ += count;
    }

    // One edge anywhere: with one-sided differences, twice as steep, where its stencil leaves the volume.
    void add_at_border(std::int32_t x) {
        if (size_ > kCapacity - 64) flush();
        stage();
        const std::int64_t first[3] = {x, y_, z_};
        std::int64_t second[3] = {x, y_, z_};
        ++second[axis_];
        if (!within(first) || !within(second)) return add_leaving(x, within(first));
        const T* p = row_ + x;
        const T* q = p + stride_[axis_];
        x_[size_] = x;
        axes_[size_] = axis_;
        for (std::size_t r = 0; r < 3; ++r) row_base_[r][size_] = base_[r];
        ends_[0][size_] = scaled(*p);
        ends_[1][size_] = scaled(*q);
        for (int a = 0; a < 3; ++a) {
            slopes_[a][size_] = slope_at_border(p, first[a], a);
            slopes_[3 + a][size_] = slope_at_border(q, second[a], a);
        }
        staged_ = of_row_ = of_axis_ = ++size_;
    }

    void flush() {
        stage();
        if (size_ == 0) return;
        // The lanes beyond the last edge compute on what lies there and are not written.
        interpolate();
        if (normals_ != nullptr) store(normal_[0], normal_[1], normal_[2], normals_);
        place_points();
        store(position_[0], position_[1], position_[2], points_);
        size_ = of_axis_ = of_row_ = staged_ = 0;
    }

  private:
    static constexpr std::size_t kCapacity = 192;

    static S staged(T sample) { return static_cast<S>(sample); }
    static S scaled(T sample) {
        if constexpr (std::is_floating_point_v<S>)
            return static_cast<S>(sample) * kSampleScale<T>;
        else
            return static_cast<S>(sample);
    }

    // Notes the axis of the edges added since it did so last: eight at a time, of which the next axis
    // overwrites what was too much.
    HWY_INLINE void finish_axis() {
        for (std::size_t k = of_axis_; k < size_; k += 8) std::fill_n(axes_ + k, 8, axis_);
        of_axis_ = size_;
    }
    // The same for the row.
    HWY_INLINE void finish_row() {
        finish_axis();
        for (std::size_t k = of_row_; k < size_; k += 8) {
            std::fill_n(rows_ + k, 8, row_);
            for (std::size_t r = 0; r < 3; ++r) std::fill_n(row_base_[r] + k, 8, base_[r]);
        }
        of_row_ = size_;
    }

    // Fetches the samples of the edges added since it did so last.
    void stage() {
        finish_row();
        if (normals_ != nullptr)
            stage_edges<true>();
        else
            stage_edges<false>();
        staged_ = size_;
    }

    template <bool kNormals>
    HWY_INLINE void stage_edges() {
        const std::int64_t step_y = stride_[1], step_z = stride_[2];
        for (std::size_t k = staged_; k < size_; ++k) {
            const T* HWY_RESTRICT p = rows_[k] + x_[k];
            const T* HWY_RESTRICT q = p + stride_[axes_[k]];
            // The surface goes on in the next slice, whose stencil ends here.
            hwy::Prefetch(p + 3 * step_z);
            ends_[0][k] = scaled(*p);
            ends_[1][k] = scaled(*q);
            if constexpr (kNormals) {
                slopes_[0][k] = staged(p[1]) - staged(p[-1]);
                slopes_[1][k] = staged(p[step_y]) - staged(p[-step_y]);
                slopes_[2][k] = staged(p[step_z]) - staged(p[-step_z]);
                slopes_[3][k] = staged(q[1]) - staged(q[-1]);
                slopes_[4][k] = staged(q[step_y]) - staged(q[-step_y]);
                slopes_[5][k] = staged(q[step_z]) - staged(q[-step_z]);
            }
        }
    }

    S slope_at_border(const T* p, std::int64_t i, int axis) const {
        const std::int64_t step = stride_[axis], n = dims_[axis];
        if (i > 0 && i + 1 < n) return staged(p[step]) - staged(p[-step]);
        if (i + 1 < n) return 2 * (staged(p[step]) - staged(p[0]));
        if (i > 0) return 2 * (staged(p[0]) - staged(p[-step]));
        return 0;
    }

    bool within(const std::int64_t (&index)[3]) const {
        bool inside = true;
        for (std::size_t a = 0; a < 3; ++a) inside &= index[a] >= 0 && index[a] < dims_[a];
        return inside;
    }

    // An edge out of the volume: its outer end has no value, so the point is in the middle.
    void add_leaving(std::int64_t x, bool first_inside) {
        flush();
        *points_++ = frame_.point(base_, static_cast<float>(x), static_cast<std::size_t>(axis_), 0.5f);
        if (normals_ != nullptr) *normals_++ = along_edge(axis_, first_inside);
    }

    Vec3f along_edge(int axis, bool first_inside) const {
        Vec3f n = frame_.axis[static_cast<std::size_t>(axis)];
        if (!first_inside) n = {-n[0], -n[1], -n[2]};
        return n;
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
        const Vec3f along = along_edge(axes_[k], first_inside);
        for (int r = 0; r < 3; ++r) normal_[r][k] = along[r];
    }

    // Fractions -> positions, as Frame::point.
    void place_points() {
        const hn::ScalableTag<float> d;
        const hn::RebindToSigned<decltype(d)> di;
        for (std::size_t i = 0; i < size_; i += hn::Lanes(d)) {
            const auto t = load_float(d, fraction_ + i);
            const auto x = hn::ConvertTo(d, hn::Load(di, x_ + i));
            const auto axis = hn::Load(di, axes_ + i);
            const auto along_y = hn::RebindMask(d, hn::Eq(axis, hn::Set(di, 1)));
            const auto along_z = hn::RebindMask(d, hn::Eq(axis, hn::Set(di, 2)));
            for (std::size_t r = 0; r < 3; ++r) {
                const auto& m = frame_.matrix[r];
                const auto along_x = hn::Set(d, m[0]);
                const auto along_edge = hn::IfThenElse(along_z, hn::Set(d, m[2]),
                                                       hn::IfThenElse(along_y, hn::Set(d, m[1]), along_x));
                const auto first = hn::Add(hn::Load(d, row_base_[r] + i), hn::Mul(along_x, x));
                hn::Store(hn::Add(first, hn::Mul(along_edge, t)), d, position_[r] + i);
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

    const std::array<std::int64_t, 3> dims_;
    const std::int64_t stride_[3];
    const Frame& frame_;
    const R isovalue_;
    Vec3f* points_;
    Vec3f* normals_;

    std::int64_t y_ = 0, z_ = 0;
    const T* row_ = nullptr;
    Vec3f base_{};
    int axis_ = 0;
    // Edges; and up to which their axis is noted, their row, and their samples fetched.
    std::size_t size_ = 0, of_axis_ = 0, of_row_ = 0, staged_ = 0;

    alignas(64) S ends_[2][kCapacity] = {};
    alignas(64) S slopes_[6][kCapacity] = {};
    alignas(64) std::int32_t x_[kCapacity] = {};
    // With room for what is written too much.
    alignas(64) std::int32_t axes_[kCapacity + 8] = {};
    alignas(64) const T* rows_[kCapacity + 8] = {};
    alignas(64) float row_base_[3][kCapacity + 8] = {};
    alignas(64) R fraction_[kCapacity] = {};
    alignas(64) R normal_[3][kCapacity];
    alignas(64) float position_[3][kCapacity];
};

// For each of a row's words, the samples x whose stencils lie in it: they reach one sample back and two ahead.
Buffer<std::uint64_t> inner_samples(const InsideBits& bits, std::int64_t nx) {
    Buffer<std::uint64_t> inner(bits.words_per_row);
    std::fill(inner.begin(), inner.end(), std::uint64_t{0});
    for (std::int64_t x = 1; x + 2 < nx; ++x) {
        const std::int64_t bit = bits.first_x + x;
        inner[static_cast<std::size_t>(bit / 64)] |= std::uint64_t{1} << bit % 64;
    }
    return inner;
}

template <class T>
void emit_points_of(const EmitInput& input, std::size_t row_begin, std::size_t row_end, Vec3f* points,
                    Vec3f* normals) {
    const std::int64_t nx = input.volume.geometry.dims[0], ny = input.volume.geometry.dims[1],
                       nz = input.volume.geometry.dims[2];  // no binding: clang 14 lets lambdas not see those
    const InsideBits& bits = input.bits;
    const T* samples = static_cast<const T*>(input.volume.data);
    const Buffer<std::uint64_t> inner = inner_samples(bits, nx);
    PointBatch<T> batch(input, points, normals);

    for (GridRow at(bits, row_begin); at.index < row_end; at.advance(bits)) {
        const std::size_t r = at.index;
        if (input.points.leaves()[r] == 0) continue;
        const RowBits row(bits, at);
        const std::int64_t y = at.y - bits.pad, z = at.z - bits.pad;
        batch.set_row(y, z, samples + (z * ny + y) * nx);
        const bool inner_row = y >= 1 && y + 2 < ny && z >= 1 && z + 2 < nz;

        const auto add = [&](int axis, auto&& crossed) HWY_ATTR {
            batch.set_axis(axis);
            for_each_active_word(input.active, r, [&](std::size_t w) HWY_ATTR {
                std::uint64_t left = crossed(w);
                const std::uint64_t safe = inner_row ? inner[w] : 0;
                const auto x = static_cast<std::int32_t>(64 * static_cast<std::int64_t>(w) - bits.first_x);
                if (HWY_LIKELY((left & ~safe) == 0)) return batch.add(left, x);
                for (; left != 0; left &= left - 1) {
                    const std::uint64_t lowest = left & (~left + 1);
                    if ((lowest & safe) != 0)
                        batch.add(lowest, x);
                    else
                        batch.add_at_border(x + std::countr_zero(left));
                }
            });
        };
        add(0, [&](std::size_t w) HWY_ATTR { return row.crossed_x(kRow, w); });
        add(1, [&](std::size_t w) HWY_ATTR { return row.crossed_y(w); });
        add(2, [&](std::size_t w) HWY_ATTR { return row.crossed_z(w); });
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
