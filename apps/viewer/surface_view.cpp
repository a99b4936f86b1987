#include "surface_view.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include <time.h>
#include <vtkActor.h>
#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkImageData.h>
#include <vtkInteractorStyleTrackballCamera.h>
#include <vtkLightKit.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPlane.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkRenderer.h>
#include <vtkRendererCollection.h>
#include <vtkShaderProperty.h>
#include <vtkUniforms.h>
#include <vtkWindowToImageFilter.h>

#include <QMouseEvent>

#include "scene_parts.h"
#include "slice_frame.h"

namespace marrow::viewer {
namespace {

constexpr double kViewAngle = 24;
constexpr double kSlowFrame =
    60;                    // ms; when a full frame takes longer, previews are drawn while the view moves
constexpr int kClick = 4;  // pixels that a hand may shake

Vec3d cross(const Vec3d& a, const Vec3d& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double dot(const Vec3d& a, const Vec3d& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Vec3d unit(const Vec3d& a) {
    const double length = std::sqrt(dot(a, a));
    return {a[0] / length, a[1] / length, a[2] / length};
}

// Mouse as VTK, ParaView and 3D Slicer have it; keys are the window's own.
class Style : public vtkInteractorStyleTrackballCamera {
  public:
    static Style* New();
    vtkTypeMacro(Style, vtkInteractorStyleTrackballCamera);
    void OnChar() override {}
    void OnKeyPress() override {}
    void OnKeyDown() override {}
};
vtkStandardNewMacro(Style);

// The sides as directions from the patient, and what is up from there. LPS.
std::pair<Vec3d, Vec3d> direction_of(Side side) {
    switch (side) {
        case Side::anterior:
            return {{0, -1, 0}, {0, 0, 1}};
        case Side::posterior:
            return {{0, 1, 0}, {0, 0, 1}};
        case Side::left:
            return {{1, 0, 0}, {0, 0, 1}};
        case Side::right:
            return {{-1, 0, 0}, {0, 0, 1}};
        case Side::superior:
            return {{0, 0, 1}, {0, -1, 0}};
        case Side::inferior:
            break;
    }
    return {{0, 0, -1}, {0, -1, 0}};
}

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
    struct Drawn {
        vtkNew<vtkActor> actor;
        vtkNew<vtkPolyDataMapper> full_mapper, preview_mapper;
        std::shared_ptr<const Shape> full, preview;  // whose memory the mappers use
        bool glass = false;
    };

    vtkNew<vtkGenericOpenGLRenderWindow> window;
    vtkNew<vtkRenderer> main, overlay, corner;
    vtkNew<vtkLightKit> lights;
    vtkNew<Style> style;
    vtkNew<vtkPlane> plane;
    std::map<int, Drawn> surfaces;
    CutFace cut_face;
    Crosshair crosshair;
    Marks marks;
    OrientationCube cube;
    bool cut = false;
    std::function<void()> on_frame_start, on_frame_end, on_start, on_end;
};

SurfaceView::SurfaceView(Session& session, Surfaces& surfaces, QWidget* parent)
    : QVTKOpenGLNativeWidget(parent),
      session_(session),
      surfaces_(surfaces),
      scene_(std::make_unique<Scene>()) {
    setRenderWindow(scene_->window);
    setFocusPolicy(Qt::StrongFocus);
    setMinimumSize(240, 200);
    setToolTip({});

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
    scene_->marks.add_to(scene_->overlay);
    scene_->cube.add_to(scene_->corner);
    set_light_background(false);

    window->GetInteractor()->SetInteractorStyle(scene_->style);
    scene_->on_frame_start = [this] {
        frame_timer_.start();
        frame_began_ = thread_milliseconds();
        prepare_camera();
    };
    scene_->on_frame_end = [this] { finish_frame(); };
    scene_->on_start = [this] { set_moving(true); };
    scene_->on_end = [this] { set_moving(false); };
    observe(window, vtkCommand::StartEvent, &scene_->on_frame_start);
    observe(window, vtkCommand::EndEvent, &scene_->on_frame_end);
    observe(scene_->style, vtkCommand::StartInteractionEvent, &scene_->on_start);
    observe(scene_->style, vtkCommand::EndInteractionEvent, &scene_->on_end);
    drawing_.setSingleShot(true);
    connect(&drawing_, &QTimer::timeout, this, &SurfaceView::draw);

    connect(&session_, &Session::scan_changed, this, [this] {
        for (auto& [id, drawn] : scene_->surfaces) scene_->main->RemoveActor(drawn.actor);
        scene_->surfaces.clear();
        fitted_ = false;
        full_frame_ = 0;
    });
    connect(&session_, &Session::parameters_changed, this, &SurfaceView::follow_parameters);
    connect(&session_, &Session::crosshair_changed, this, &SurfaceView::follow_crosshair);
    connect(&session_, &Session::picking_changed, this, &SurfaceView::follow_measurements);
    connect(&surfaces_, &Surfaces::shape_changed, this, &SurfaceView::follow_shapes);
    connect(&surfaces_, &Surfaces::removed, this, [this](int id) {
        const auto it = scene_->surfaces.find(id);
        if (it == scene_->surfaces.end()) return;
        scene_->main->RemoveActor(it->second.actor);
        scene_->surfaces.erase(it);
        request_draw();
    });
}

SurfaceView::~SurfaceView() {
    makeCurrent();  // for what the mappers hold in the graphics memory
    for (vtkRenderer* renderer : {scene_->main.Get(), scene_->overlay.Get(), scene_->corner.Get()})
        renderer->RemoveAllViewProps();
}

void SurfaceView::follow_shapes(int id) {
    const std::shared_ptr<const Shape> shape = surfaces_.shape(id);
    if (!shape) return;
    const bool is_new = scene_->surfaces.find(id) == scene_->surfaces.end();
    Scene::Drawn& drawn = scene_->surfaces[id];
    vtkPolyDataMapper* mapper = shape->level > 0 ? drawn.preview_mapper : drawn.full_mapper;
    mapper->SetInputData(shape->polydata);
    mapper->ScalarVisibilityOff();
    if (shape->level > 0) {
        drawn.preview = shape;
        drawn.full.reset();
    } else {
        drawn.full = shape;
    }
    if (is_new) {
        scene_->main->AddActor(drawn.actor);
        follow_parameters();
    }
    if (!drawn.full) drawn.full_mapper->SetInputData(nullptr);
    choose_detail();
    if (!fitted_ && !shape->mesh->points.empty()) {
        fitted_ = true;
        reset_view();
    }
    request_draw();
}

void SurfaceView::follow_parameters() {
    if (!session_.scan()) return;
    const Parameters& p = session_.parameters();
    for (auto& [id, drawn] : scene_->surfaces) {
        const SurfaceParameters* surface = p.find(id);
        if (!surface) continue;
        vtkActor* actor = drawn.actor;
        vtkProperty* look = actor->GetProperty();
        const bool solid = p.mode == DrawMode::surface || p.mode == DrawMode::edges;
        look->SetColor(surface->colour.redF(), surface->colour.greenF(), surface->colour.blueF());
        look->SetRepresentation(p.mode == DrawMode::wireframe ? VTK_WIREFRAME
                                : p.mode == DrawMode::points  ? VTK_POINTS
                                                              : VTK_SURFACE);
        look->SetEdgeVisibility(p.mode == DrawMode::edges);
        look->SetEdgeColor(0.10, 0.12, 0.15);
        look->SetPointSize(2);
        look->SetSpecular(0.15);
        look->SetSpecularPower(25);
        look->SetOpacity(surface->opacity);
        // Like glass: clearer where it faces the camera than at its outline.
        const bool glass = surface->opacity < 1 && solid;
        look->SetBackfaceCulling(glass);
        actor->SetForceTranslucent(surface->opacity < 1);
        vtkShaderProperty* shader = actor->GetShaderProperty();
        if (glass) {
            shader->GetFragmentCustomUniforms()->SetUniformf("facing_opacity",
                                                             static_cast<float>(surface->opacity));
            if (!drawn.glass)
                shader->AddFragmentShaderReplacement(
                    "//VTK::Light::Impl", true,
                    "//VTK::Light::Impl\n"
                    "  float facing = pow(abs(normalVCVSOutput.z), 0.8);\n"
                    "  gl_FragData[0].a = mix(min(1.0, 3.0 * facing_opacity), facing_opacity, facing);\n",
                    false);
        } else if (drawn.glass) {
            shader->ClearAllFragmentShaderReplacements();
        }
        drawn.glass = glass;
        actor->SetVisibility(surface->visible && surface->opacity > 0);
    }
    follow_crosshair();
    follow_measurements();
}

void SurfaceView::follow_crosshair() {
    const Scan* scan = session_.scan();
    if (!scan) return;
    scene_->crosshair.place(scan->volume.geometry(), session_.crosshair());

    const std::optional<HalfSpace> half = kept();
    if (half) {
        scene_->plane->SetOrigin(half->point.data());
        scene_->plane->SetNormal(half->normal.data());
        const Parameters& p = session_.parameters();
        double lowest = std::numeric_limits<double>::infinity();
        for (const SurfaceParameters& surface : p.surfaces) {
            if (surface.visible && surface.opacity > 0) lowest = std::min(lowest, surface.isovalue);
        }
        scene_->cut_face.show(*scan, *p.cut.plane, session_.crosshair(), p.window, lowest);
    } else {
        scene_->cut_face.hide();
    }
    scene_->cut = half.has_value();
    for (auto& [id, drawn] : scene_->surfaces) {
        for (vtkPolyDataMapper* mapper : {drawn.full_mapper.Get(), drawn.preview_mapper.Get()}) {
            mapper->RemoveAllClippingPlanes();
            if (half) mapper->AddClippingPlane(scene_->plane);
        }
    }
    request_draw();
}

void SurfaceView::follow_measurements() {
    scene_->marks.show(session_.parameters().measurements, session_.picked());
    request_draw();
}

std::optional<HalfSpace> SurfaceView::kept() const {
    const Scan* scan = session_.scan();
    const Cut& cut = session_.parameters().cut;
    if (!scan || !cut.plane) return {};
    const Geometry& geometry = scan->volume.geometry();
    const SliceFrame frame = slice_frame(geometry, *cut.plane);
    const Mat3d m = geometry.index_to_physical();
    const auto column = [&](int axis) {
        const auto a = static_cast<std::size_t>(axis);
        return Vec3d{m[0][a], m[1][a], m[2][a]};
    };
    Vec3d index = session_.crosshair();
    double& through = index[static_cast<std::size_t>(frame.through)];
    through = std::round(through);
    Vec3d normal = unit(cross(column(frame.across), column(frame.down)));
    // Off comes what is superior, anterior or left, until it is flipped.
    constexpr std::array<Vec3d, 3> kOff{{{0, 0, 1}, {0, -1, 0}, {1, 0, 0}}};
    const bool towards_off = dot(normal, kOff[static_cast<std::size_t>(*cut.plane)]) > 0;
    if (towards_off != cut.flipped)
        for (double& x : normal) x = -x;
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
    request_draw();
}

void SurfaceView::set_crosshair_visible(bool visible) {
    scene_->crosshair.set_visible(visible);
    request_draw();
}

// As near as all that is visible fits. Some thousand points of each surface stand for all.
void SurfaceView::aim(const Vec3d& towards, const Vec3d& up_hint) {
    const Vec3d right = unit(cross(up_hint, towards)), up = cross(towards, right);
    const auto each_point = [&](auto visit) {
        for (const auto& [id, drawn] : scene_->surfaces) {
            const Shape* shape = drawn.full ? drawn.full.get() : drawn.preview.get();
            if (!shape || !drawn.actor->GetVisibility()) continue;
            const auto& points = shape->mesh->points;
            const std::size_t step = 1 + points.size() / 20000;
            for (std::size_t i = 0; i < points.size(); i += step) {
                const Vec3d p{points[i][0], points[i][1], points[i][2]};
                visit(Vec3d{dot(right, p), dot(up, p), dot(towards, p)});
            }
        }
    };
    Vec3d lower{1e300, 1e300, 1e300}, upper{-1e300, -1e300, -1e300};
    each_point([&](const Vec3d& p) {
        for (std::size_t a = 0; a < 3; ++a) {
            lower[a] = std::min(lower[a], p[a]);
            upper[a] = std::max(upper[a], p[a]);
        }
    });
    if (lower[0] > upper[0]) return;
    Vec3d middle;
    for (std::size_t a = 0; a < 3; ++a) middle[a] = (lower[a] + upper[a]) / 2;
    const double slope = std::tan(kViewAngle / 2 * M_PI / 180);
    const double aspect = std::max(0.1, static_cast<double>(width()) / std::max(1, height()));
    double distance = 1;
    each_point([&](const Vec3d& p) {
        const double across = std::max(std::abs(p[0] - middle[0]) / aspect, std::abs(p[1] - middle[1]));
        distance = std::max(distance, 1.12 * across / slope + p[2] - middle[2]);
    });
    Vec3d focal, position;
    for (std::size_t a = 0; a < 3; ++a) {
        focal[a] = middle[0] * right[a] + middle[1] * up[a] + middle[2] * towards[a];
        position[a] = focal[a] + distance * towards[a];
    }
    vtkCamera* camera = scene_->main->GetActiveCamera();
    camera->SetFocalPoint(focal.data());
    camera->SetPosition(position.data());
    camera->SetViewUp(up.data());
    request_draw();
}

void SurfaceView::look_from(Side side) {
    const auto [towards, up] = direction_of(side);
    aim(towards, up);
}

void SurfaceView::reset_view() {
    constexpr double kTurn = 30 * M_PI / 180, kRise = 10 * M_PI / 180;
    aim({std::sin(kTurn) * std::cos(kRise), -std::cos(kTurn) * std::cos(kRise), std::sin(kRise)}, {0, 0, 1});
}

void SurfaceView::turn(double degrees) {
    vtkCamera* camera = scene_->main->GetActiveCamera();
    Vec3d focal, position, up;
    camera->GetFocalPoint(focal.data());
    camera->GetPosition(position.data());
    camera->GetViewUp(up.data());
    const double c = std::cos(degrees * M_PI / 180), s = std::sin(degrees * M_PI / 180);
    const auto turned = [&](double x, double y) { return std::pair{c * x - s * y, s * x + c * y}; };
    std::tie(position[0], position[1]) = turned(position[0] - focal[0], position[1] - focal[1]);
    std::tie(up[0], up[1]) = turned(up[0], up[1]);
    camera->SetPosition(position[0] + focal[0], position[1] + focal[1], position[2]);
    camera->SetViewUp(up.data());
    request_draw();
}

void SurfaceView::set_moving(bool moving) {
    moving_ = moving;
    choose_detail();
    request_draw();
}

void SurfaceView::choose_detail() {
    for (auto& [id, drawn] : scene_->surfaces) {
        const bool preview = drawn.preview && (!drawn.full || (moving_ && full_frame_ > kSlowFrame));
        drawn.actor->SetMapper(preview ? drawn.preview_mapper : drawn.full_mapper);
    }
}

void SurfaceView::request_draw() {
    if (!drawing_.isActive()) drawing_.start(0);
}

void SurfaceView::prepare_camera() {
    vtkCamera* camera = scene_->main->GetActiveCamera();
    if (const Scan* scan = session_.scan()) {
        // The whole scan, so that crosshair and cut are never clipped away.
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
    const int* size = scene_->window->GetSize();
    scene_->cube.follow(camera, scene_->corner, size[0], size[1], devicePixelRatioF());
}

void SurfaceView::draw() {
    if (isValid() && isVisible()) scene_->window->Render();
}

void SurfaceView::finish_frame() {
    scene_->window->WaitForCompletion();  // so that the time is that of drawing, not of asking for it
    frame_ = static_cast<double>(frame_timer_.nsecsElapsed()) / 1e6;
    all_frames_ += frame_;
    all_frames_processor_ += thread_milliseconds() - frame_began_;
    const bool full = std::all_of(scene_->surfaces.begin(), scene_->surfaces.end(), [](const auto& entry) {
        return entry.second.full && entry.second.actor->GetMapper() == entry.second.full_mapper;
    });
    if (full) full_frame_ = frame_;
    if (++frames_ == 1) {
        const char* capabilities = scene_->window->ReportCapabilities();
        software_ =
            capabilities && (std::strstr(capabilities, "llvmpipe") || std::strstr(capabilities, "softpipe"));
    }
    emit drawn();
}

QImage SurfaceView::picture(const QSize& size) {
    constexpr int kOversampling = 2;
    vtkRenderWindow* window = scene_->window;
    const int before[2]{window->GetSize()[0], window->GetSize()[1]};
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
    draw();
    return image.scaled(size, Qt::IgnoreAspectRatio, Qt::SmoothTransformation);
}

Ray SurfaceView::ray_at(const QPoint& place) const {
    vtkRenderer* renderer = scene_->main;
    const double ratio = devicePixelRatioF();
    const auto world = [&](double depth) {
        renderer->SetDisplayPoint(place.x() * ratio, (height() - 1 - place.y()) * ratio, depth);
        renderer->DisplayToWorld();
        double p[4];
        renderer->GetWorldPoint(p);
        return Vec3d{p[0] / p[3], p[1] / p[3], p[2] / p[3]};
    };
    const Vec3d near = world(0), far = world(1);
    return {near, unit({far[0] - near[0], far[1] - near[1], far[2] - near[2]})};
}

std::optional<Vec3d> SurfaceView::position_at(const QPoint& place) const {
    const Scan* scan = session_.scan();
    if (!scan) return {};
    const Ray ray = ray_at(place);
    const std::optional<HalfSpace> half = kept();
    const Parameters& p = session_.parameters();
    for (const bool translucent : {false, true}) {
        double nearest = std::numeric_limits<double>::infinity();
        double lowest = nearest;
        for (const auto& [id, drawn] : scene_->surfaces) {
            const SurfaceParameters* surface = p.find(id);
            if (!surface || !surface->visible || surface->opacity == 0) continue;
            lowest = std::min(lowest, surface->isovalue);
            if ((surface->opacity < 1) != translucent) continue;
            const Shape* shape = drawn.full ? drawn.full.get() : drawn.preview.get();
            if (!shape) continue;
            if (const auto hit = first_hit(*shape->mesh, ray, half)) nearest = std::min(nearest, *hit);
        }
        // The cut shows what lies inside the outermost surface.
        const double approach = half ? dot(half->normal, ray.direction) : 0;
        if (approach != 0) {
            const double along = -half->height(ray.origin) / approach;
            const Vec3d index = index_of(scan->volume.geometry(), ray.at(along));
            const auto& dims = scan->volume.geometry().dims;
            std::array<std::int64_t, 3> sample;
            bool inside = along > 0;
            for (std::size_t a = 0; a < 3; ++a) {
                sample[a] = std::llround(std::clamp(index[a], -1.0, 1e9));
                inside = inside && sample[a] >= 0 && sample[a] < dims[a];
            }
            if (inside && sample_at(scan->volume, sample[0], sample[1], sample[2]) >= lowest)
                nearest = std::min(nearest, along);
        }
        if (nearest < std::numeric_limits<double>::infinity()) return ray.at(nearest);
    }
    return {};
}

QPointF SurfaceView::place_of(const Vec3d& position) const {
    vtkRenderer* renderer = scene_->main;
    renderer->SetWorldPoint(position[0], position[1], position[2], 1);
    renderer->WorldToDisplay();
    double p[3];
    renderer->GetDisplayPoint(p);
    const double ratio = devicePixelRatioF();
    return {p[0] / ratio, height() - 1 - p[1] / ratio};
}

Vec3d SurfaceView::view_direction() const {
    Vec3d d;
    scene_->main->GetActiveCamera()->GetDirectionOfProjection(d.data());
    return d;
}

bool SurfaceView::event(QEvent* event) {
    if (event->type() == QEvent::MouseButtonPress) {
        const auto* mouse = static_cast<QMouseEvent*>(event);
        pressed_ = mouse->pos();
        pressed_valid_ = mouse->button() == Qt::LeftButton;
        setFocus(Qt::MouseFocusReason);
    } else if (event->type() == QEvent::MouseButtonRelease) {
        const auto* mouse = static_cast<QMouseEvent*>(event);
        const bool click = pressed_valid_ && mouse->button() == Qt::LeftButton &&
                           (mouse->pos() - pressed_).manhattanLength() <= kClick;
        const bool result = QVTKOpenGLNativeWidget::event(event);
        if (click && mouse->modifiers() == Qt::NoModifier) {
            if (const auto position = position_at(mouse->pos())) session_.click(*position);
        }
        return result;
    }
    return QVTKOpenGLNativeWidget::event(event);
}

}  // namespace marrow::viewer
