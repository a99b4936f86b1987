#include "volume.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <marrow/error.h>

#include "module.h"
#include "vectors.h"

namespace py = pybind11;

namespace marrow::python {

namespace {

// How an array lies in memory. Axis m of the view is axis `axes[m]` of the array;
// its step in bytes is positive.
struct Layout {
    explicit Layout(const py::array& array) {
        const auto stride = [&](py::ssize_t axis) { return std::abs(array.strides(axis)); };
        // An axis that NumPy added has one sample and the stride 0, which is that of no neighbour.
        const auto distance = [&](py::ssize_t axis) {
            return stride(axis) > 0 ? stride(axis) : std::numeric_limits<py::ssize_t>::max();
        };
        if ((array.flags() & py::array::c_style) == 0)
            std::stable_sort(axes.begin(), axes.end(),
                             [&](py::ssize_t a, py::ssize_t b) { return distance(a) < distance(b); });
        first = static_cast<const char*>(array.data());
        for (std::size_t m = 0; m < 3; ++m) {
            size[m] = array.shape(axes[m]);
            step[m] = stride(axes[m]);
            backward[m] = size[m] > 1 && array.strides(axes[m]) < 0;
            if (backward[m]) first -= (size[m] - 1) * step[m];
        }
    }

    // Whether a VolumeView can describe it: the samples of a row follow each other, and
    // rows and slices do not overlap.
    bool has_rows(py::ssize_t sample_bytes) const {
        if (size[0] > 1 && step[0] != sample_bytes) return false;
        py::ssize_t extent = size[0] * sample_bytes;
        for (std::size_t m = 1; m < 3; ++m) {
            if (size[m] <= 1) continue;
            if (step[m] < extent || step[m] % sample_bytes != 0) return false;
            extent += step[m] * (size[m] - 1);
        }
        return true;
    }

    // The pitches of a VolumeView: samples from row to row and from slice to slice.
    std::array<std::int64_t, 2> pitch(py::ssize_t sample_bytes) const {
        const std::int64_t row = size[1] > 1 ? step[1] / sample_bytes : size[0];
        return {row, size[2] > 1 ? step[2] / sample_bytes : row * size[1]};
    }

