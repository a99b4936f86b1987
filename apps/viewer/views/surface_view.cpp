// Builds the VTK scene, keeps it up to date with the session, and times its frames.
#include "surface_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>

#include <time.h>

#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkImageData.h>
#include <vtkInteractorStyleTrackballCamera.h>
#include <vtkLightKit.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPlane.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkRenderer.h>
#include <vtkRendererCollection.h>
#include <vtkWindowToImageFilter.h>

#include <QMouseEvent>

#include "scene_parts.h"
#include "slice_geometry.h"
#include "surface_actor.h"
#include "trust_legend.h"

namespace marrow::viewer {
namespace {

constexpr double kViewAngle = 24;
constexpr double kSlowFrame = 60;  // ms; if full frames take longer, a moving view shows previews
constexpr int kSlicePause = 200;   // ms; slices that have not changed for so long are at rest
constexpr int kClick = 4;          // pixels; a longer move is a drag, not a click

// The mouse works as in VTK, ParaView and 3D Slicer. The window handles the keys.
class Style : public vtkInteractorStyleTrackballCamera {
  public:
    static Style* New();
    vtkTypeMacro(Style, vtkInteractorStyleTrackballCamera);
    void OnChar() override {}
    void OnKeyPress() override {}
    void OnKeyDown() override {}
};
vtkStandardNewMacro(Style);

template <class F>
void observe(vtkObject* object, unsigned long event, F* callback) {
    vtkNew<vtkCallbackCommand> command;
    command->SetClientData(callback);
    command->SetCallback([](vtkObject*, unsigned long, void* data, void*) { (*static_cast<F*>(data))(); });
    object->AddObserver(event, command);
}

}  // namespace

double thread_milliseconds() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) / 1e6;
}

struct SurfaceView::Scene {
    vtkNew<vtkGenericOpenGLRenderWindow> window;
    vtkNew<vtkRenderer> main, overlay, corner;
    vtkNew<vtkLightKit> lights;
    vtkNew<Style> style;
    vtkNew<vtkPlane> plane;
    std::map<int, SurfaceActor> surfaces;
    CutFace cut_face;
    Crosshair crosshair;
    CropBox crop_box;
    Marks marks;
    TrustLegend trust_legend;
    OrientationCube cube;
    std::function<void()> on_frame_start, on_frame_end, on_start, on_end;
};

SurfaceView::SurfaceView(Session& session, Surfaces& surfaces, QWidget* parent)
    : QVTKOpenGLNativeWidget(parent),
      session_(session),
      surfaces_(surfaces),
      crop_drag_(session, surfaces,
                 {[this](const Vec3d& p) { return widget_point(p); },
                  [this](const QPoint& p) { return ray_at(p); }}),
      mark_drag_(session, mark_view()),
      scene_(std::make_unique<Scene>()) {
    setRenderWindow(scene_->window);
    setFocusPolicy(Qt::StrongFocus);
    setMinimumSize(160, 120);
    setToolTip({});
    make_scene();
    observe_frames();
    connect_to_session();
    drawing_.setSingleShot(true);
    connect(&drawing_, &QTimer::timeout, this, &SurfaceView::draw);
}

void SurfaceView::make_scene() {
    vtkRenderWindow* window = scene_->window;
    window->SetMultiSamples(0);
    window->SetNumberOfLayers(3);
    window->AddRenderer(scene_->main);
    scene_->main->GradientBackgroundOn();
    scene_->lights->SetKeyLightAngle(45, -35);
    scene_->lights->SetKeyToFillRatio(2.2);
    scene_->lights->SetKeyToBackRatio(2.2);
    scene_->lights->AddLightsToRenderer(scene_->main);
    scene_->main->SetUseFXAA(true);
    scene_->main->SetUseDepthPeeling(true);
    scene_->main->SetMaximumNumberOfPeels(4);
    scene_->main->SetOcclusionRatio(0.02);
    scene_->main->GetActiveCamera()->SetViewAngle(kViewAngle);
    for (vtkRenderer* renderer : {scene_->overlay.Get(), scene_->corner.Get()}) {
        renderer->InteractiveOff();
        window->AddRenderer(renderer);
    }
    scene_->overlay->SetLayer(1);
    scene_->overlay->SetActiveCamera(scene_->main->GetActiveCamera());
    scene_->corner->SetLayer(2);
    scene_->cut_face.add_to(scene_->main);
    scene_->crosshair.add_to(scene_->overlay);
    scene_->crop_box.add_to(scene_->overlay);
    scene_->marks.add_to(scene_->overlay);
    scene_->trust_legend.add_to(scene_->overlay);
    scene_->cube.add_to(scene_->corner);
    set_light_background(false);
}

