/// The histogram of the scan with a line for the isovalue.
#pragma once

#include <QPainter>
#include <QWidget>

#include "model/session.h"

namespace marrow::viewer {

/// Dragging or clicking sets the isovalue, the wheel zooms. Arrow keys move by one step, page keys by ten.
class HistogramBar : public QWidget {
    Q_OBJECT
  public:
    explicit HistogramBar(Session& session, QWidget* parent = nullptr);

    double value_at(double x) const;
    double x_of(double value) const;
    /// The step of the arrow keys: 1 for integers with a wide range.
    double step() const;
    QSize sizeHint() const override { return {600, 120}; }

  signals:
    void released();  ///< the user has released the line

  protected:
    void paintEvent(QPaintEvent*) override;
    void mousePressEvent(QMouseEvent* event) override;
    void mouseMoveEvent(QMouseEvent* event) override;
    void mouseReleaseEvent(QMouseEvent* event) override;
    void wheelEvent(QWheelEvent* event) override;
    void keyPressEvent(QKeyEvent* event) override;

  private:
    void follow_scan();
    void set_from(double x);
    void paint_bins(QPainter& painter) const;
    void paint_axis(QPainter& painter) const;
    void paint_isovalues(QPainter& painter) const;
    void paint_flag(QPainter& painter, const SurfaceParameters& current) const;
    double top_of(double count) const;
    QRectF plot() const;

    Session& session_;
    double lower_ = 0, upper_ = 1;  // the range on display
    double highest_ = 1;            // log(1 + count) of the fullest bin
    bool dragging_ = false;
};

}  // namespace marrow::viewer
