/// The colours of a surface that show how far it can be trusted, and their legend in the 3D view.
#pragma once

#include <vtkLookupTable.h>
#include <vtkNew.h>
#include <vtkRenderer.h>
#include <vtkScalarBarActor.h>

#include <QString>

#include <marrow/trust.h>

#include "model/session.h"

namespace marrow::viewer {

/// The distance, mm, at which the colours end. Noise moves surfaces less, so its scale is finer.
double largest_shown(Colouring colouring, const TrustReport& report);

/// The title of the legend: what the numbers are.
QString legend_title(Colouring colouring, const TrustReport& report, bool hounsfield);

/// A horizontal bar in the lower left corner.
class TrustLegend {
  public:
    TrustLegend();
    void add_to(vtkRenderer* renderer) { renderer->AddActor2D(bar_); }
    /// Colours for the distances of this report. \pre the colouring shows trust
    void show(Colouring colouring, const TrustReport& report, bool hounsfield);
    void hide() { bar_->VisibilityOff(); }
    void set_light(bool light);
    /// Places the bar in a window of this size in pixels.
    void follow(int width, int height, double pixel_ratio);

    /// Maps distances in mm to colours.
    vtkLookupTable* colours() { return colours_; }
    bool visible() const { return bar_->GetVisibility() != 0; }

  private:
    vtkNew<vtkScalarBarActor> bar_;
    vtkNew<vtkLookupTable> colours_;
};

}  // namespace marrow::viewer