void SurfaceView::observe_frames() {
    vtkRenderWindow* window = scene_->window;
    window->GetInteractor()->SetInteractorStyle(scene_->style);
    scene_->on_frame_start = [this] {
        frame_timer_.start();
        frame_began_ = thread_milliseconds();
        prepare_camera();
        set_pixel_ratio();
    };
    scene_->on_frame_end = [this] { finish_frame(); };
    scene_->on_start = [this] { set_moving(true); };
    scene_->on_end = [this] { set_moving(false); };
    observe(window, vtkCommand::StartEvent, &scene_->on_frame_start);
    observe(window, vtkCommand::EndEvent, &scene_->on_frame_end);
    observe(scene_->style, vtkCommand::StartInteractionEvent, &scene_->on_start);
    observe(scene_->style, vtkCommand::EndInteractionEvent, &scene_->on_end);
    // After each frame, Qt composes it with the surrounding widgets, which takes time too.
    connect(this, &QOpenGLWidget::aboutToCompose, this, [this] {
        composition_timer_.start();
        composition_began_ = thread_milliseconds();
    });
    connect(this, &QOpenGLWidget::frameSwapped, this, [this] {
        if (!composition_timer_.isValid()) return;
        all_frames_ += static_cast<double>(composition_timer_.nsecsElapsed()) / 1e6;
        all_frames_processor_ += thread_milliseconds() - composition_began_;
        composition_timer_.invalidate();
    });
}

void SurfaceView::connect_to_session() {
    connect(&session_, &Session::scan_changed, this, [this] {
        for (auto& [id, surface] : scene_->surfaces) scene_->main->RemoveActor(surface.actor());
        scene_->surfaces.clear();
        drawn_parameters_ = {};
        fitted_ = false;
        full_frame_ = 0;
    });
    connect(&session_, &Session::parameters_changed, this, &SurfaceView::follow_parameters);
    connect(&session_, &Session::crosshair_changed, this, &SurfaceView::follow_crosshair);
    connect(&session_, &Session::picking_changed, this, [this] {
        follow_measurements();
        follow_crop();
        request_draw();
    });
    connect(&surfaces_, &Surfaces::shape_changed, this, &SurfaceView::follow_shapes);
    connect(&surfaces_, &Surfaces::removed, this, [this](int id) {
        const auto it = scene_->surfaces.find(id);
        if (it == scene_->surfaces.end()) return;
        scene_->main->RemoveActor(it->second.actor());
        scene_->surfaces.erase(it);
        request_draw();
    });
}

SurfaceView::~SurfaceView() {
    makeCurrent();  // because the mappers release graphics memory
    for (vtkRenderer* renderer : {scene_->main.Get(), scene_->overlay.Get(), scene_->corner.Get()})
        renderer->RemoveAllViewProps();
}

void SurfaceView::follow_shapes(int id) {
    const std::shared_ptr<const Shape> shape = surfaces_.shape(id);
    if (!shape) return;
    const bool is_new = scene_->surfaces.find(id) == scene_->surfaces.end();
    SurfaceActor& surface = scene_->surfaces[id];
    surface.set_shapes(shape, surfaces_.preview(id));
    if (is_new) {
        scene_->main->AddActor(surface.actor());
        if (const SurfaceParameters* parameters = session_.parameters().find(id))
            surface.set_look(*parameters, session_.parameters().mode);
        update_cut();
    }
    follow_colouring();
    choose_detail();
    if (!fitted_ && !shape->mesh->points.empty()) {
        fitted_ = true;
        reset_view();
    }
    request_draw();
}

Parameters SurfaceView::drawn_parameters() const {
    Parameters p = session_.parameters();
    // These change the shapes, which are drawn when they arrive, or other parts of the window.
    p.current = 0;
    const Parameters plain;
    p.largest = plain.largest;
    p.components = plain.components;
    p.smooth = plain.smooth;
    p.keep = plain.keep;
    p.open = plain.open;
    p.topology = plain.topology;
    for (SurfaceParameters& surface : p.surfaces) surface.name.clear();
    if (p.cut.plane) return p;
    // Only the cut shows samples.
    p.cut = {};
    p.window = {};
    for (SurfaceParameters& surface : p.surfaces) surface.isovalue = 0;
    if (session_.tool() != Tool::crop) p.crop.reset();
    return p;
}

