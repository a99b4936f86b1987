/// The colours of a surface that show how far it can be trusted, and their legend in the 3D view.
#pragma once

#include <array>

#include <vtkActor2D.h>
#include <vtkLookupTable.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkRenderer.h>
#include <vtkTextActor.h>

#include <QString>

#include <marrow/trust.h>

#include "model/session.h"

namespace marrow::viewer {

/// The distance, mm, at which the colours end. Noise moves surfaces less, so its scale is finer.
double largest_shown(Colouring colouring, const TrustReport& report);

/// The title of the legend: what the numbers are.
QString legend_title(Colouring colouring, const TrustReport& report, bool hounsfield);

/// A title, a bar of colours and three numbers below it, in the lower left corner.
class TrustLegend {
  public:
    TrustLegend();
    void add_to(vtkRenderer* renderer);
    /// Colours for the distances of this report. \pre the colouring shows trust
    void show(Colouring colouring, const TrustReport& report, bool hounsfield);
    void hide();
    void set_light(bool light);
    /// Sets the size for a window with this ratio of pixels.
    void set_pixel_ratio(double ratio);

    /// Maps distances in mm to colours.
    vtkLookupTable* colours() { return colours_; }

  private:
    std::array<vtkActor2D*, 6> parts();
    std::array<vtkTextActor*, 4> texts();
    void set_visible(bool visible);

    vtkNew<vtkLookupTable> colours_;
    vtkNew<vtkPolyData> box_, bar_;
    vtkNew<vtkActor2D> box_actor_, bar_actor_;
    vtkNew<vtkTextActor> title_;
    std::array<vtkNew<vtkTextActor>, 3> numbers_;
};

}  // namespace marrow::viewer
