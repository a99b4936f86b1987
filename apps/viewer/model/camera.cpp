// Places and turns the camera of the 3D view.
#include "camera.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace marrow::viewer {

CameraState camera_state(vtkCamera* camera) {
    CameraState state;
    camera->GetPosition(state.position.data());
    camera->GetFocalPoint(state.focal_point.data());
    camera->GetViewUp(state.up.data());
    return state;
}

void set_camera_state(vtkCamera* camera, const CameraState& state) {
    camera->SetPosition(state.position.data());
    camera->SetFocalPoint(state.focal_point.data());
    camera->SetViewUp(state.up.data());
}

Viewpoint viewpoint_from(Side side) {
    switch (side) {
        case Side::anterior:
            return {{0, -1, 0}, {0, 0, 1}};
        case Side::posterior:
            return {{0, 1, 0}, {0, 0, 1}};
        case Side::left:
            return {{1, 0, 0}, {0, 0, 1}};
        case Side::right:
            return {{-1, 0, 0}, {0, 0, 1}};
        case Side::superior:
            return {{0, 0, 1}, {0, -1, 0}};
        case Side::inferior:
            break;
    }
    return {{0, 0, -1}, {0, -1, 0}};
}

Viewpoint front_left_viewpoint() {
    constexpr double kTurn = 30 * M_PI / 180, kRise = 10 * M_PI / 180;
    return {{std::sin(kTurn) * std::cos(kRise), -std::cos(kTurn) * std::cos(kRise), std::sin(kRise)},
            {0, 0, 1}};
}

void fit_camera(vtkCamera* camera, const Viewpoint& viewpoint, double aspect, double closest,
                const Points& points) {
    const Vec3d& towards = viewpoint.towards_viewer;
    const Vec3d right = unit(cross(viewpoint.up, towards)), up = cross(towards, right);
    const auto each_point = [&](auto visit) {
        points([&](const Vec3d& p) { visit(Vec3d{dot(right, p), dot(up, p), dot(towards, p)}); });
    };
    Vec3d lower{1e300, 1e300, 1e300}, upper{-1e300, -1e300, -1e300};
    each_point([&](const Vec3d& p) {
        for (std::size_t a = 0; a < 3; ++a) {
            lower[a] = std::min(lower[a], p[a]);
            upper[a] = std::max(upper[a], p[a]);
        }
    });
    if (lower[0] > upper[0]) return;
    Vec3d middle;
    for (std::size_t a = 0; a < 3; ++a) middle[a] = (lower[a] + upper[a]) / 2;
    const double slope = std::tan(camera->GetViewAngle() / 2 * M_PI / 180);
    double distance = closest;
    each_point([&](const Vec3d& p) {
        const double across = std::max(std::abs(p[0] - middle[0]) / aspect, std::abs(p[1] - middle[1]));
        distance = std::max(distance, 1.12 * across / slope + p[2] - middle[2]);
    });
    Vec3d focal, position;
    for (std::size_t a = 0; a < 3; ++a) {
        focal[a] = middle[0] * right[a] + middle[1] * up[a] + middle[2] * towards[a];
        position[a] = focal[a] + distance * towards[a];
    }
    camera->SetFocalPoint(focal.data());
    camera->SetPosition(position.data());
    camera->SetViewUp(up.data());
}

void turn_camera(vtkCamera* camera, double degrees) {
    Vec3d focal, position, up;
    camera->GetFocalPoint(focal.data());
    camera->GetPosition(position.data());
    camera->GetViewUp(up.data());
    const double c = std::cos(degrees * M_PI / 180), s = std::sin(degrees * M_PI / 180);
    const auto turned = [&](double x, double y) { return std::pair{c * x - s * y, s * x + c * y}; };
    std::tie(position[0], position[1]) = turned(position[0] - focal[0], position[1] - focal[1]);
    std::tie(up[0], up[1]) = turned(up[0], up[1]);
    camera->SetPosition(position[0] + focal[0], position[1] + focal[1], position[2]);
    camera->SetViewUp(up.data());
}

std::optional<double> nearest_on_line(const Vec3d& start, const Vec3d& step, const Ray& ray) {
    // Where the common perpendicular of both lines meets the first one.
    const Vec3d common = cross(step, ray.direction);
    const double size = dot(common, common);
    if (size < 1e-4 * dot(step, step)) return {};
    return dot(cross(ray.origin - start, ray.direction), common) / size;
}

}  // namespace marrow::viewer