void SurfaceView::follow_parameters() {
    if (!session_.scan()) return;
    Parameters drawn = drawn_parameters();
    if (drawn == drawn_parameters_) return;
    Parameters known = drawn_parameters_;
    known.window = drawn.window;
    known.measurements = drawn.measurements;
    const bool by_slices = drawn == known && !mark_drag_.active();
    drawn_parameters_ = std::move(drawn);
    const Parameters& p = session_.parameters();
    for (auto& [id, surface] : scene_->surfaces) {
        if (const SurfaceParameters* parameters = p.find(id)) surface.set_look(*parameters, p.mode);
    }
    update_cut();
    follow_measurements();
    follow_crop();
    follow_colouring();
    by_slices ? request_draw_after_slices() : request_draw();
}

void SurfaceView::follow_crop() {
    const Scan* scan = session_.scan();
    if (!scan) return;
    scene_->crop_box.set_box(scan->volume.geometry(), session_.crop());
    scene_->crop_box.set_visible(session_.tool() == Tool::crop);
}

// The legend is that of the visible surfaces, which are all of the same samples.
void SurfaceView::follow_colouring() {
    const Parameters& p = session_.parameters();
    const TrustReport* shown = nullptr;
    for (auto& [id, surface] : scene_->surfaces) {
        surface.set_colouring(p.colouring, scene_->trust_legend.colours());
        const Shape* shape = surface.shape();
        if (surface.visible() && shape && shape->trust) shown = &*shape->trust;
    }
    if (shown && p.colouring != Colouring::own)
        scene_->trust_legend.show(p.colouring, *shown, session_.scan()->hounsfield);
    else
        scene_->trust_legend.hide();
}

void SurfaceView::follow_crosshair() {
    const Scan* scan = session_.scan();
    if (!scan) return;
    scene_->crosshair.set_position(scan->volume.geometry(), session_.crosshair());
    update_cut();
    if (scene_->crosshair.visible() || session_.parameters().cut.plane) request_draw_after_slices();
}

void SurfaceView::update_cut() {
    const Scan* scan = session_.scan();
    const std::optional<HalfSpace> half = visible_half_space();
    if (half) {
        scene_->plane->SetOrigin(half->point.data());
        scene_->plane->SetNormal(half->normal.data());
        const Parameters& p = session_.parameters();
        double lowest = std::numeric_limits<double>::infinity();
        for (const SurfaceParameters& surface : p.surfaces) {
            if (surface.visible && surface.opacity > 0) lowest = std::min(lowest, surface.isovalue);
        }
        scene_->cut_face.show(*scan, session_.crop(), *p.cut.plane, session_.crosshair(), p.window, lowest);
    } else {
        scene_->cut_face.hide();
    }
    for (auto& [id, surface] : scene_->surfaces) surface.set_cut(half ? scene_->plane.Get() : nullptr);
}

void SurfaceView::follow_measurements() {
    scene_->marks.show(session_.parameters().measurements, session_.picked());
}

std::optional<HalfSpace> SurfaceView::visible_half_space() const {
    const Scan* scan = session_.scan();
    const Cut& cut = session_.parameters().cut;
    if (!scan || !cut.plane) return {};
    const Geometry& geometry = scan->volume.geometry();
    const SliceGeometry slice = slice_geometry(geometry, *cut.plane);
    Vec3d index = session_.crosshair();
    double& through = index[static_cast<std::size_t>(slice.through)];
    through = std::round(through);
    const Mat3d to_physical = geometry.index_to_physical();
    Vec3d normal = unit(cross(column(to_physical, static_cast<std::size_t>(slice.across)),
                              column(to_physical, static_cast<std::size_t>(slice.down))));
    // Unless flipped, the cut hides the superior, anterior or left side.
    constexpr std::array<Vec3d, 3> kHidden{{{0, 0, 1}, {0, -1, 0}, {1, 0, 0}}};
    const bool towards_hidden = dot(normal, kHidden[static_cast<std::size_t>(*cut.plane)]) > 0;
    if (towards_hidden != cut.flipped) normal = -1 * normal;
    return HalfSpace{geometry.physical(index), normal};
}

