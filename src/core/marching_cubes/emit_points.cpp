// Writes the points and normals on crossed edges: lists the edges of a row, fetches their samples, and
// interpolates them as vectors.
#define HWY_WANT_AVX3_DL 1  // which lists bits without branches
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/marching_cubes/emit_points.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <type_traits>

#include "emit.h"
#include "row_bits-inl.h"
#include "row_edges-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

// The type of fetched samples. Small integers are converted to floating point later, in vectors.
template <class T>
using Staged = std::conditional_t<std::is_integral_v<T> && sizeof(T) <= 2, std::int32_t, Real<T>>;

// The index of a sample, as wide as an address: arrays have at most PTRDIFF_MAX bytes.
using SampleIndex = std::conditional_t<sizeof(void*) == 4, std::int32_t, std::int64_t>;

// The pointer, whose origin compilers do not see: so they do not add the place of an array in its object to
// each of the small offsets from the pointer, which WebAssembly adds at no cost.
template <class Pointer>
HWY_INLINE Pointer opaque(Pointer pointer) {
#if HWY_TARGET == HWY_WASM
    __asm__("" : "+r"(pointer));
#endif
    return pointer;
}

// A batch of crossed edges, from one or more rows. When it is full, one long loop fetches the samples of all
// edges, and whole vectors interpolate them. The output has the order in which edges are added.
template <class T>
class PointBatch {
  public:
    using R = Real<T>;
    using S = Staged<T>;

    // Writes points from `points` to `end`, and as many normals and fractions unless these are null.
    PointBatch(const EmitInput& input, Vec3f* points, const Vec3f* end, Vec3f* normals, float* fractions)
        : samples_(static_cast<const T*>(input.volume.data)),
          dims_(input.volume.geometry.dims),
          stride_{1, static_cast<SampleIndex>(input.volume.row_pitch()),
                  static_cast<SampleIndex>(input.volume.slice_pitch())},
          below_(input.volume.below),
          above_(input.volume.above),
          within_{inner(0), inner(1), inner(2)},
          to_physical_(input.to_physical),
          isovalue_(static_cast<R>(input.isovalue) * kSampleScale<T>),
          points_(points),
          end_(end),
          normals_(normals),
          fractions_(fractions) {}

    // The following edges start in the row of samples (y, z).
    void set_row(std::int64_t y, std::int64_t z) noexcept {
        y_ = y;
        z_ = z;
        row_ = static_cast<SampleIndex>(z) * stride_[2] + static_cast<SampleIndex>(y) * stride_[1];
        base_ = to_physical_.row_base(y, z);
        inner_ = contains(within_[1], y) && contains(within_[2], z) ? within_[0] : Range{};
    }

    // Adds `count` edges of the row. Up to RowEdges::kSlack more elements are read.
    HWY_INLINE void add(const std::uint32_t* codes, std::size_t count) noexcept {
        while (count > 0) {
            if (HWY_UNLIKELY(size_ == kCapacity)) flush();
            const std::size_t fit = std::min(count, kCapacity - size_);
            note(codes, fit);
            size_ += fit;
            codes += fit;
            count -= fit;
        }
    }

    HWY_NOINLINE void flush() noexcept {
        if (size_ == 0) return;
        if (normals_ != nullptr) {
            stage<true>();
            write<true>();
        } else {
            stage<false>();
            write<false>();
        }
        points_ += size_;
        if (normals_ != nullptr) normals_ += size_;
        if (fractions_ != nullptr) fractions_ += size_;
        size_ = border_count_ = 0;
    }

  private:
    // In WebAssembly the cache must hold what the samples of the whole batch bring into it.
    static constexpr std::size_t kCapacity = HWY_TARGET == HWY_WASM ? 192 : 768;
    static constexpr std::size_t kAtOnce = 16;
    static constexpr std::size_t kAhead = 48;  // samples are prefetched this many edges ahead
    // Room for the elements that note() stores beyond the last edge, for whole
    // vectors, and for what is read ahead.
    static constexpr std::size_t kRoom = kCapacity + kAhead;
    static_assert(kAtOnce <= kAhead && hn::MaxLanes(hn::ScalableTag<R>()) <= kAhead && kRoom % 16 == 0);

