// Where the 3D view is seen from.
#pragma once

#include <functional>

#include <vtkCamera.h>

#include "ray_pick.h"

namespace marrow::viewer {

/// The side that the patient is seen from.
enum class Side { anterior, posterior, left, right, superior, inferior };

/// From the patient towards who looks, and what is up for them; unit length, LPS.
struct Aim {
    Vec3d towards, up;
};

Aim aim_from(Side side);
/// From the front left, a little from above.
Aim aim_from_front_left();

/// Calls the given function with positions, LPS mm.
using Points = std::function<void(const std::function<void(const Vec3d&)>&)>;

/// Places the camera as near as all points fit into a picture of this width : height. Leaves it alone where there are none.
void fit(vtkCamera* camera, const Aim& aim, double aspect, const Points& points);

/// Turns round the patient's long axis, as on a turntable.
void turn_camera(vtkCamera* camera, double degrees);

/// How far along the line through `start` its nearest approach to the ray is, in lengths of `step`; none where the two are
/// all but parallel.
std::optional<double> along_line(const Vec3d& start, const Vec3d& step, const Ray& ray);

}  // namespace marrow::viewer
