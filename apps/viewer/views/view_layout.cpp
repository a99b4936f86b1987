// Distributes the views over two columns.
#include "view_layout.h"

#include <QVBoxLayout>

namespace marrow::viewer {

ViewLayout::ViewLayout(Session& session, Surfaces& surfaces, QWidget* parent)
    : QWidget(parent),
      surface_view_(new SurfaceView(session, surfaces)),
      columns_(new QSplitter(Qt::Horizontal)),
      left_(new QSplitter(Qt::Vertical)),
      right_(new QSplitter(Qt::Vertical)) {
    surface_view_->setObjectName("surface_view");
    connect(surface_view_, &SurfaceView::double_clicked, this,
            [this] { show_alone(alone_ ? nullptr : surface_view_); });
    make_slices(session, surfaces);
    left_->addWidget(surface_view_);
    columns_->addWidget(left_);
    columns_->addWidget(right_);
    for (QSplitter* splitter : {columns_, left_, right_}) splitter->setHandleWidth(2);
    auto* box = new QVBoxLayout(this);
    box->setContentsMargins(0, 0, 0, 0);
    box->addWidget(columns_);
    arrange();
}

void ViewLayout::make_slices(Session& session, Surfaces& surfaces) {
    for (const Plane plane : {Plane::axial, Plane::coronal, Plane::sagittal}) {
        auto* slice = new SliceView(session, surfaces, plane);
        slice->setObjectName(plane == Plane::axial     ? "axial"
                             : plane == Plane::coronal ? "coronal"
                                                       : "sagittal");
        slices_[static_cast<std::size_t>(plane)] = slice;
        right_->addWidget(slice);
        connect(slice, &SliceView::double_clicked, this,
                [this, slice] { show_alone(alone_ ? nullptr : slice); });
        connect(slice, &SliceView::zoomed, this, [this, slice](double zoom) {
            for (SliceView* other : slices_) {
                if (other != slice) other->zoom_to(zoom);
            }
        });
    }
}

// Only the coronal slice changes its column: moving the 3D view would cost its OpenGL context.
void ViewLayout::arrange() {
    const bool square = layout_ == Layout::square;
    square ? left_->addWidget(slice_view(Plane::coronal))
           : right_->insertWidget(1, slice_view(Plane::coronal));
    const int left = square ? 1 : 5, right = square ? 1 : 2;
    columns_->setStretchFactor(0, left);
    columns_->setStretchFactor(1, right);
    columns_->setSizes({1000 * left, 1000 * right});
    left_->setSizes({1000, 1000});
    right_->setSizes({1000, 1000, 1000});
    show_alone(nullptr);
}

void ViewLayout::set_layout_choice(Layout layout) {
    layout_ = layout;
    arrange();
}

void ViewLayout::show_alone(QWidget* view) {
    alone_ = view;
    for (QSplitter* column : {left_, right_}) {
        bool any = false;
        for (int i = 0; i < column->count(); ++i) {
            const bool shown = !view || column->widget(i) == view;
            column->widget(i)->setVisible(shown);
            any = any || shown;
        }
        column->setVisible(any);
    }
    if (view) view->setFocus();
    emit changed();
}

void ViewLayout::set_slab(const Slab& slab) {
    slab_ = slab;
    for (SliceView* slice : slices_) slice->set_slab(slab);
    emit changed();
}

QVariantMap ViewLayout::state() const {
    return {{"layout", static_cast<int>(layout_)},
            {"columns", columns_->saveState()},
            {"left", left_->saveState()},
            {"right", right_->saveState()}};
}

void ViewLayout::restore(const QVariantMap& state) {
    if (state.isEmpty()) return;
    set_layout_choice(state["layout"].toInt() == static_cast<int>(Layout::square) ? Layout::square
                                                                                  : Layout::column);
    columns_->restoreState(state["columns"].toByteArray());
    left_->restoreState(state["left"].toByteArray());
    right_->restoreState(state["right"].toByteArray());
}

}  // namespace marrow::viewer
