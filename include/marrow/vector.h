/// Three-dimensional vectors and matrices.
#pragma once

#include <array>
#include <cmath>
#include <compare>
#include <cstddef>

namespace marrow {

/// A position, a direction, or three values along the axes x, y and z.
template <class T>
struct Vec3 {
    T values[3];

    constexpr T& operator[](std::size_t axis) { return values[axis]; }
    constexpr const T& operator[](std::size_t axis) const { return values[axis]; }
    static constexpr std::size_t size() { return 3; }
    constexpr T* data() { return values; }
    constexpr const T* data() const { return values; }
    constexpr T* begin() { return values; }
    constexpr const T* begin() const { return values; }
    constexpr T* end() { return values + 3; }
    constexpr const T* end() const { return values + 3; }

    friend constexpr auto operator<=>(const Vec3&, const Vec3&) = default;
};

using Vec3f = Vec3<float>;
using Vec3d = Vec3<double>;
using Mat3d = std::array<Vec3d, 3>;  ///< m[row][column]

constexpr Vec3d to_double(const Vec3f& v) {
    return {v[0], v[1], v[2]};
}
constexpr Vec3f to_float(const Vec3d& v) {
    return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

constexpr Vec3d operator+(const Vec3d& a, const Vec3d& b) {
    return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
constexpr Vec3d operator-(const Vec3d& a, const Vec3d& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
constexpr Vec3d operator*(double s, const Vec3d& a) {
    return {s * a[0], s * a[1], s * a[2]};
}
constexpr double dot(const Vec3d& a, const Vec3d& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
constexpr Vec3d cross(const Vec3d& a, const Vec3d& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double length(const Vec3d& a) {
    return std::sqrt(dot(a, a));
}

constexpr Vec3d column(const Mat3d& m, std::size_t index) {
    return {m[0][index], m[1][index], m[2][index]};
}
constexpr Vec3d operator*(const Mat3d& m, const Vec3d& v) {
    return {dot(m[0], v), dot(m[1], v), dot(m[2], v)};
}
constexpr double determinant(const Mat3d& m) {
    return dot(column(m, 0), cross(column(m, 1), column(m, 2)));
}
/// The cofactors: determinant(m) times the transpose of the inverse. They map normals as m maps positions,
/// except for their length; where m mirrors, they turn normals over.
constexpr Mat3d cofactors(const Mat3d& m) {
    return {cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])};
}
/// The inverse, by Cramer's rule. \pre determinant(m) is not 0
constexpr Mat3d inverse(const Mat3d& m) {
    const double scale = 1 / determinant(m);
    return {scale * cross(column(m, 1), column(m, 2)), scale * cross(column(m, 2), column(m, 0)),
            scale * cross(column(m, 0), column(m, 1))};
}

}  // namespace marrow