void SurfaceView::set_light_background(bool light) {
    light_ = light;
    if (light) {
        scene_->main->SetBackground(0.86, 0.88, 0.90);
        scene_->main->SetBackground2(0.98, 0.98, 0.99);
    } else {
        scene_->main->SetBackground(0.055, 0.063, 0.078);
        scene_->main->SetBackground2(0.16, 0.185, 0.22);
    }
    scene_->marks.set_light(light);
    scene_->trust_legend.set_light(light);
    request_draw();
}

void SurfaceView::set_crosshair_visible(bool visible) {
    scene_->crosshair.set_visible(visible);
    request_draw();
}

// Fits at most some 20,000 points of each visible surface, which is close enough.
void SurfaceView::look(const Viewpoint& viewpoint) {
    const Scan* scan = session_.scan();
    if (!scan) return;
    const double aspect = std::max(0.1, static_cast<double>(width()) / std::max(1, height()));
    // VTK draws nothing nearer than a thousandth of the distance to the farthest corner of the scan.
    const Geometry& g = scan->volume.geometry();
    const Vec3d last{static_cast<double>(g.dims[0]), static_cast<double>(g.dims[1]),
                     static_cast<double>(g.dims[2])};
    const double closest = length(g.physical(last) - g.physical({-1, -1, -1})) / 500;
    fit_camera(scene_->main->GetActiveCamera(), viewpoint, aspect, closest, [&](const auto& visit) {
        for (const auto& [id, surface] : scene_->surfaces) {
            if (!surface.shape() || !surface.visible()) continue;
            const auto& points = surface.shape()->mesh->points;
            const std::size_t step = 1 + points.size() / 20000;
            for (std::size_t i = 0; i < points.size(); i += step)
                visit({points[i][0], points[i][1], points[i][2]});
        }
    });
    request_draw();
}

CameraState SurfaceView::camera() const {
    return camera_state(scene_->main->GetActiveCamera());
}

void SurfaceView::set_camera(const CameraState& state) {
    set_camera_state(scene_->main->GetActiveCamera(), state);
    request_draw();
}

void SurfaceView::resume_camera(const CameraState& state) {
    set_camera(state);
    fitted_ = true;
}

void SurfaceView::look_from(Side side) {
    look(viewpoint_from(side));
}

void SurfaceView::reset_view() {
    look(front_left_viewpoint());
}

void SurfaceView::turn(double degrees) {
    turn_camera(scene_->main->GetActiveCamera(), degrees);
    request_draw();
}

void SurfaceView::set_moving(bool moving) {
    moving_ = moving;
    choose_detail();
    request_draw();
}

void SurfaceView::choose_detail() {
    for (auto& [id, surface] : scene_->surfaces) surface.choose(moving_ && full_frame_ > kSlowFrame);
}

void SurfaceView::request_draw() {
    if (drawing_.isActive() && !after_slices_) return;
    after_slices_ = false;
    drawing_.start(0);
}

void SurfaceView::request_draw_after_slices() {
    if (frame_ <= kSlowFrame) return request_draw();
    if (drawing_.isActive() && !after_slices_) return;
    after_slices_ = true;
    drawing_.start(kSlicePause);
}

void SurfaceView::prepare_camera() {
    if (const Scan* scan = session_.scan()) {
        // Include the entire scan, so that the crosshair and the cut are never clipped.
        const Geometry& g = scan->volume.geometry();
        double bounds[6]{1e300, -1e300, 1e300, -1e300, 1e300, -1e300};
        for (int corner = 0; corner < 8; ++corner) {
            Vec3d index;
            for (std::size_t a = 0; a < 3; ++a)
                index[a] = (corner >> a & 1) != 0 ? static_cast<double>(g.dims[a]) : -1.0;
            const Vec3d p = g.physical(index);
            for (std::size_t a = 0; a < 3; ++a) {
                bounds[2 * a] = std::min(bounds[2 * a], p[a]);
                bounds[2 * a + 1] = std::max(bounds[2 * a + 1], p[a]);
            }
        }
        scene_->main->ResetCameraClippingRange(bounds);
    }
}