    using Range = std::array<std::int64_t, 2>;  // from the first to before the second

    // Of each edge, eight numbers are fetched: the samples at its ends, and the slopes at the first and at
    // the second end along x, y and z. Each has an array of its own. But in WebAssembly the numbers of
    // kTogether edges are side by side, at small offsets from each other.
    static constexpr bool kSideBySide = HWY_TARGET == HWY_WASM;
    static constexpr std::size_t kTogether = kSideBySide ? hn::MaxLanes(hn::ScalableTag<R>()) : 1;
    static constexpr std::size_t kStride = kSideBySide ? kTogether : kRoom;  // between the numbers of an edge
    static constexpr std::size_t first_number(std::size_t k) {
        return kSideBySide ? k / kTogether * (8 * kTogether) + k % kTogether : k;
    }
    HWY_INLINE S* staged_of(std::size_t k) { return opaque(staged_ + first_number(k)); }
    HWY_INLINE const S* staged_of(std::size_t k) const { return opaque(staged_ + first_number(k)); }

    // An edge whose stencil leaves the volume.
    struct BorderEdge {
        std::size_t edge;  // index in the batch
        std::array<std::int64_t, 3> first;
    };

    static S staged(T sample) { return static_cast<S>(sample); }

    template <class DL, class Places>
    static HWY_INLINE hn::Vec<DL> widened(DL dl, Places places) {
        if constexpr (sizeof(SampleIndex) == sizeof(std::uint32_t))
            return hn::BitCast(dl, places);
        else
            return hn::BitCast(dl, hn::PromoteTo(hn::RebindToUnsigned<DL>(), places));
    }

    // Stores edges at the end of the batch.
    HWY_INLINE void note(const std::uint32_t* codes, std::size_t count) {
        const hn::CappedTag<std::uint32_t, kAtOnce> du;
        const hn::RebindToFloat<decltype(du)> df;
        const hn::RebindToSigned<decltype(du)> di;
        const hn::Repartition<SampleIndex, decltype(du)> dl;
        const hn::Rebind<std::uint32_t, decltype(dl)> dh;
        const auto places = [](auto d, auto codes)
                                HWY_ATTR { return hn::And(codes, hn::Set(d, EdgeCode::kPlaceMask)); };
        const auto first_inner = hn::Set(di, static_cast<std::int32_t>(inner_[0] + 1));
        const auto last_inner = hn::Set(di, static_cast<std::int32_t>(inner_[1]));
        const auto row = hn::Set(dl, row_ - 1);
        for (std::size_t i = 0; i < count; i += hn::Lanes(du)) {
            const std::size_t k = size_ + i;
            const auto code = hn::LoadU(du, codes + i);
            hn::StoreU(code, du, codes_ + k);
            for (std::size_t r = 0; r < 3; ++r) hn::StoreU(hn::Set(df, base_[r]), df, row_base_[r] + k);
            for (std::size_t half = 0; half < hn::Lanes(du); half += hn::Lanes(dl)) {
                const auto place = widened(dl, places(dh, hn::LoadU(dh, codes + i + half)));
                hn::StoreU(hn::Add(row, place), dl, first_ + k + half);
            }
            const auto place = hn::BitCast(di, places(du, code));
            const auto outer = hn::And(hn::Or(hn::Lt(place, first_inner), hn::Gt(place, last_inner)),
                                       hn::FirstN(di, count - i));
            if (HWY_UNLIKELY(!hn::AllFalse(di, outer)))
                note_borders(codes + i, k, std::min(count - i, hn::Lanes(du)));
        }
    }

