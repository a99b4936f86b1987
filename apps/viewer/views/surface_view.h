/// Shows the surfaces in 3D.
#pragma once

#include <map>
#include <memory>

#include <QVTKOpenGLNativeWidget.h>
#include <QElapsedTimer>
#include <QImage>
#include <QPoint>
#include <QTimer>

#include "crop_drag.h"
#include "mark_drag.h"
#include "model/camera.h"
#include "model/surfaces.h"

namespace marrow::viewer {

/// The processor time that the calling thread has used, ms.
double thread_milliseconds();

class SurfaceView : public QVTKOpenGLNativeWidget {
    Q_OBJECT
  public:
    SurfaceView(Session& session, Surfaces& surfaces, QWidget* parent = nullptr);
    ~SurfaceView() override;

    void look_from(Side side);
    /// Shows all visible surfaces from the front left.
    void reset_view();
    CameraState camera() const;
    void set_camera(const CameraState& state);
    /// Sets the camera, and does not fit it to the first surface.
    void resume_camera(const CameraState& state);
    void set_light_background(bool light);
    bool light_background() const { return light_; }
    void set_crosshair_visible(bool visible);
    /// Rotates the view about the patient's long axis, as on a turntable.
    void turn(double degrees);
    /// While the view moves, it draws previews if full frames are slow.
    void set_moving(bool moving);
    /// Draws the view at a size in pixels, with previews only of surfaces that Surfaces::unfinished() names.
    QImage screenshot(const QSize& size);

    /// The position on a surface, or on the cut through one, at a point of the widget; nothing beside them.
    /// Opaque surfaces take precedence over translucent ones. LPS mm.
    std::optional<Vec3d> position_at(const QPoint& point) const;
    /// The ray from the camera through a point of the widget.
    Ray ray_at(const QPoint& point) const;
    /// The point of the widget at which a position is drawn; nothing behind the camera.
    std::optional<QPointF> widget_point(const Vec3d& position) const;
    /// The unit vector from the camera to its focal point.
    Vec3d view_direction() const;

    /// The duration of the last frame, ms.
    double frame_milliseconds() const { return frame_; }
    /// The duration of all frames so far, including their composition into the window, ms.
    double drawing_milliseconds() const { return all_frames_; }
    /// The processor time of this thread in all frames so far, ms.
    double drawing_processor_milliseconds() const { return all_frames_processor_; }
    /// Whether OpenGL runs on the processor; known after the first frame.
    bool software() const { return software_; }
    int frames() const { return frames_; }
    /// Whether a change has not been drawn yet.
    bool stale() const { return drawing_.isActive(); }

  signals:
    void drawn();
    /// While navigating; the crosshair is where it was before the first click.
    void double_clicked();

  protected:
    bool event(QEvent* event) override;

  private:
    struct Scene;

    void make_scene();
    void observe_frames();
    void connect_to_session();
    void follow_shapes(int id);
    void follow_parameters();
    void follow_crosshair();
    void follow_measurements();
    void follow_crop();
    void follow_colouring();
    /// The parameters as far as the view shows them.
    Parameters drawn_parameters() const;
    void update_cut();
    void request_draw();
    /// Draws when the slices have not changed for a moment, if frames are slow: slices do not wait for them.
    void request_draw_after_slices();
    void draw();
    void prepare_camera();
    void set_pixel_ratio();
    void finish_frame();
    void choose_detail();
    MarkView mark_view();
    void click(const QPoint& point);
    void look(const Viewpoint& viewpoint);
    /// The part of space that the cut leaves visible; nothing without a cut.
    std::optional<HalfSpace> visible_half_space() const;
    std::optional<double> hit_on_cut(const Ray& ray, const HalfSpace& visible, double lowest_isovalue) const;

    Session& session_;
    Surfaces& surfaces_;
    CropDrag crop_drag_;
    MarkDrag mark_drag_;
    std::unique_ptr<Scene> scene_;
    Parameters drawn_parameters_;
    QTimer drawing_;
    bool after_slices_ = false;  // the timer waits for the slices
    QElapsedTimer frame_timer_, composition_timer_;
    int frames_ = 0;
    QPoint pressed_;
    Vec3d before_click_{0, 0, 0};  // the crosshair
    bool pressed_valid_ = false;
    bool light_ = false, moving_ = false, software_ = false, fitted_ = false;
    double frame_ = 0, full_frame_ = 0, all_frames_ = 0, frame_began_ = 0, composition_began_ = 0,
           all_frames_processor_ = 0;
};

}  // namespace marrow::viewer
