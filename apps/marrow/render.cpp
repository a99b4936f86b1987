// Draws surfaces with VTK.
#include "render.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include <vtkActor.h>
#include <vtkAutoInit.h>
#include <vtkCamera.h>
#include <vtkCameraPass.h>
#include <vtkCellArray.h>
#include <vtkDualDepthPeelingPass.h>
#include <vtkFloatArray.h>
#include <vtkImageShrink3D.h>
#include <vtkLightKit.h>
#include <vtkLightsPass.h>
#include <vtkNew.h>
#include <vtkOpaquePass.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderPassCollection.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSSAOPass.h>
#include <vtkSequencePass.h>
#include <vtkShaderProperty.h>
#include <vtkSmartPointer.h>
#include <vtkTranslucentPass.h>
#include <vtkTypeInt32Array.h>
#include <vtkTypeInt64Array.h>
#include <vtkWindowToImageFilter.h>

#include <marrow/atomic_file.h>
#include <marrow/error.h>
#include <marrow/vector.h>

#include "png.h"
#include "shared/display.h"
#include "shared/report_progress.h"

VTK_MODULE_INIT(vtkRenderingOpenGL2);

namespace marrow::apps {
namespace {

constexpr int kWidth = 1600;
constexpr int kHeight = 1200;
constexpr int kOversampling = 2;  // draw this many times larger, then average

// Shares the mesh's memory where VTK allows; the mesh must outlive the result.
vtkNew<vtkPolyData> to_vtk(const Mesh& mesh) {
    constexpr int kBorrowed = 1;
    const auto vectors = [](const Buffer<Vec3f>& from, vtkFloatArray* to) {
        to->SetNumberOfComponents(3);
        to->SetArray(const_cast<float*>(from.data()->data()), 3 * static_cast<vtkIdType>(from.size()),
                     kBorrowed);
    };
    vtkNew<vtkFloatArray> coordinates, normals;
    vectors(mesh.points, coordinates);
    vectors(mesh.normals, normals);
    vtkNew<vtkPoints> points;
    points->SetData(coordinates);

    vtkNew<vtkTypeInt64Array> corners;
    corners->SetNumberOfValues(3 * static_cast<vtkIdType>(mesh.triangles.size()));
    vtkTypeInt64* next = corners->GetPointer(0);
    for (const Triangle& t : mesh.triangles) next = std::copy(t.begin(), t.end(), next);
    vtkNew<vtkCellArray> triangles;
    triangles->SetData(3, corners);

    vtkNew<vtkPolyData> result;
    result->SetPoints(points);
    result->GetPointData()->SetNormals(normals);
    result->SetPolys(triangles);
    return result;
}

// The mapper draws colours of points as they are.
void add_colours(std::span<const Rgb8> colours, vtkPolyData& polydata) {
    vtkNew<vtkUnsignedCharArray> scalars;
    scalars->SetNumberOfComponents(3);
    scalars->SetNumberOfTuples(static_cast<vtkIdType>(colours.size()));
    std::copy_n(colours.front().data(), 3 * colours.size(), scalars->GetPointer(0));
    polydata.GetPointData()->SetScalars(scalars);
}

double along(const Vec3d& axis, const Vec3f& p) {
    return axis[0] * p[0] + axis[1] * p[1] + axis[2] * p[2];
}

// Points the camera at the surfaces, upright and as close as all points fit into the picture.
void aim(vtkCamera* camera, const std::vector<RenderedSurface>& surfaces, const CameraAngles& angles) {
    constexpr double kRadians = 3.14159265358979323846 / 180;
    const double turn = angles.turn * kRadians, rise = angles.rise * kRadians;
    constexpr double kViewAngle = 20, kMargin = 1.12;
    const double ct = std::cos(turn), st = std::sin(turn), cr = std::cos(rise), sr = std::sin(rise);
    const Vec3d towards{st * cr, -ct * cr, sr};  // from the patient to the camera; LPS: -y is anterior
    const Vec3d right{ct, st, 0};
    const Vec3d up{-st * sr, ct * sr, cr};

    Vec3d lower{1e300, 1e300, 1e300}, upper{-1e300, -1e300, -1e300};
    const auto each_point = [&](auto visit) {
        for (const RenderedSurface& surface : surfaces) {
            for (const Vec3f& p : surface.mesh->points)
                visit(Vec3d{along(right, p), along(up, p), along(towards, p)});
        }
    };
    each_point([&](const Vec3d& p) {
        for (std::size_t a = 0; a < 3; ++a) {
            lower[a] = std::min(lower[a], p[a]);
            upper[a] = std::max(upper[a], p[a]);
        }
    });
    const double x = (lower[0] + upper[0]) / 2, y = (lower[1] + upper[1]) / 2, z = (lower[2] + upper[2]) / 2;
    const double slope = std::tan(kViewAngle / 2 * kRadians);
    const double aspect = static_cast<double>(kWidth) / kHeight;
    double distance = 0;
    each_point([&](const Vec3d& p) {
        const double across = std::max(std::abs(p[0] - x) / aspect, std::abs(p[1] - y)) * kMargin;
        distance = std::max(distance, across / slope + (p[2] - z));
    });

    const auto position = [&](double depth) {
        Vec3d p;
        for (std::size_t a = 0; a < 3; ++a) p[a] = x * right[a] + y * up[a] + depth * towards[a];
        return p;
    };
    camera->SetFocalPoint(position(z).data());
    camera->SetPosition(position(z + distance).data());
    camera->SetViewUp(up.data());
    camera->SetViewAngle(kViewAngle);
}

// Draws opaque surfaces with ambient occlusion, then translucent ones over them, the nearest last.
void shade(vtkRenderer* renderer) {
    const auto sequence = [](std::initializer_list<vtkRenderPass*> passes) {
        vtkNew<vtkRenderPassCollection> steps;
        for (vtkRenderPass* pass : passes) steps->AddItem(pass);
        vtkNew<vtkSequencePass> result;
        result->SetPasses(steps);
        return result;
    };
    vtkNew<vtkLightsPass> lights;
    vtkNew<vtkOpaquePass> opaque;
    vtkNew<vtkCameraPass> camera;
    camera->SetDelegatePass(sequence({lights, opaque}));
    vtkNew<vtkSSAOPass> occlusion;
    occlusion->SetDelegatePass(camera);
    occlusion->SetRadius(20);  // mm
    occlusion->SetBias(0.5);   // mm
    occlusion->SetKernelSize(24);
    occlusion->BlurOn();
    vtkNew<vtkTranslucentPass> translucent;
    vtkNew<vtkDualDepthPeelingPass> peeling;
    peeling->SetTranslucentPass(translucent);
    peeling->SetMaximumNumberOfPeels(3);
    renderer->SetPass(sequence({occlusion, peeling}));
}

// Makes a surface like glass: clear where it faces the camera, denser towards its outline.
void make_translucent(vtkActor* actor) {
    actor->ForceTranslucentOn();
    actor->GetProperty()->BackfaceCullingOn();
    actor->GetShaderProperty()->AddFragmentShaderReplacement(
        "//VTK::Light::Impl", true,
        "//VTK::Light::Impl\n"
        "  float facing = abs(normalVCVSOutput.z);\n"
        "  gl_FragData[0].a = mix(1.0, 0.15, pow(facing, 0.8));\n",
        false);
}

vtkNew<vtkActor> to_actor(const RenderedSurface& surface) {
    vtkNew<vtkPolyDataMapper> mapper;
    const vtkNew<vtkPolyData> polydata = to_vtk(*surface.mesh);
    if (!surface.point_colours.empty()) add_colours(surface.point_colours, *polydata);
    mapper->SetInputData(polydata);
    vtkNew<vtkActor> actor;
    actor->SetMapper(mapper);
    vtkProperty* look = actor->GetProperty();
    look->SetColor(surface.colour[0], surface.colour[1], surface.colour[2]);
    look->SetSpecular(0.15);
    look->SetSpecularPower(25);
    if (surface.translucent) make_translucent(actor);
    return actor;
}

// Draws the scene off screen and returns it as a PNG file.
std::string draw(vtkRenderer* renderer) {
    vtkNew<vtkRenderWindow> window;
    window->SetOffScreenRendering(1);
    window->SetMultiSamples(0);
    window->SetSize(kWidth * kOversampling, kHeight * kOversampling);
    window->AddRenderer(renderer);
    window->Render();

    vtkNew<vtkWindowToImageFilter> pixels;
    pixels->SetInput(window);
    pixels->ReadFrontBufferOff();
    vtkNew<vtkImageShrink3D> average;
    average->SetInputConnection(pixels->GetOutputPort());
    average->SetShrinkFactors(kOversampling, kOversampling, 1);
    average->MeanOn();
    average->Update();
    return png_of(average->GetOutput());
}

}  // namespace

void render(const std::vector<RenderedSurface>& surfaces, const std::filesystem::path& file,
            const Progress& progress, const CameraAngles& angles) {
    require_display("--picture");

    vtkNew<vtkRenderer> renderer;
    renderer->GradientBackgroundOn();
    renderer->SetBackground(0.10, 0.12, 0.15);   // bottom
    renderer->SetBackground2(0.30, 0.36, 0.43);  // top
    for (const RenderedSurface& surface : surfaces) renderer->AddActor(to_actor(surface));
    aim(renderer->GetActiveCamera(), surfaces, angles);
    renderer->ResetCameraClippingRange();
    vtkNew<vtkLightKit> lights;  // key, fill and back lights that go with the camera
    lights->SetKeyLightAngle(45, -35);
    lights->SetKeyToFillRatio(2.2);
    lights->SetKeyToBackRatio(2.2);
    lights->AddLightsToRenderer(renderer);
    shade(renderer);

    const std::string png = draw(renderer);
    report(progress, 1);  // drawing cannot be cancelled, but writing can
    AtomicFile out(file);
    out.write(png.data(), png.size());
    out.commit();
}

}  // namespace marrow::apps