// A picture may be larger than the view, but shall look the same.
void SurfaceView::set_pixel_ratio() {
    const int* size = scene_->window->GetSize();
    const double ratio = static_cast<double>(size[1]) / std::max(1, height());
    scene_->window->SetDPI(static_cast<int>(std::lround(72 * ratio)));  // for the texts
    scene_->crosshair.set_pixel_ratio(ratio);
    scene_->crop_box.set_pixel_ratio(ratio);
    scene_->marks.set_pixel_ratio(ratio);
    for (auto& [id, surface] : scene_->surfaces) surface.set_pixel_ratio(ratio);
    scene_->trust_legend.set_pixel_ratio(ratio);
    scene_->cube.follow(scene_->main->GetActiveCamera(), scene_->corner, size[0], size[1], ratio);
}

void SurfaceView::draw() {
    if (isValid() && isVisible()) scene_->window->Render();
}

void SurfaceView::finish_frame() {
    scene_->window->WaitForCompletion();  // otherwise the time would end before drawing does
    frame_ = static_cast<double>(frame_timer_.nsecsElapsed()) / 1e6;
    all_frames_ += frame_;
    all_frames_processor_ += thread_milliseconds() - frame_began_;
    const bool full = std::all_of(scene_->surfaces.begin(), scene_->surfaces.end(),
                                  [](const auto& entry) { return entry.second.drawn_full(); });
    if (full) full_frame_ = frame_;
    if (++frames_ == 1) {
        const char* capabilities = scene_->window->ReportCapabilities();
        software_ =
            capabilities && (std::strstr(capabilities, "llvmpipe") || std::strstr(capabilities, "softpipe"));
    }
    emit drawn();
}

QImage SurfaceView::screenshot(const QSize& size) {
    constexpr int kOversampling = 2;
    vtkRenderWindow* window = scene_->window;
    const int before[2]{window->GetSize()[0], window->GetSize()[1]};
    const double full_frame = full_frame_;
    for (auto& [id, surface] : scene_->surfaces) surface.choose(false);
    window->SetSize(size.width() * kOversampling, size.height() * kOversampling);
    vtkNew<vtkWindowToImageFilter> filter;
    filter->SetInput(window);
    filter->ReadFrontBufferOff();
    filter->SetInputBufferTypeToRGB();
    filter->Update();
    vtkImageData* pixels = filter->GetOutput();
    const int width = pixels->GetDimensions()[0], height = pixels->GetDimensions()[1];
    QImage image(width, height, QImage::Format_RGB888);
    for (int y = 0; y < height; ++y) {
        const auto* from = static_cast<const uchar*>(pixels->GetScalarPointer(0, height - 1 - y, 0));
        std::copy(from, from + 3 * width, image.scanLine(y));
    }
    window->SetSize(before[0], before[1]);
    full_frame_ = full_frame;  // a frame of the picture's size says nothing about those of the view
    choose_detail();
    draw();
    return image.scaled(size, Qt::IgnoreAspectRatio, Qt::SmoothTransformation);
}

Ray SurfaceView::ray_at(const QPoint& point) const {
    vtkRenderer* renderer = scene_->main;
    const double ratio = devicePixelRatioF();
    const auto world = [&](double depth) {
        renderer->SetDisplayPoint(point.x() * ratio, (height() - 1 - point.y()) * ratio, depth);
        renderer->DisplayToWorld();
        double p[4];
        renderer->GetWorldPoint(p);
        return Vec3d{p[0] / p[3], p[1] / p[3], p[2] / p[3]};
    };
    const Vec3d near = world(0), far = world(1);
    return {near, unit(far - near)};
}

// The cut shows the samples inside the outermost surface.
std::optional<double> SurfaceView::hit_on_cut(const Ray& ray, const HalfSpace& visible,
                                              double lowest_isovalue) const {
    const double approach = dot(visible.normal, ray.direction);
    if (approach == 0) return {};
    const double t = -visible.height(ray.origin) / approach;
    if (!(t > 0)) return {};
    const Volume& volume = session_.scan()->volume;
    const Vec3d index = index_of(volume.geometry(), ray.at(t));
    const SampleBox box = session_.crop();
    std::array<std::int64_t, 3> sample;
    for (std::size_t a = 0; a < 3; ++a) {
        sample[a] = std::llround(std::clamp(index[a], -1.0, 1e9));
        if (sample[a] < box.first[a] || sample[a] > box.last[a]) return {};
    }
    if (!(sample_at(volume, sample[0], sample[1], sample[2]) >= lowest_isovalue)) return {};
    return t;
}

