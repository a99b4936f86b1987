/// Camera positions of the 3D view.
#pragma once

#include <functional>

#include <vtkCamera.h>

#include "ray_pick.h"

namespace marrow::viewer {

/// The side from which the patient is seen.
enum class Side { anterior, posterior, left, right, superior, inferior };

/// The direction from the patient to the viewer, and the direction that is up on the screen. Unit vectors,
/// LPS.
struct Viewpoint {
    Vec3d towards_viewer, up;
};

/// Where a camera is, what it looks at, and which direction is up, LPS mm.
struct CameraState {
    Vec3d position{0, 0, 0}, focal_point{0, 0, 0}, up{0, 0, 0};
};

CameraState camera_state(vtkCamera* camera);
void set_camera_state(vtkCamera* camera, const CameraState& state);

Viewpoint viewpoint_from(Side side);
/// From the front left, slightly from above.
Viewpoint front_left_viewpoint();

/// Calls the given function with each position, LPS mm.
using Points = std::function<void(const std::function<void(const Vec3d&)>&)>;

/// Moves the camera as close as possible so that all points fit into an image with this width-to-height
/// ratio, but no closer than `closest`, mm. Does nothing without points.
void fit_camera(vtkCamera* camera, const Viewpoint& viewpoint, double aspect, double closest,
                const Points& points);

/// Rotates the camera about the patient's long axis, as on a turntable.
void turn_camera(vtkCamera* camera, double degrees);

/// The point on the line start + t * step that is nearest to the ray, as t; nothing if the two are nearly
/// parallel.
std::optional<double> nearest_on_line(const Vec3d& start, const Vec3d& step, const Ray& ray);

}  // namespace marrow::viewer
