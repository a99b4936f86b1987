// The histogram of the scan, with the isovalue as a line to drag.
#pragma once

#include <QPolygonF>
#include <QWidget>

#include "model/session.h"

namespace marrow::viewer {

/// Drag or click: isovalue. Wheel: zoom. Arrow keys: one step; page keys: ten.
class HistogramBar : public QWidget {
    Q_OBJECT
  public:
    explicit HistogramBar(Session& session, QWidget* parent = nullptr);

    double value_at(double x) const;
    double x_of(double value) const;
    /// One step of the arrow keys: 1 for integers over a wide range.
    double step() const;
    QSize sizeHint() const override { return {600, 120}; }

  signals:
    void released();  ///< the hand has let go of the line

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
    double top_of(double count) const;
    QRectF plot() const;

    Session& session_;
    double lower_ = 0, upper_ = 1;  // the values shown
    double highest_ = 1;            // log of the fullest bin
    bool dragging_ = false;
};

}  // namespace marrow::viewer
