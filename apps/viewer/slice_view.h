// One slice of the scan, in patient orientation.
#pragma once

#include <QImage>
#include <QTransform>
#include <QWidget>

#include "slice_frame.h"

namespace marrow::viewer {

/// Left button: crosshair, or a measurement's position. Right button: window (across: width, down: level). Middle button
/// or shift: pan. Wheel: through the slices; with ctrl: zoom. Keys: arrows and page keys go through the slices, R resets.
class SliceView : public QWidget {
    Q_OBJECT
  public:
    SliceView(Session& session, Plane plane, QWidget* parent = nullptr);

    Plane plane() const { return plane_; }
    /// Where an index is drawn in the widget.
    QPointF place_of(const Vec3d& index) const;
    /// The contour of a surface, in samples of the slice; see slice_contour.
    QVector<QLineF> contour_of(int id) const;
    void reset_view();
    QSize sizeHint() const override { return {300, 260}; }

  protected:
    void paintEvent(QPaintEvent*) override;
    void mousePressEvent(QMouseEvent* event) override;
    void mouseMoveEvent(QMouseEvent* event) override;
    void mouseReleaseEvent(QMouseEvent* event) override;
    void wheelEvent(QWheelEvent* event) override;
    void keyPressEvent(QKeyEvent* event) override;

  private:
    void follow_scan();
    void follow_crosshair();
    void follow_parameters();
    void redraw_samples();
    void go(double slices);
    std::int64_t slice_number() const;
    QTransform to_widget() const;
    Vec3d index_at(const QPointF& place) const;
    void paint_marks(QPainter& painter, const QTransform& transform);
    void paint_words(QPainter& painter);

    struct Contour {
        int id;
        double isovalue;
        QVector<QLineF> lines;
    };

    Session& session_;
    const Plane plane_;
    SliceFrame frame_;
    std::int64_t number_ = -1;  // of the slice in samples_
    std::vector<float> samples_;
    Window window_;
    QImage image_;
    std::vector<Contour> contours_;
    double zoom_ = 1;
    QPointF pan_;
    Qt::MouseButton dragging_ = Qt::NoButton;
    QPointF last_;
};

}  // namespace marrow::viewer
