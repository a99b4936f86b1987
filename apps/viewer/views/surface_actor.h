// A surface as the 3D view draws it.
#pragma once

#include <memory>

#include <vtkActor.h>
#include <vtkNew.h>
#include <vtkPlane.h>
#include <vtkPolyDataMapper.h>
#include <vtkRenderer.h>

#include "model/surfaces.h"

namespace marrow::viewer {

/// Keeps two shapes, full and preview, so that either can be drawn without being sent to the graphics card anew.
class SurfaceActor {
  public:
    SurfaceActor();

    /// Takes over a surface's newest shape, and the preview that goes with it or null.
    void set_shapes(std::shared_ptr<const Shape> newest, std::shared_ptr<const Shape> preview);
    void set_look(const SurfaceParameters& surface, DrawMode mode);
    /// What is on the plane's wrong side is not drawn; null: all is.
    void set_cut(vtkPlane* plane);
    /// Draws the preview, where there is one, if there is no full shape or `coarse` asks for it.
    void choose(bool coarse);

    vtkActor* actor() { return actor_; }
    /// What stands for the surface: full, or else preview; null without either.
    const Shape* shape() const { return full_ ? full_.get() : preview_.get(); }
    bool visible() const { return actor_->GetVisibility() != 0; }
    bool drawn_full() const { return full_ && actor_->GetMapper() == full_mapper_; }

  private:
    vtkNew<vtkActor> actor_;
    vtkNew<vtkPolyDataMapper> full_mapper_, preview_mapper_;
    std::shared_ptr<const Shape> full_, preview_;  // whose memory the mappers use
    bool glass_ = false;
};

}  // namespace marrow::viewer
