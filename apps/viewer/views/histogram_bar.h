/// The histogram of the scan with a line for the isovalue.
#pragma once

#include <optional>

#include <QPainter>
#include <QWidget>

#include "model/distribution.h"
#include "model/session.h"
#include "model/worker.h"

namespace marrow::viewer {

/// Dragging or clicking sets the isovalue, the wheel zooms. Arrow keys move by one step, page keys by ten.
/// All of them choose isovalues between integer samples, so that the surface meets no sample.
class HistogramBar : public QWidget {
    Q_OBJECT
  public:
    explicit HistogramBar(Session& session, QWidget* parent = nullptr);

    double value_at(double x) const;
    double x_of(double value) const;
    /// The step of the arrow keys: 1 for integers.
    double step() const;
    QSize sizeHint() const override { return {600, 120}; }

  signals:
    void released();  ///< the user has released the line

  protected:
    void paintEvent(QPaintEvent*) override;
    void resizeEvent(QResizeEvent*) override { update_bins(); }
    void mousePressEvent(QMouseEvent* event) override;
    void mouseMoveEvent(QMouseEvent* event) override;
    void mouseReleaseEvent(QMouseEvent* event) override;
    void wheelEvent(QWheelEvent* event) override;
    void keyPressEvent(QKeyEvent* event) override;

  private:
    void follow_scan();
    void follow_isovalue();
    void update_bins();
    /// The nearest isovalue that can be dragged to, or one that many steps from it.
    double on_grid(double value, double steps = 0) const;
    void paint_bins(QPainter& painter) const;
    void paint_axis(QPainter& painter) const;
    void paint_isovalues(QPainter& painter) const;
    void paint_flag(QPainter& painter, const SurfaceParameters& current) const;
    double top_of(double count) const;
    QColor faint(int alpha) const;
    QRectF plot() const;

    Session& session_;
    double lower_ = 0, upper_ = 1;    // the range on display
    std::optional<double> isovalue_;  // of the current surface when last looked at
    Distribution distribution_;
    Bins bins_;           // on display
    double highest_ = 1;  // log(1 + count) of the fullest bin
    bool dragging_ = false;
    Worker counting_;  // last, so that it ends first
};

}  // namespace marrow::viewer
