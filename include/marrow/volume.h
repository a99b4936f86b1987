/// Sampled volumes: samples on a regular grid, and the position of the grid in space.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <marrow/buffer.h>
#include <marrow/export.h>
#include <marrow/vector.h>

namespace marrow {

/// The types a sample can have.
enum class SampleType { uint8, int8, uint16, int16, int32, float32, float64 };

/// Bytes of one sample.
MARROW_EXPORT std::size_t sample_size(SampleType type);
/// The type's name: "uint8", "int16", "float32", ...
MARROW_EXPORT const char* sample_type_name(SampleType type);

/// The SampleType of a C++ type.
template <class T>
constexpr SampleType sample_type_of() {
    if constexpr (std::is_same_v<T, std::uint8_t>)
        return SampleType::uint8;
    else if constexpr (std::is_same_v<T, std::int8_t>)
        return SampleType::int8;
    else if constexpr (std::is_same_v<T, std::uint16_t>)
        return SampleType::uint16;
    else if constexpr (std::is_same_v<T, std::int16_t>)
        return SampleType::int16;
    else if constexpr (std::is_same_v<T, std::int32_t>)
        return SampleType::int32;
    else if constexpr (std::is_same_v<T, float>)
        return SampleType::float32;
    else {
        static_assert(std::is_same_v<T, double>, "not a sample type");
        return SampleType::float64;
    }
}

/// Calls f with a value of the C++ type that `type` stands for, and returns what f returns. \pre `type` is
/// valid
template <class F>
decltype(auto) visit_sample_type(SampleType type, F&& f) {
    switch (type) {
        case SampleType::uint8:
            return f(std::uint8_t{});
        case SampleType::int8:
            return f(std::int8_t{});
        case SampleType::uint16:
            return f(std::uint16_t{});
        case SampleType::int16:
            return f(std::int16_t{});
        case SampleType::int32:
            return f(std::int32_t{});
        case SampleType::float32:
            return f(float{});
        case SampleType::float64:
            break;
    }
    return f(double{});
}

/// The position of a volume's samples in space: sample (i, j, k) is at origin + direction * (spacing .* (i,
/// j, k)). Physical space is LPS in mm (x to the patient's left, y to posterior, z to superior), as in DICOM
/// and ITK.
struct MARROW_EXPORT Geometry {
    std::array<std::int64_t, 3> dims{0, 0, 0};  ///< samples along i, j, k; i is fastest in memory
    Vec3d spacing{1, 1, 1};  ///< mm between neighbouring samples along each index axis, > 0
    Vec3d origin{0, 0, 0};   ///< position of sample (0, 0, 0)
    /// Column a is the unit vector of index axis a. The columns need not be orthogonal (a tilted gantry
    /// shears them), and the matrix may mirror.
    Mat3d direction{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

    /// direction * diag(spacing): the linear part of index -> physical.
    Mat3d index_to_physical() const;
    /// The position of (possibly fractional) index (i, j, k).
    Vec3d physical(const Vec3d& index) const;
    /// dims[0] * dims[1] * dims[2].
    std::int64_t sample_count() const { return dims[0] * dims[1] * dims[2]; }
};

/// Checks that a geometry can be worked with. \throw InputError dims that are negative, 2^30 or more, or
/// whose product overflows; a spacing that is not finite, or smaller than float32 can hold; an origin that is
/// not finite; a direction that is singular or nearly so; or a corner beyond the range of float32
MARROW_EXPORT void check_geometry(const Geometry& geometry);

/// What the samples of a volume stand for: value = slope * sample + intercept, in double. So a scan whose
/// values have a fraction keeps the 8 or 16 bits that it stores.
///
/// Isovalues, and all other numbers in the unit of a scan that functions take and give, are values. The
/// surface is that of the samples at sample(isovalue): a sample is inside if it is finite and at least that,
/// compared exactly. So a whole sample whose value is the isovalue is inside; with a fraction, rounding can
/// put it outside.
struct Rescale {
    double slope = 1;  ///< > 0, so that larger samples have larger values
    double intercept = 0;

