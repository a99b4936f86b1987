/// The parts of the 3D scene other than the surfaces: cut face, crosshair, crop box, marks and orientation
/// cube. Lines, dots and texts have the same size on every screen and in pictures of every size: they are as
/// many pixels wide as their part says, times the pixel ratio.
#pragma once

#include <array>
#include <vector>

#include <vtkActor.h>
#include <vtkAnnotatedCubeActor.h>
#include <vtkBillboardTextActor3D.h>
#include <vtkCamera.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>
#include <vtkTexture.h>

#include "model/session.h"

namespace marrow::viewer {

/// The colours of the planes, the same as in 3D Slicer.
QColor plane_colour(Plane plane);
inline const QColor kCropColour(0xff, 0xa6, 0x3d);
/// All sides of a crop box.
inline constexpr std::array<CropSide, 6> kCropSides{
    {{0, false}, {0, true}, {1, false}, {1, true}, {2, false}, {2, true}}};

/// The slice on a cut, restricted to samples in the crop box and inside the outermost surface.
class CutFace {
  public:
    CutFace();
    void add_to(vtkRenderer* renderer) { renderer->AddActor(actor_); }
    void show(const Scan& scan, const SampleBox& box, Plane plane, const Vec3d& crosshair,
              const Window& window, double lowest_isovalue);
    void hide() { actor_->VisibilityOff(); }

  private:
    vtkNew<vtkActor> actor_;
    vtkNew<vtkPolyData> quad_;
    vtkNew<vtkImageData> pixels_;
    vtkNew<vtkTexture> texture_;
};

/// Three lines through the scan that meet at the crosshair.
class Crosshair {
  public:
    Crosshair();
    void add_to(vtkRenderer* renderer);
    void set_position(const Geometry& geometry, const Vec3d& index);
    void set_visible(bool visible);
    bool visible() const { return visible_; }
    void set_pixel_ratio(double ratio);

  private:
    struct Line {
        vtkNew<vtkPolyData> data;
        vtkNew<vtkActor> actor;
    };
    std::array<Line, 3> lines_;
    bool visible_ = true, has_position_ = false;
};

/// The outline of the crop box with a handle on each side. Like closed surfaces, it extends half a sample
/// beyond the outer samples.
class CropBox {
  public:
    CropBox();
    void add_to(vtkRenderer* renderer);
    void set_box(const Geometry& geometry, const SampleBox& box);
    void set_visible(bool visible);
    void set_pixel_ratio(double ratio);
    /// The index of the centre of a side.
    static Vec3d handle(const SampleBox& box, const CropSide& side);

  private:
    vtkNew<vtkPolyData> edges_, handles_;
    vtkNew<vtkActor> edges_actor_, handles_actor_;
};

/// Measured distances and angles with their values.
class Marks {
  public:
    void add_to(vtkRenderer* renderer) { renderer_ = renderer; }
    void show(const std::vector<Measurement>& measurements, const std::vector<Vec3d>& picked);
    void set_light(bool light);
    void set_pixel_ratio(double ratio);

  private:
    void add(const std::vector<Vec3d>& points, const QString& text);

    vtkRenderer* renderer_ = nullptr;
    std::vector<vtkSmartPointer<vtkActor>> lines_;
    std::vector<vtkSmartPointer<vtkBillboardTextActor3D>> labels_;
    std::vector<Measurement> measurements_;
    std::vector<Vec3d> picked_;
    bool light_ = false;
};

/// A cube in the corner that is labelled with the patient's directions.
class OrientationCube {
  public:
    OrientationCube();
    void add_to(vtkRenderer* renderer) { renderer->AddActor(cube_); }
    /// Turns the cube like the scene, in the lower right corner of a window of this size in pixels.
    void follow(vtkCamera* scene, vtkRenderer* corner, int width, int height, double pixel_ratio);

  private:
    vtkNew<vtkAnnotatedCubeActor> cube_;
};

}  // namespace marrow::viewer