    // Notes which of `count` edges, from index `first` of the batch on, have stencils that leave the volume.
    HWY_NOINLINE void note_borders(const std::uint32_t* codes, std::size_t first, std::size_t count) {
        for (std::size_t i = 0; i < count; ++i) {
            const std::int64_t x = EdgeCode::x(codes[i]);
            if (!contains(inner_, x)) borders_[border_count_++] = {first + i, {x, y_, z_}};
        }
    }

    // The indices along an axis at which edges lie within the volume, and their stencils within the samples
    // that may be read. Stencils reach one sample back and two ahead.
    Range inner(std::size_t axis) const {
        const std::int64_t first = std::max<std::int64_t>(1 - below_[axis], 0);
        return {first, std::max(first, std::min(dims_[axis] + above_[axis] - 2, dims_[axis] - 1))};
    }
    static bool contains(const Range& range, std::int64_t i) { return i >= range[0] && i < range[1]; }

    // Fetches the edges' samples.
    template <bool kNormals>
    void stage() {
        // stage_inner() must not read beyond the samples. For border edges it reads the first stencil within
        // them, if there is one, and stage_border() replaces the result.
        bool has_stencil = true;
        SampleIndex first = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            has_stencil &= below_[a] + dims_[a] + above_[a] >= 4;
            first += static_cast<SampleIndex>(1 - below_[a]) * stride_[a];
        }
        if (has_stencil) {
            for (std::size_t b = 0; b < border_count_; ++b) first_[borders_[b].edge] = first;
            std::fill_n(first_ + size_, kTogether - 1, first);
            prefetches_ ? stage_inner<kNormals, true>() : stage_inner<kNormals, false>();
        }
        for (std::size_t b = 0; b < border_count_; ++b) stage_border(borders_[b]);
    }

    // Prefetches the cache lines of an edge's stencil that the rows before did not use: those at its far side
    // in y.
    HWY_INLINE void prefetch(std::size_t k) const {
        const T* far = samples_ + (first_[k] + stride_[1]);
        hwy::Prefetch(far - stride_[2]);
        hwy::Prefetch(far + stride_[1]);
        hwy::Prefetch(far + stride_[2]);
        hwy::Prefetch(far + 2 * stride_[2]);
    }

    template <bool kNormals, bool kPrefetches>
    HWY_INLINE void stage_edge(std::size_t k, S* HWY_RESTRICT to) const {
        const SampleIndex step_y = stride_[1], step_z = stride_[2];
        const T* HWY_RESTRICT p = samples_ + first_[k];
        const T* HWY_RESTRICT q = p + stride_[codes_[k] >> EdgeCode::kAxisShift];
        if constexpr (kPrefetches) prefetch(k + kAhead);
        // The surface continues in the next slice, whose stencil ends at this sample.
        hwy::Prefetch(p + 3 * step_z);
        to[0] = staged(*p);
        to[kStride] = staged(*q);
        if constexpr (kNormals) {
            to[2 * kStride] = staged(p[1]) - staged(p[-1]);
            to[3 * kStride] = staged(p[step_y]) - staged(p[-step_y]);
            to[4 * kStride] = staged(p[step_z]) - staged(p[-step_z]);
            to[5 * kStride] = staged(q[1]) - staged(q[-1]);
            to[6 * kStride] = staged(q[step_y]) - staged(q[-step_y]);
            to[7 * kStride] = staged(q[step_z]) - staged(q[-step_z]);
        }
    }

    template <bool kNormals, bool kPrefetches>
    HWY_INLINE void stage_inner() {
        for (std::size_t k = 0; kPrefetches && k < std::min(kAhead, size_); ++k) prefetch(k);
#if HWY_TARGET == HWY_WASM
        // There are no prefetches. But loads that nothing waits for overlap, so that the loop after them
        // finds in the cache what no slice before needed. Vectors would be filled lane by lane.
        S sum = 0;
#pragma clang loop vectorize(disable)
        for (std::size_t k = 0; k < size_; ++k) sum += staged(samples_[first_[k] + 2 * stride_[2]]);
        loaded_ = sum;
#endif
        for (std::size_t k = 0; k < size_; k += kTogether) {
            S* const to = staged_of(k);
            for (std::size_t e = 0; e < kTogether; ++e) stage_edge<kNormals, kPrefetches>(k + e, to + e);
        }
    }

    SampleIndex sample_at(const std::array<std::int64_t, 3>& index) const {
        return static_cast<SampleIndex>(index[2] * stride_[2] + index[1] * stride_[1] + index[0]);
    }
    bool within(const std::array<std::int64_t, 3>& index) const {
        bool inside = true;
        for (std::size_t a = 0; a < 3; ++a) inside &= index[a] >= 0 && index[a] < dims_[a];
        return inside;
    }
    std::array<std::int64_t, 3> second_of(const BorderEdge& b) const {
        std::array<std::int64_t, 3> second = b.first;
        ++second[axis_of(b.edge)];
        return second;
    }

    // Where the stencil leaves the samples, one-sided differences replace the central ones. They are doubled,
    // because central differences span two samples.
    void stage_border(const BorderEdge& b) {
        const std::array<std::int64_t, 3> ends[2] = {b.first, second_of(b)};
        if (!within(ends[0]) || !within(ends[1])) return;
        S* const to = staged_of(b.edge);
        for (std::size_t e = 0; e < 2; ++e) {
            const auto& index = ends[e];
            const T* p = samples_ + sample_at(index);
            to[e * kStride] = staged(*p);
            for (std::size_t a = 0; a < 3; ++a)
                to[(2 + 3 * e + a) * kStride] = slope_at_border(p, index[a], a);
        }
    }

    S slope_at_border(const T* p, std::int64_t i, std::size_t axis) const {
        const SampleIndex step = stride_[axis];
        const bool has_before = i > -below_[axis], has_after = i + 1 < dims_[axis] + above_[axis];
        if (has_before && has_after) return staged(p[step]) - staged(p[-step]);
        if (has_after) return 2 * (staged(p[step]) - staged(p[0]));
        if (has_before) return 2 * (staged(p[0]) - staged(p[-step]));
        return 0;
    }

    std::size_t axis_of(std::size_t k) const {
        return EdgeCode::axis(codes_[k]);
    }

    Vec3f along_edge(std::size_t axis, bool first_inside) const {
        Vec3f n = to_physical_.axis[axis];
        if (!first_inside) n = {-n[0], -n[1], -n[2]};
        return n;
    }

    using D = hn::ScalableTag<R>;
    using V = hn::Vec<D>;
    using DF = hn::Rebind<float, D>;
    using VF = hn::Vec<DF>;
    using DI = hn::RebindToSigned<D>;

    HWY_INLINE V load_end(std::size_t end, std::size_t i) const {
        return load_staged(staged_of(i) + end * kStride);
    }
    HWY_INLINE V load_slope(std::size_t end, std::size_t axis, std::size_t i) const {
        return load_staged(staged_of(i) + (2 + 3 * end + axis) * kStride);
    }
    static HWY_INLINE V load_staged(const S* staged) {
        const D d;
        if constexpr (std::is_same_v<S, R>) {
            return hn::Load(d, staged);
        } else {
            return hn::ConvertTo(d, hn::Load(hn::RebindToSigned<D>(), staged));
        }
    }
    // The axes of edges, in lanes as wide as V's.
    HWY_INLINE hn::Vec<DI> load_axes(std::size_t i) const {
        const auto codes = hn::Load(hn::Rebind<std::uint32_t, D>(), codes_ + i);
        const auto axes =
            hn::BitCast(hn::Rebind<std::int32_t, D>(), hn::ShiftRight<EdgeCode::kAxisShift>(codes));
        if constexpr (sizeof(R) == sizeof(std::int32_t)) {
            return axes;
        } else {
            return hn::PromoteTo(DI(), axes);
        }
    }
    static HWY_INLINE VF to_float(V v) {
        if constexpr (std::is_same_v<R, float>) {
            return v;
        } else {
            return hn::DemoteTo(DF(), v);
        }
    }

    // Computes points and normals from the fetched ends and slopes. The lanes after the last edge compute
    // from old values. The next batch overwrites their results, except at the end of the output, where
    // store() leaves them out.
    template <bool kNormals>
    void write() {
        const auto room = static_cast<std::size_t>(end_ - points_);
        // In WebAssembly, what may have been overwritten is loaded again for each vector.
        std::conditional_t<HWY_TARGET == HWY_WASM, const IndexToPhysical, const IndexToPhysical&>
            to_physical = to_physical_;
        for (std::size_t i = 0; i < size_; i += hn::Lanes(D())) {
            const V t = fraction(i);
            VF point[3];
            find_point(to_physical, i, to_float(t), point);
            store(point, points_ + i, room - i);
            if (fractions_ != nullptr) hn::StoreU(to_float(t), DF(), fractions_ + i);
            if constexpr (kNormals) {
                V normal[3];
                find_normal(to_physical, i, t, normal);
                const VF narrow[3] = {to_float(normal[0]), to_float(normal[1]), to_float(normal[2])};
                store(narrow, normals_ + i, room - i);
            }
        }
        for (std::size_t b = 0; b < border_count_; ++b) write_leaving<kNormals>(borders_[b]);
    }

    // The same operations, in the same order, as edge_fraction.
    HWY_INLINE V fraction(std::size_t i) const {
        const D d;
        const V scale = hn::Set(d, kSampleScale<T>);
        V first = load_end(0, i), second = load_end(1, i);
        if constexpr (std::is_floating_point_v<T>) {
            first = hn::Mul(first, scale);
            second = hn::Mul(second, scale);
        }
        const V difference = hn::Sub(second, first);
        V t = hn::Div(hn::Sub(hn::Set(d, isovalue_), first), difference);
        if constexpr (std::is_floating_point_v<T>) {
            const V huge = hn::Set(d, std::numeric_limits<R>::max());
            const auto usable = hn::And(hn::Le(hn::Abs(difference), huge), hn::Eq(t, t));
            t = hn::IfThenElse(usable, t, hn::Set(d, R(0.5)));
        }
        return hn::Min(hn::Max(t, hn::Set(d, R(kLeastFraction))), hn::Set(d, R(1 - kLeastFraction)));
    }

    HWY_INLINE void find_normal(const IndexToPhysical& to_physical, std::size_t i, V t,
                                V (&normal)[3]) const {
        const D d;
        V gradient[3];
        for (std::size_t a = 0; a < 3; ++a) {
            const V at_first = load_slope(0, a, i), at_second = load_slope(1, a, i);
            gradient[a] = hn::Add(at_first, hn::Mul(t, hn::Sub(at_second, at_first)));
        }
        steepen_along_edges(i, gradient);
        if constexpr (std::is_floating_point_v<T>) scale_extreme(gradient);
        for (std::size_t r = 0; r < 3; ++r) {
            const Vec3f& m = to_physical.normal_matrix[r];
            normal[r] = hn::Add(
                hn::Add(hn::Mul(hn::Set(d, R(m[0])), gradient[0]), hn::Mul(hn::Set(d, R(m[1])), gradient[1])),
                hn::Mul(hn::Set(d, R(m[2])), gradient[2]));
        }
        const V squared = hn::Add(hn::Add(hn::Mul(normal[0], normal[0]), hn::Mul(normal[1], normal[1])),
                                  hn::Mul(normal[2], normal[2]));
        const V per_length = hn::Div(hn::Set(d, R(1)), hn::Sqrt(squared));
        for (V& n : normal) n = hn::Mul(n, per_length);
        // Where the gradient is zero or not finite, the normal has the direction of the edge.
        const auto defined =
            hn::And(hn::Gt(squared, hn::Zero(d)), hn::Le(squared, hn::Set(d, std::numeric_limits<R>::max())));
        if (HWY_UNLIKELY(!hn::AllTrue(d, defined))) set_along_edges(i, hn::Not(defined), normal);
    }

    // In a thin wall or gap, central differences reach across to the other side and can turn the normal
    // against the surface. Where the gradient along the edge is less than a quarter of the edge's own slope,
    // this slope replaces it: at a sharp step, central differences still are a half of it. So no normal
    // points inwards along its edge.
    HWY_INLINE void steepen_along_edges(std::size_t i, V (&gradient)[3]) const {
        const D d;
        const V difference = hn::Sub(load_end(1, i), load_end(0, i));
        const V slope = hn::Add(difference, difference);  // because central differences span two samples
        const auto axis = load_axes(i);
        const auto along_y = hn::RebindMask(d, hn::Eq(axis, hn::Set(DI(), 1)));
        const auto along_z = hn::RebindMask(d, hn::Eq(axis, hn::Set(DI(), 2)));
        const V along =
            hn::IfThenElse(along_z, gradient[2], hn::IfThenElse(along_y, gradient[1], gradient[0]));
        const V rise = hn::Xor(along, hn::And(difference, hn::SignBit(d)));
        const auto flat = hn::Lt(rise, hn::Mul(hn::Set(d, R(0.5)), hn::Abs(difference)));
        if (HWY_LIKELY(hn::AllFalse(d, flat))) return;
        gradient[0] = hn::IfThenElse(hn::AndNot(hn::Or(along_y, along_z), flat), slope, gradient[0]);
        gradient[1] = hn::IfThenElse(hn::And(along_y, flat), slope, gradient[1]);
        gradient[2] = hn::IfThenElse(hn::And(along_z, flat), slope, gradient[2]);
    }

    // Scales gradients whose squares might overflow or underflow.
    static HWY_INLINE void scale_extreme(V (&gradient)[3]) {
        const D d;
        constexpr R kLarge = sizeof(R) == 4 ? R(0x1p50) : R(0x1p400);
        const V steepest = hn::Max(hn::Max(hn::Abs(gradient[0]), hn::Abs(gradient[1])), hn::Abs(gradient[2]));
        const auto moderate =
            hn::And(hn::Gt(steepest, hn::Set(d, 1 / kLarge)), hn::Lt(steepest, hn::Set(d, kLarge)));
        if (HWY_LIKELY(hn::AllTrue(d, moderate))) return;
        for (V& g : gradient) g = hn::IfThenElse(moderate, g, hn::Div(g, steepest));
    }

    // Replaces some normals by the direction of their edge.
    void set_along_edges(std::size_t i, hn::Mask<D> which, V (&normal)[3]) const {
        const D d;
        HWY_ALIGN R undefined[hn::MaxLanes(D())], lanes[3][hn::MaxLanes(D())];
        hn::Store(hn::IfThenElseZero(which, hn::Set(d, R(1))), d, undefined);
        for (std::size_t r = 0; r < 3; ++r) hn::Store(normal[r], d, lanes[r]);
        for (std::size_t k = 0; k < hn::Lanes(d); ++k) {
            if (undefined[k] == 0) continue;
            const S* const ends = staged_of(i + k);
            const R first = static_cast<R>(ends[0]), second = static_cast<R>(ends[kStride]);
            const bool first_inside = std::isfinite(first) && !(std::isfinite(second) && second > first);
            const Vec3f along = along_edge(axis_of(i + k), first_inside);
            for (std::size_t r = 0; r < 3; ++r) lanes[r][k] = along[r];
        }
        for (std::size_t r = 0; r < 3; ++r) normal[r] = hn::Load(d, lanes[r]);
    }

    // The same operations, in the same order, as IndexToPhysical::point.
    HWY_INLINE void find_point(const IndexToPhysical& to_physical, std::size_t i, VF t,
                               VF (&point)[3]) const {
        const DF d;
        const hn::RebindToSigned<DF> di;
        const hn::RebindToUnsigned<DF> du;
        const auto codes = hn::Load(du, codes_ + i);
        const auto place = hn::BitCast(di, hn::And(codes, hn::Set(du, EdgeCode::kPlaceMask)));
        const auto first_x = hn::Set(di, static_cast<std::int32_t>(to_physical.first[0] - 1));
        const auto x = hn::ConvertTo(d, hn::Add(place, first_x));
        const auto axis = hn::BitCast(di, hn::ShiftRight<EdgeCode::kAxisShift>(codes));
        const auto along_y = hn::RebindMask(d, hn::Eq(axis, hn::Set(di, 1)));
        const auto along_z = hn::RebindMask(d, hn::Eq(axis, hn::Set(di, 2)));
        for (std::size_t r = 0; r < 3; ++r) {
            const Vec3f& m = to_physical.matrix[r];
            const auto along_x = hn::Set(d, m[0]);
            const auto along_edge =
                hn::IfThenElse(along_z, hn::Set(d, m[2]), hn::IfThenElse(along_y, hn::Set(d, m[1]), along_x));
            const auto first = hn::Add(hn::Load(d, row_base_[r] + i), hn::Mul(along_x, x));
            point[r] = hn::Add(first, hn::Mul(along_edge, t));
        }
    }

    static HWY_INLINE void store_triples(const VF (&v)[3], float* out) {
#if HWY_TARGET == HWY_WASM
        if constexpr (hn::MaxLanes(DF()) == 4) {
            // Highway's shuffles are several instructions each; these are one.
            const v128_t x = v[0].raw, y = v[1].raw, z = v[2].raw;
            const v128_t xy = wasm_i32x4_shuffle(x, y, 0, 2, 4, 6), yz = wasm_i32x4_shuffle(y, z, 1, 3, 5, 7),
                         zx = wasm_i32x4_shuffle(z, x, 0, 2, 5, 7);
            wasm_v128_store(out, wasm_i32x4_shuffle(xy, zx, 0, 2, 4, 6));
            wasm_v128_store(out + 4, wasm_i32x4_shuffle(yz, xy, 0, 2, 5, 7));
            wasm_v128_store(out + 8, wasm_i32x4_shuffle(zx, yz, 1, 3, 5, 7));
            return;
        }
#endif
        hn::StoreInterleaved3(v[0], v[1], v[2], DF(), out);
    }

    // Stores vectors as triples; at most `room` of them.
    static HWY_INLINE void store(const VF (&v)[3], Vec3f* out, std::size_t room) {
        const DF d;
        if (HWY_LIKELY(room >= hn::Lanes(d))) return store_triples(v, out->data());
        HWY_ALIGN float last[3 * hn::MaxLanes(DF())];
        store_triples(v, last);
        std::copy_n(last, 3 * room, out->data());
    }

    // Writes the point of an edge that leaves the volume. Its outer end has no value, so the point is in the
    // middle.
    template <bool kNormals>
    void write_leaving(const BorderEdge& b) {
        const bool first_inside = within(b.first);
        if (first_inside && within(second_of(b))) return;
        const std::size_t k = b.edge;
        const Vec3f base{row_base_[0][k], row_base_[1][k], row_base_[2][k]};
        const auto x = static_cast<float>(to_physical_.first[0] + b.first[0]);
        points_[k] = to_physical_.point(base, x, axis_of(k), 0.5f);
        if (fractions_ != nullptr) fractions_[k] = 0.5f;
        if constexpr (kNormals) normals_[k] = along_edge(axis_of(k), first_inside);
    }

    const T* const samples_;
    const std::array<std::int64_t, 3> dims_;
    const SampleIndex stride_[3];
    const std::array<std::int64_t, 3> below_, above_;  // samples beyond the volume that may be read
    // Large slices do not stay in the cache until the next slice needs them. In slices of 512 x 512 samples,
    // the rows of a stencil even evict each other.
    const bool prefetches_ = stride_[2] * static_cast<std::int64_t>(sizeof(T)) > 256 * 1024;
    const std::array<Range, 3> within_;  // inner()
    const IndexToPhysical& to_physical_;
    const R isovalue_;
    Vec3f* points_;
    const Vec3f* const end_;
    Vec3f* normals_;
    float* fractions_;

    std::int64_t y_ = 0, z_ = 0;
    SampleIndex row_ = 0;  // of the row's first sample
    Vec3f base_{};
    Range inner_{};  // of the row, along x
    std::size_t size_ = 0, border_count_ = 0;
    [[maybe_unused]] S loaded_ = 0;  // keeps compilers from leaving out loads

    alignas(64) std::uint32_t codes_[kRoom] = {};  // EdgeCode
    alignas(64) SampleIndex first_[kRoom] = {};    // the samples at which edges start
    alignas(64) float row_base_[3][kRoom] = {};
    alignas(64) S staged_[8 * kRoom] = {};
    BorderEdge borders_[kCapacity];
};