std::optional<Vec3d> SurfaceView::position_at(const QPoint& point) const {
    if (!session_.scan()) return {};
    const Ray ray = ray_at(point);
    const std::optional<HalfSpace> half = visible_half_space();
    const Parameters& p = session_.parameters();
    for (const bool translucent : {false, true}) {
        double nearest = std::numeric_limits<double>::infinity();
        double lowest = nearest;
        for (const auto& [id, actor] : scene_->surfaces) {
            const SurfaceParameters* surface = p.find(id);
            if (!surface || !surface->visible || surface->opacity == 0) continue;
            lowest = std::min(lowest, surface->isovalue);
            if ((surface->opacity < 1) != translucent) continue;
            const Shape* shape = actor.shape();
            if (!shape) continue;
            if (const auto hit = first_hit(*shape->mesh, ray, half)) nearest = std::min(nearest, *hit);
        }
        if (half) {
            if (const auto hit = hit_on_cut(ray, *half, lowest)) nearest = std::min(nearest, *hit);
        }
        if (nearest < std::numeric_limits<double>::infinity()) return ray.at(nearest);
    }
    return {};
}

std::optional<QPointF> SurfaceView::widget_point(const Vec3d& position) const {
    // The projection would mirror it.
    if (dot(position - camera().position, view_direction()) <= 0) return {};
    vtkRenderer* renderer = scene_->main;
    renderer->SetWorldPoint(position[0], position[1], position[2], 1);
    renderer->WorldToDisplay();
    double p[3];
    renderer->GetDisplayPoint(p);
    const double ratio = devicePixelRatioF();
    return QPointF(p[0] / ratio, height() - 1 - p[1] / ratio);
}

Vec3d SurfaceView::view_direction() const {
    Vec3d d;
    scene_->main->GetActiveCamera()->GetDirectionOfProjection(d.data());
    return d;
}

// Ends move on the surfaces.
MarkView SurfaceView::mark_view() {
    return {[this](const Vec3d& position) { return widget_point(position); },
            [this](const Vec3d&, const QPoint& point) { return position_at(point); },
            [this](const QPoint& point) { click(point); }};
}

void SurfaceView::click(const QPoint& point) {
    before_click_ = session_.crosshair();
    if (const auto position = position_at(point)) session_.click(*position);
}

bool SurfaceView::event(QEvent* event) {
    const bool press = event->type() == QEvent::MouseButtonPress;
    const bool release = event->type() == QEvent::MouseButtonRelease;
    if (press) setFocus(Qt::MouseFocusReason);
    if (event->type() == QEvent::Show) request_draw();  // what changed while the view was hidden
    if (event->type() == QEvent::MouseButtonDblClick && session_.tool() == Tool::navigate) {
        const auto* mouse = static_cast<QMouseEvent*>(event);
        if (mouse->button() == Qt::LeftButton && mouse->modifiers() == Qt::NoModifier) {
            pressed_valid_ = false;
            session_.set_crosshair(before_click_);
            emit double_clicked();
            return true;
        }
    }
    // Handles of the crop box and ends of measurements take precedence over VTK's camera.
    if (press || release || event->type() == QEvent::MouseMove) {
        const auto& mouse = *static_cast<QMouseEvent*>(event);
        if (crop_drag_.handle_event(mouse) || (session_.scan() && mark_drag_.handle_event(mouse))) {
            pressed_valid_ = false;
            return true;
        }
    }
    if (press) {
        const auto* mouse = static_cast<QMouseEvent*>(event);
        pressed_ = mouse->pos();
        pressed_valid_ = mouse->button() == Qt::LeftButton;
    } else if (release) {
        const auto* mouse = static_cast<QMouseEvent*>(event);
        const bool click = pressed_valid_ && mouse->button() == Qt::LeftButton &&
                           (mouse->pos() - pressed_).manhattanLength() <= kClick;
        const bool result = QVTKOpenGLNativeWidget::event(event);
        if (click && mouse->modifiers() == Qt::NoModifier) this->click(mouse->pos());
        return result;
    }
    return QVTKOpenGLNativeWidget::event(event);
}

}  // namespace marrow::viewer
