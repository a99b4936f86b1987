/// Sampled volumes: samples on a regular grid, and the position of the grid in space.
#pragma once

#include <array>
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

/// Checks that a geometry can be worked with. \throw InputError dims that are negative or overflow, a spacing
/// that is not positive and finite, an origin that is not finite, a singular direction, or a corner beyond
/// the range of float32
MARROW_EXPORT void check_geometry(const Geometry& geometry);

class Volume;

/// A borrowed volume: its geometry, and a pointer to dims[2] * dims[1] * dims[0] samples, x fastest, without
/// padding. The samples must outlive the view. Functions throw InputError for a view with samples whose
/// pointer is null.
struct MARROW_EXPORT VolumeView {
    VolumeView() = default;
    template <class T>
    VolumeView(const T* samples, const Geometry& g) : geometry(g), type(sample_type_of<T>()), data(samples) {}
    VolumeView(const Volume& volume);
    VolumeView(Volume&&) = delete;  // the view would outlive its samples

    Geometry geometry;
    SampleType type = SampleType::uint8;
    const void* data = nullptr;
};

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
    const void* data() const { return samples_.data(); }
    void* data() { return samples_.data(); }
    /// The samples. \pre T is the volume's sample type
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
    Buffer<std::byte> samples_;
};

}  // namespace marrow
