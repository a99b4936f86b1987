/// Shows one slice of the scan in patient orientation.
#pragma once

#include <QImage>
#include <QTransform>
#include <QWidget>

#include "model/surfaces.h"
#include "slice_geometry.h"

namespace marrow::viewer {

/// The left button sets the crosshair, picks a position to measure, or drags sides of the crop box. The right
/// button changes the window: its width across, its centre down. The middle button, or Shift, pans. The
/// wheel, arrow keys and page keys change the slice; Ctrl and the wheel zoom.
class SliceView : public QWidget {
    Q_OBJECT
  public:
    SliceView(Session& session, Surfaces& surfaces, Plane plane, QWidget* parent = nullptr);

    Plane plane() const { return plane_; }
    /// The point in the widget at which an index is drawn.
    QPointF widget_point(const Vec3d& index) const;
    /// The lines in which a surface meets the slice, in samples of the slice. They are exact even while the
    /// surface is a preview. Only where surfaces are refined do they come from the newest shape.
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
    Vec3d index_at(const QPointF& point) const;
    bool navigates() const { return session_.tool() == Tool::navigate || session_.tool() == Tool::crop; }
    QRectF crop_border() const;
    /// The sides of the crop box that a press at this point would drag.
    std::vector<CropSide> crop_sides_at(const QPointF& point) const;
    void update_cursor(const QPointF& point);
    void press(const QPointF& point);
    void paint_contours(QPainter& painter, const QTransform& transform);
    void paint_crop(QPainter& painter);
    void paint_crosshair(QPainter& painter, const QTransform& transform);
    void paint_marks(QPainter& painter, const QTransform& transform);
    void paint_texts(QPainter& painter);
    double value_at_crosshair() const;

    struct Contour {
        int id;
        double isovalue;
        std::optional<SampleBox> crop;
        bool closed;
        std::shared_ptr<const Shape> shape;  // null if the lines come from the samples
        QVector<QLineF> lines;

        bool same_source(const Contour& o) const {
            return isovalue == o.isovalue && crop == o.crop && closed == o.closed && shape == o.shape;
        }
    };

    Session& session_;
    Surfaces& surfaces_;
    const Plane plane_;
    SliceGeometry slice_;
    std::int64_t number_ = -1;  // the index of the slice in samples_
    std::vector<float> samples_;
    Window window_;
    QImage image_;
    std::vector<Contour> contours_;
    double zoom_ = 1;
    QPointF pan_;
    Qt::MouseButton dragging_ = Qt::NoButton;
    std::vector<CropSide> dragged_sides_;
    QPointF last_;
};

}  // namespace marrow::viewer
