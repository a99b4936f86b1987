// Dragging the sides of the crop box in space by their handles.
#pragma once

#include <optional>

#include <QMouseEvent>

#include "model/surfaces.h"

namespace marrow::viewer {

class SurfaceView;

class CropDrag {
  public:
    CropDrag(Session& session, Surfaces& surfaces, const SurfaceView& view)
        : session_(session), surfaces_(surfaces), view_(view) {}

    /// Presses on a handle, and what follows until the release: moves its side. Returns whether the event was one of
    /// these.
    bool take(const QMouseEvent& mouse);

  private:
    std::optional<CropSide> side_at(const QPoint& place) const;
    std::optional<double> index_at(const CropSide& side, const QPoint& place) const;

    Session& session_;
    Surfaces& surfaces_;
    const SurfaceView& view_;
    std::optional<CropSide> side_;
    double grip_ = 0;  // from the hand to the outer sample of the side that it drags
};

}  // namespace marrow::viewer
