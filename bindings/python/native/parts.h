/// Parts of volumes, and what processes exchange about them: tuples of arrays.
#pragma once

#include <pybind11/numpy.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <type_traits>
#include <utility>

#include <marrow/error.h>
#include <marrow/volume.h>

#include "volume.h"

namespace marrow::python {

using Index = std::array<std::int64_t, 3>;  ///< x, y, z

/// The samples of a part, and those around it that it may read.
class ArrayPart {
  public:
    /// `array` [k, j, i] begins at index `array_first` of the whole volume, and the part,
    /// of `dims` samples, at `first`.
    /// \throw InputError other arrays, or a part that is not within its array
    ArrayPart(pybind11::array array, const Index& array_first, const Index& first, const Index& dims,
              const Index& whole, const Vec3d& spacing, const Vec3d& origin, const Mat3d& direction)
        : array_(std::move(array)), whole_(whole) {
        const bool aligned = (array_.flags() & pybind11::detail::npy_api::NPY_ARRAY_ALIGNED_) != 0;
        if (array_.ndim() != 3 || !(array_.flags() & pybind11::array::c_style) || !aligned)
            throw InputError("the samples of a part are not an aligned, C-contiguous array with three axes");
        const Index stored{array_.shape(2), array_.shape(1), array_.shape(0)};
        view_.type = sample_type_of(array_.dtype());
        view_.geometry = {dims, spacing, origin, direction};
        view_.first = first;
        view_.pitch = {stored[0], stored[0] * stored[1]};
        std::int64_t offset = 0, step = 1;
        for (std::size_t a = 0; a < 3; ++a) {
            view_.below[a] = first[a] - array_first[a];
            view_.above[a] = stored[a] - view_.below[a] - dims[a];
            if (view_.below[a] < 0 || view_.above[a] < 0 || dims[a] < 1)
                throw InputError("a part is not within its array");
            offset += step * view_.below[a];
            step *= stored[a];
        }
        view_.data = static_cast<const char*>(array_.data()) + offset * array_.itemsize();
    }

    const VolumeView& view() const { return view_; }
    const Index& whole() const { return whole_; }
    const pybind11::array& array() const { return array_; }

  private:
    pybind11::array array_;
    VolumeView view_;
    Index whole_;
};

/// An array that owns the numbers of a vector, without a copy.
template <class Vector>
pybind11::array to_array(Vector&& values) {
    using T = typename std::decay_t<Vector>::value_type;
    auto owner = std::make_unique<std::decay_t<Vector>>(std::forward<Vector>(values));
    const pybind11::capsule capsule(owner.get(),
                                    [](void* p) { delete static_cast<std::decay_t<Vector>*>(p); });
    auto& owned = *owner.release();
    return pybind11::array_t<T>(static_cast<pybind11::ssize_t>(owned.size()), owned.data(), capsule);
}

/// Copies an array of what Vector holds. Arrays that came from another process need not be aligned.
/// \throw InputError the array has not whole elements
template <class Vector>
Vector to_vector(const pybind11::handle& object) {
    using Element = typename Vector::value_type;
    const auto array = object.cast<pybind11::array>();
    if (!(array.flags() & pybind11::array::c_style) ||
        static_cast<std::size_t>(array.nbytes()) % sizeof(Element) != 0)
        throw InputError("an array of a part was changed");
    Vector values(static_cast<std::size_t>(array.nbytes()) / sizeof(Element));
    if (!values.empty()) std::memcpy(values.data(), array.data(), values.size() * sizeof(Element));
    return values;
}

}  // namespace marrow::python