template <class T>
void emit_points_of(const EmitInput& input, std::size_t row_begin, std::size_t row_end, Vec3f* points,
                    Vec3f* normals, float* fractions) {
    const InsideBits& bits = input.bits;
    const std::uint64_t count = input.points.first_output(row_end) - input.points.first_output(row_begin);
    RowEdges edges(bits);
    PointBatch<T> batch(input, points, points + count, normals, fractions);

    AmbiguousRows ambiguous(input.ambiguous, row_begin);
    for (GridRow at(bits, row_begin); at.index < row_end; at.advance(bits)) {
        if (input.points.leaves()[at.index] == 0) continue;
        edges.list(input.active, RowBits(bits, at), at.index);
        batch.set_row(at.y - bits.first_y, at.z - bits.first_z);
        batch.add(edges.codes(), edges.count());
        if (HWY_LIKELY(!ambiguous.reach(at.index))) continue;
        // Other points are in the places of the inner ones until these are written.
        for (std::size_t left = ambiguous->inner_points; left > 0;) {
            const std::size_t fit = std::min(left, edges.count());
            batch.add(edges.codes(), fit);
            left -= fit;
        }
    }
    batch.flush();
}

void emit_points_any(const EmitInput& input, std::size_t row_begin, std::size_t row_end, Vec3f* points,
                     Vec3f* normals, float* fractions) {
    visit_sample_type(input.volume.type, [&](auto sample) {
        emit_points_of<decltype(sample)>(input, row_begin, row_end, points, normals, fractions);
    });
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(emit_points_any);

void emit_points(const EmitInput& input, std::size_t row_begin, std::size_t row_end, Vec3f* points,
                 Vec3f* normals, float* fractions) {
    const std::uint64_t first = input.points.first_output(row_begin);
    HWY_DYNAMIC_DISPATCH(emit_points_any)
    (input, row_begin, row_end, points + first, normals ? normals + first : nullptr,
     fractions ? fractions + first : nullptr);
    if (input.ambiguous == nullptr) return;
    for (AmbiguousRows rows(input.ambiguous, row_begin); rows.row() < row_end; rows.advance()) {
        if (rows->inner_points == 0) continue;
        const std::uint64_t at = input.points.first_output(rows.row() + 1) - rows->inner_points;
        input.ambiguous->emit_points(rows.row(), rows.cells(), points + at, normals ? normals + at : nullptr);
    }
}

}  // namespace marrow::internal
#endif
