/// Draws a surface in the 3D view.
#pragma once

#include <memory>

#include <vtkActor.h>
#include <vtkNew.h>
#include <vtkPlane.h>
#include <vtkPolyDataMapper.h>
#include <vtkRenderer.h>
#include <vtkScalarsToColors.h>
#include <vtkSmartPointer.h>

#include "model/surfaces.h"

namespace marrow::viewer {

/// Keeps both the full shape and the preview on the graphics card, so that switching between them costs
/// nothing.
class SurfaceActor {
  public:
    SurfaceActor();

    /// Sets the newest shape of the surface, and its preview or null.
    void set_shapes(std::shared_ptr<const Shape> newest, std::shared_ptr<const Shape> preview);
    void set_look(const SurfaceParameters& surface, DrawMode mode);
    /// Colours the shapes that have trust by it; `colours` maps mm to colours.
    void set_colouring(Colouring colouring, vtkScalarsToColors* colours);
    /// Makes lines and points as wide as on a screen with this ratio of pixels.
    void set_pixel_ratio(double ratio);
    /// Hides everything behind the plane; null: shows everything.
    void set_cut(vtkPlane* plane);
    /// Draws the preview, if there is one and either `coarse` is true or there is no full shape.
    void choose(bool coarse);

    vtkActor* actor() { return actor_; }
    /// The full shape, or else the preview; null without either.
    const Shape* shape() const { return full_ ? full_.get() : preview_.get(); }
    bool visible() const { return actor_->GetVisibility() != 0; }
    bool drawn_full() const { return full_ && actor_->GetMapper() == full_mapper_; }

  private:
    void follow_colouring();

    vtkNew<vtkActor> actor_;
    vtkNew<vtkPolyDataMapper> full_mapper_, preview_mapper_;
    std::shared_ptr<const Shape> full_, preview_;  // they own the memory that the mappers use
    Colouring colouring_ = Colouring::own;
    vtkSmartPointer<vtkScalarsToColors> colours_;
    bool glass_ = false, edges_ = false;
};

}  // namespace marrow::viewer
