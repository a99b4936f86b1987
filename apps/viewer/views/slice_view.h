/// Shows one slice of the scan in patient orientation.
#pragma once

#include <QImage>
#include <QPolygonF>
#include <QTransform>
#include <QWidget>

#include "mark_drag.h"
#include "model/surfaces.h"
#include "slice_geometry.h"

namespace marrow::viewer {

/// The left button sets the crosshair, picks a position to measure, or drags an end of a measurement or
/// sides of the crop box. The right button changes the window: its width across, its centre down. The middle
/// button, or Shift, pans. The wheel, arrow keys and page keys change the slice; Ctrl and the wheel zoom. The
/// lower left corner shows the value under the pointer.
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
    /// The text in the lower left corner: the window while it is dragged; else the value and index under the
    /// pointer; else the value at the crosshair.
    QString readout() const;
    void reset_view();
    /// Zooms about the crosshair; 1 shows the entire slice.
    void zoom_to(double zoom);
    /// Shows the slab instead of a single slice. Contours stay those of the slice in its middle.
    void set_slab(const Slab& slab);
    QSize sizeHint() const override { return {300, 260}; }

  signals:
    void zoomed(double zoom);  ///< by the user
    /// While navigating; the crosshair is where it was before the first click.
    void double_clicked();

  protected:
    void paintEvent(QPaintEvent*) override;
    void mousePressEvent(QMouseEvent* event) override;
    void mouseDoubleClickEvent(QMouseEvent* event) override;
    void mouseMoveEvent(QMouseEvent* event) override;
    void mouseReleaseEvent(QMouseEvent* event) override;
    void leaveEvent(QEvent* event) override;
    void wheelEvent(QWheelEvent* event) override;
    void keyPressEvent(QKeyEvent* event) override;

  private:
    void follow_scan();
    void follow_crosshair();
    void follow_parameters();
    void read_samples();
    void redraw_samples();
    /// Zooms so that this point of the widget stays where it is.
    void zoom_about(const QPointF& point, double zoom);
    void go(double slices);
    std::int64_t slice_number() const;
    /// Pixels per mm if the widget shows the entire slice.
    double fitting_scale() const;
    QTransform to_widget() const;
    Vec3d index_at(const QPointF& point) const;
    bool navigates() const { return session_.tool() == Tool::navigate || session_.tool() == Tool::crop; }
    QRectF crop_rectangle() const;
    QPolygonF crop_border() const;
    /// The sides of the crop box that a press at this point would drag.
    std::vector<CropSide> crop_sides_at(const QPointF& point) const;
    MarkView mark_view();
    void update_cursor(const QPointF& point);
    void press(const QPointF& point);
    bool in_scan(const Vec3d& index) const;
    void paint_contours(QPainter& painter, const QTransform& transform);
    void paint_crop(QPainter& painter);
    void paint_crosshair(QPainter& painter, const QTransform& transform);
    void paint_marks(QPainter& painter, const QTransform& transform);
    void paint_texts(QPainter& painter);
    QString slab_text() const;
    /// The samples that the slice shows.
    const std::vector<float>& shown() const { return slab_samples_.empty() ? samples_ : slab_samples_; }
    QString value_at(const QPointF& slice_point) const;

    struct Contour {
        int id;
        double isovalue;
        std::optional<SampleBox> crop;
        bool closed, topology;
        bool refined;                        // the lines come from a shape, not from the samples
        std::shared_ptr<const Shape> shape;  // null if it is not there yet
        QVector<QLineF> lines;

        bool same_source(const Contour& o) const {
            return isovalue == o.isovalue && crop == o.crop && closed == o.closed && topology == o.topology &&
                   refined == o.refined && shape == o.shape;
        }
    };

    Session& session_;
    Surfaces& surfaces_;
    const Plane plane_;
    SliceGeometry slice_;
    std::int64_t number_ = -1;  // the index of the slice in samples_
    std::vector<float> samples_;
    std::vector<float> slab_samples_;  // empty if a single slice is shown
    Slab slab_;
    Window window_;
    QImage image_;
    std::vector<Contour> contours_;
    double zoom_ = 1;
    QPointF pan_;  // in pixels / fitting_scale(), so that it is independent of the size of the widget
    Qt::MouseButton dragging_ = Qt::NoButton;
    std::vector<CropSide> dragged_sides_;
    MarkDrag mark_drag_;
    QPointF last_;
    Vec3d before_press_{0, 0, 0};     // the crosshair
    std::optional<QPointF> pointer_;  // in the widget, if the mouse is there
    double wheel_ = 0;                // the part of a step that the wheel turned since the last slice
};

}  // namespace marrow::viewer
