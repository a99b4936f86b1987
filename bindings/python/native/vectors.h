/// Vectors and matrices as sequences of numbers in Python. Include it wherever a
/// function takes or returns them.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <array>

#include <marrow/vector.h>

namespace pybind11::detail {

/// Vec3 as three numbers; Mat3d, an array of Vec3, is then three rows.
template <class T>
struct type_caster<marrow::Vec3<T>> {
    PYBIND11_TYPE_CASTER(marrow::Vec3<T>, const_name("tuple[float, float, float]"));

    bool load(handle source, bool convert) {
        make_caster<std::array<T, 3>> three;
        if (!three.load(source, convert)) return false;
        const auto& values = cast_op<std::array<T, 3>&>(three);
        value = {values[0], values[1], values[2]};
        return true;
    }

    static handle cast(const marrow::Vec3<T>& v, return_value_policy, handle) {
        return make_tuple(v[0], v[1], v[2]).release();
    }
};

}  // namespace pybind11::detail