    std::array<py::ssize_t, 3> axes{2, 1, 0};
    std::array<py::ssize_t, 3> size{}, step{};
    std::array<bool, 3> backward{};
    const char* first = nullptr;  // the sample at the lowest address
};

// The geometry of the same samples with other axes: axis m is axis `axes[m]` of before, perhaps backward.
Geometry with_axes(const Geometry& before, const std::array<std::size_t, 3>& axes,
                   const std::array<bool, 3>& backward) {
    Geometry geometry;
    geometry.origin = before.origin;
    for (std::size_t m = 0; m < 3; ++m) {
        const std::size_t axis = axes[m];
        geometry.dims[m] = before.dims[axis];
        geometry.spacing[m] = before.spacing[axis];
        for (std::size_t row = 0; row < 3; ++row) {
            const double along = before.direction[row][axis];
            geometry.direction[row][m] = backward[m] ? -along : along;
            if (backward[m])
                geometry.origin[row] +=
                    along * before.spacing[axis] * static_cast<double>(before.dims[axis] - 1);
        }
    }
    return geometry;
}

bool is_same(const Geometry& a, const Geometry& b) {
    return a.dims == b.dims && a.spacing == b.spacing && a.origin == b.origin && a.direction == b.direction;
}

// An array, indexed [k, j, i], that takes the samples of a volume over.
py::array array_of(Volume&& volume) {
    const auto [nx, ny, nz] = volume.geometry().dims;
    auto owner = std::make_unique<Volume>(std::move(volume));
    const py::capsule capsule(owner.get(), [](void* p) { delete static_cast<Volume*>(p); });
    Volume& samples = *owner.release();
    return {dtype_of(samples.type()), std::vector<py::ssize_t>{nz, ny, nx}, samples.data(), capsule};
}

py::tuple as_tuple(py::array array, const Geometry& geometry, const Rescale& rescale) {
    return py::make_tuple(std::move(array), geometry.spacing, geometry.origin, geometry.direction,
                          py::make_tuple(rescale.slope, rescale.intercept));
}

}  // namespace

py::dtype dtype_of(SampleType type) {
    return visit_sample_type(type, [](auto sample) { return py::dtype::of<decltype(sample)>(); });
}

SampleType sample_type_of(const py::dtype& type) {
    const char kind = type.kind();
    const py::ssize_t bytes = type.itemsize();
    if (type.attr("isnative").cast<bool>()) {
        if (kind == 'u' && bytes == 1) return SampleType::uint8;
        if (kind == 'i' && bytes == 1) return SampleType::int8;
        if (kind == 'u' && bytes == 2) return SampleType::uint16;
        if (kind == 'i' && bytes == 2) return SampleType::int16;
        if (kind == 'i' && bytes == 4) return SampleType::int32;
        if (kind == 'f' && bytes == 4) return SampleType::float32;
        if (kind == 'f' && bytes == 8) return SampleType::float64;
    }
    throw InputError("samples cannot be of type " + py::str(py::handle(type)).cast<std::string>());
}

ArrayVolume::ArrayVolume(py::array array, const Geometry& placement, const Rescale& rescale)
    : array_(std::move(array)) {
    if (array_.ndim() != 3)
        throw InputError("a volume has three axes, and the array has " + std::to_string(array_.ndim()));
    view_.type = sample_type_of(array_.dtype());
    const bool aligned = (array_.flags() & py::detail::npy_api::NPY_ARRAY_ALIGNED_) != 0;
    Layout layout(array_);
    if (!aligned || !layout.has_rows(array_.itemsize())) {
        array_ = array_.attr("copy")("C");
        layout = Layout(array_);
        is_copy_ = true;
    }
    placement_ = placement;
    for (std::size_t m = 0; m < 3; ++m) {
        placement_.dims[m] = array_.shape(static_cast<py::ssize_t>(2 - m));
        axes_[m] = static_cast<std::size_t>(2 - layout.axes[m]);
    }
    backward_ = layout.backward;
    view_.geometry = with_axes(placement_, axes_, backward_);
    view_.data = layout.first;
    view_.pitch = layout.pitch(array_.itemsize());
    view_.rescale = rescale;
    check_geometry(view_.geometry);
}

ArrayVolume ArrayVolume::in_array_order() const {
    const bool is_ordered =
        axes_ == std::array<std::size_t, 3>{0, 1, 2} && backward_ == std::array<bool, 3>{};
    return is_ordered ? *this : ArrayVolume(array_.attr("copy")("C"), placement_, view_.rescale);
}

py::tuple ArrayVolume::to_python(Volume&& volume) const {
    std::array<std::size_t, 3> axes{};
    std::array<bool, 3> backward{};
    for (std::size_t m = 0; m < 3; ++m) {
        axes[axes_[m]] = m;
        backward[axes_[m]] = backward_[m];
    }
    // There and back, the origin of backward axes would be rounded.
    const Geometry geometry = is_same(volume.geometry(), view_.geometry)
                                  ? placement_
                                  : with_axes(volume.geometry(), axes, backward);
    const Rescale rescale = volume.rescale();
    py::array array = array_of(std::move(volume));
    array = array.attr("transpose")(2 - axes[2], 2 - axes[1], 2 - axes[0]);
    const auto direction = [&](std::size_t axis) {
        return py::slice(py::none(), py::none(), py::int_(backward[axis] ? -1 : 1));
    };
    array = array[py::make_tuple(direction(2), direction(1), direction(0))];
    return as_tuple(std::move(array), geometry, rescale);
}

py::tuple to_python(Volume&& volume) {
    const Geometry geometry = volume.geometry();
    const Rescale rescale = volume.rescale();
    return as_tuple(array_of(std::move(volume)), geometry, rescale);
}

void add_volume(py::module_& module) {
    module.def(
        "check_geometry",
        [](const std::array<std::int64_t, 3>& shape, const Vec3d& spacing, const Vec3d& origin,
           const Mat3d& direction) {
            check_geometry({{shape[2], shape[1], shape[0]}, spacing, origin, direction});
        },
        py::arg("shape"), py::arg("spacing"), py::arg("origin"), py::arg("direction"));
    py::class_<ArrayVolume>(module, "ArrayVolume")
        .def(py::init([](py::array array, const Vec3d& spacing, const Vec3d& origin, const Mat3d& direction,
                         const std::array<double, 2>& rescale) {
                 return ArrayVolume(std::move(array), Geometry{{}, spacing, origin, direction},
                                    {rescale[0], rescale[1]});
             }),
             py::arg("array").noconvert(), py::arg("spacing"), py::arg("origin"), py::arg("direction"),
             py::arg("rescale") = std::array<double, 2>{1, 0})
        .def_property_readonly("is_copy", &ArrayVolume::is_copy)
        .def_property_readonly(
            "address", [](const ArrayVolume& v) { return reinterpret_cast<std::uintptr_t>(v.view().data); });
}

}  // namespace marrow::python