    bool is_identity() const { return slope == 1 && intercept == 0; }
    /// The value that a sample stands for.
    double value(double sample) const { return is_identity() ? sample : slope * sample + intercept; }
    /// The sample that stands for a value: a whole one if it has exactly this value, or else
    /// (value - intercept) / slope.
    double sample(double of_value) const {
        if (is_identity()) return of_value;
        const double exact = (of_value - intercept) / slope, whole = std::round(exact);
        return value(whole) == of_value ? whole : exact;
    }

    friend bool operator==(const Rescale&, const Rescale&) = default;
};

class Volume;

/// A borrowed volume, or a part of one: its geometry, and a pointer to dims[2] * dims[1] * dims[0] samples, x
/// fastest. Rows and slices may be apart in memory. The samples must outlive the view.
///
/// A view of a part has the geometry of the whole volume, except for dims, and says with `first` where the
/// part begins. Its surface has the bits of the whole volume's surface: positions are computed from indices
/// in the whole. For normals, gradients at the part's border read the samples beyond it that `below` and
/// `above` allow; one on each side is enough. Where there are none, differences are one-sided, as at the
/// border of the whole.
///
/// Functions throw InputError for a view with samples whose pointer is null, for rows or slices that overlap,
/// for a bad rescale, and for negative values. (A mirrored array is a view with a mirrored direction matrix.)
struct MARROW_EXPORT VolumeView {
    VolumeView() = default;
    template <class T>
    VolumeView(const T* samples, const Geometry& g) : geometry(g), type(sample_type_of<T>()), data(samples) {}
    VolumeView(const Volume& volume);
    VolumeView(Volume&&) = delete;  // the view would outlive its samples

    /// Samples from the start of a row or a slice to the start of the next.
    std::int64_t row_pitch() const { return pitch[0] != 0 ? pitch[0] : geometry.dims[0]; }
    std::int64_t slice_pitch() const { return pitch[1] != 0 ? pitch[1] : row_pitch() * geometry.dims[1]; }
    /// The geometry of the view by itself: its origin is the position of the view's first sample.
    Geometry own_geometry() const;

    Geometry geometry;  ///< dims: of the view; the origin is the position of the whole's sample (0, 0, 0)
    SampleType type = SampleType::uint8;
    const void* data = nullptr;                  ///< the view's first sample
    Rescale rescale = {};                        ///< what the samples stand for
    std::array<std::int64_t, 2> pitch{0, 0};     ///< row_pitch() and slice_pitch(); 0: without gaps
    std::array<std::int64_t, 3> first{0, 0, 0};  ///< index in the whole volume of the view's first sample
    /// Samples before the view, and after it, that may be read along each axis.
    std::array<std::int64_t, 3> below{0, 0, 0}, above{0, 0, 0};
};

/// The part of a view that begins at its sample `begin` and has `dims` samples. No samples are copied.
/// \throw InputError the part leaves the view, or the view is not valid
MARROW_EXPORT VolumeView part_of(const VolumeView& volume, const std::array<std::int64_t, 3>& begin,
                                 const std::array<std::int64_t, 3>& dims);

/// An owned volume.
class MARROW_EXPORT Volume {
  public:
    Volume() = default;
    /// Allocates the samples, which are uninitialised. \throw InputError as check_geometry; LimitError not
    /// enough memory
    Volume(const Geometry& geometry, SampleType type);

    const Geometry& geometry() const { return geometry_; }
    /// Moves the volume in space. \throw InputError as check_geometry, or other dims than before
    void set_geometry(const Geometry& geometry);
    SampleType type() const { return type_; }
    /// What the samples stand for.
    const Rescale& rescale() const { return rescale_; }
    /// \throw InputError a slope that is negative, 0 or smaller than float32 can hold, or numbers that are
    /// not finite
    void set_rescale(const Rescale& rescale);
    const void* data() const { return samples_.data(); }
    void* data() { return samples_.data(); }
    /// The samples; rescale() gives their values. \pre T is the volume's sample type
    template <class T>
    const T* samples() const {
        return reinterpret_cast<const T*>(samples_.data());
    }
    template <class T>
    T* samples() {
        return reinterpret_cast<T*>(samples_.data());
    }
    std::size_t bytes() const { return samples_.size(); }

  private:
    Geometry geometry_;
    SampleType type_ = SampleType::uint8;
    Rescale rescale_;
    Buffer<std::byte> samples_;
};

}  // namespace marrow
