// The surfaces in space.
#pragma once

#include <map>
#include <memory>

#include <QVTKOpenGLNativeWidget.h>
#include <QElapsedTimer>
#include <QImage>
#include <QPoint>
#include <QTimer>

#include "model/camera.h"
#include "crop_drag.h"
#include "model/surfaces.h"

namespace marrow::viewer {

/// Processor time that the calling thread has used, ms.
double thread_milliseconds();

class SurfaceView : public QVTKOpenGLNativeWidget {
    Q_OBJECT
  public:
    SurfaceView(Session& session, Surfaces& surfaces, QWidget* parent = nullptr);
    ~SurfaceView() override;

    void look_from(Side side);
    /// All that is visible, from the front left.
    void reset_view();
    void set_light_background(bool light);
    bool light_background() const { return light_; }
    void set_crosshair_visible(bool visible);
    /// Turns round the patient's long axis, as on a turntable.
    void turn(double degrees);
    /// While it moves by itself, slow frames are made of previews, as while a hand moves it.
    void set_moving(bool moving);
    /// What the view shows, drawn anew at a size in pixels.
    QImage picture(const QSize& size);

    /// The position under a place in the widget, on a surface or on the cut through one; none beside them. Opaque
    /// surfaces go before translucent ones. LPS mm.
    std::optional<Vec3d> position_at(const QPoint& place) const;
    /// From the camera through a place in the widget.
    Ray ray_at(const QPoint& place) const;
    /// Where a position is drawn in the widget.
    QPointF place_of(const Vec3d& position) const;
    /// From the camera to what it looks at; unit length.
    Vec3d view_direction() const;

    /// How long the last frame took to draw, ms, and all frames so far together, with putting them into the window.
    double frame_milliseconds() const { return frame_; }
    double drawing_milliseconds() const { return all_frames_; }
    /// The processor time that this thread spent on it, ms.
    double drawing_processor_milliseconds() const { return all_frames_processor_; }
    /// OpenGL runs on the processor; known after the first frame.
    bool software() const { return software_; }
    int frames() const { return frames_; }
    /// A change waits to be drawn.
    bool stale() const { return drawing_.isActive(); }

  signals:
    void drawn();

  protected:
    bool event(QEvent* event) override;

  private:
    struct Scene;

    void follow_shapes(int id);
    void follow_parameters();
    void follow_crosshair();
    void follow_measurements();
    void follow_crop();
    void request_draw();
    void draw();
    void prepare_camera();
    void finish_frame();
    void choose_detail();
    void look(const Aim& aim);
    std::optional<HalfSpace> kept() const;

    Session& session_;
    Surfaces& surfaces_;
    CropDrag crop_drag_;
    std::unique_ptr<Scene> scene_;
    QTimer drawing_;
    QElapsedTimer frame_timer_, composition_timer_;
    int frames_ = 0;
    QPoint pressed_;
    bool pressed_valid_ = false;
    bool light_ = false, moving_ = false, software_ = false, fitted_ = false;
    double frame_ = 0, full_frame_ = 0, all_frames_ = 0, frame_began_ = 0, composition_began_ = 0,
           all_frames_processor_ = 0;
};

}  // namespace marrow::viewer
