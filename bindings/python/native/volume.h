/// Volumes between NumPy and Marrow, without copies.
#pragma once

#include <array>
#include <cstddef>

#include <pybind11/numpy.h>

#include <marrow/volume.h>

namespace marrow::python {

/// The sample type of an array. \throw InputError there is none, or it is not in the machine's byte order
SampleType sample_type_of(const pybind11::dtype& type);

/// The type of arrays with these samples.
pybind11::dtype dtype_of(SampleType type);

/// A view of an array's samples that keeps the array alive.
///
/// Any axis can be the fastest in memory, and axes can run backward: the view's axes are sorted by stride,
/// and its geometry is permuted and flipped with them, so that each sample keeps its position. Only arrays
/// without rows are copied: where no axis has its samples next to each other, or where samples overlap.
class ArrayVolume {
  public:
    /// The array is indexed [k, j, i], and `placement` is the geometry of (i, j, k); its dims do not count.
    /// \throw InputError not three axes, not a sample type in the machine's byte order, or bad geometry
    ArrayVolume(pybind11::array array, const Geometry& placement, const Rescale& rescale);

    const VolumeView& view() const { return view_; }
    /// The samples with the axes i, j and k in this order, for what depends on the order. It is a copy unless
    /// they have it in memory.
    ArrayVolume in_array_order() const;
    /// Whether the view reads a copy of the array that it was made of.
    bool is_copy() const { return is_copy_; }

    /// A volume with the axes of the view as the function to_python() returns it, but with the array's axes.
    pybind11::tuple to_python(Volume&& volume) const;

  private:
    pybind11::array array_;
    VolumeView view_;
    Geometry placement_;
    std::array<std::size_t, 3> axes_{0, 1, 2};  // those of (i, j, k) that the view's axes are
    std::array<bool, 3> backward_{};            // which of these run the other way
    bool is_copy_ = false;
};

/// A volume as the tuple (array, spacing, origin, direction, rescale), where the last is (slope, intercept).
/// The array, indexed [k, j, i], takes the samples over; they live as long as any view of it.
pybind11::tuple to_python(Volume&& volume);

}  // namespace marrow::python
