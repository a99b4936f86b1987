/// Arranges the 3D view and the slices.
#pragma once

#include <array>
#include <optional>

#include <QSplitter>
#include <QVariantMap>
#include <QWidget>

#include "slice_view.h"
#include "surface_view.h"

namespace marrow::viewer {

enum class Layout { column, square };  ///< slices beside the 3D view; four views of equal size

/// A double click on a view shows it alone, and the next one shows all views again.
class ViewLayout : public QWidget {
    Q_OBJECT
  public:
    ViewLayout(Session& session, Surfaces& surfaces, QWidget* parent = nullptr);

    SurfaceView* surface_view() { return surface_view_; }
    SliceView* slice_view(Plane plane) { return slices_[static_cast<std::size_t>(plane)]; }

    Layout layout_choice() const { return layout_; }
    void set_layout_choice(Layout layout);
    /// Shows only this view; null: all of them.
    void show_alone(QWidget* view);
    QWidget* alone() const { return alone_; }

    /// What all slices show.
    const Slab& slab() const { return slab_; }
    void set_slab(const Slab& slab);

    /// The layout and the sizes of the views, for the settings.
    QVariantMap state() const;
    void restore(const QVariantMap& state);

  signals:
    void changed();

  private:
    void make_slices(Session& session, Surfaces& surfaces);
    void arrange();

    SurfaceView* surface_view_;
    std::array<SliceView*, 3> slices_;
    QSplitter *columns_, *left_, *right_;
    Layout layout_ = Layout::column;
    QWidget* alone_ = nullptr;
    Slab slab_;
};

}  // namespace marrow::viewer
