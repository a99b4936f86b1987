// One slice of the scan, in patient orientation.
#pragma once

#include <QImage>
#include <QTransform>
#include <QWidget>

#include "slice_geometry.h"
#include "model/surfaces.h"

namespace marrow::viewer {

/// Left button: crosshair, a measurement's position, or a side or corner of the crop box. Right button: window (across: width, down: level). Middle button
/// or shift: pan. Wheel: through the slices; with ctrl: zoom. Keys: arrows and page keys go through the slices, R resets.
class SliceView : public QWidget {
    Q_OBJECT
  public:
    SliceView(Session& session, Surfaces& surfaces, Plane plane, QWidget* parent = nullptr);

    Plane plane() const { return plane_; }
    /// Where an index is drawn in the widget.
    QPointF place_of(const Vec3d& index) const;
    /// Where a surface meets the slice, in samples of the slice: exactly, also while the surface is a preview; but which
    /// piece is the largest, only the surface knows, so that then it is that of its newest shape.
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
    bool navigates() const { return session_.tool() == Tool::navigate || session_.tool() == Tool::crop; }
    QRectF crop_border() const;
    /// Sides of the crop box that a hand at this place would take.
    std::vector<CropSide> crop_sides_at(const QPointF& place) const;
    void show_what_a_press_takes(const QPointF& place);
    void paint_crop(QPainter& painter);
    void paint_marks(QPainter& painter, const QTransform& transform);
    void paint_words(QPainter& painter);

    struct Contour {
        int id;
        double isovalue;
        std::optional<SampleBox> crop;
        bool closed;
        std::shared_ptr<const Shape> shape;  // where it comes from one
        QVector<QLineF> lines;

        bool same_but_lines(const Contour& o) const {
            return isovalue == o.isovalue && crop == o.crop && closed == o.closed && shape == o.shape;
        }
    };

    Session& session_;
    Surfaces& surfaces_;
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
    std::vector<CropSide> dragged_sides_;
    QPointF last_;
};

}  // namespace marrow::viewer
