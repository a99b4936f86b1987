// Renders a mesh with VTK.
#include "picture.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkWindowToImageFilter.h>

namespace marrow::paper {
namespace {

constexpr int kWidth = 480, kHeight = 360;  // pixels of each half

vtkSmartPointer<vtkPolyData> to_vtk(const Mesh& mesh) {
    vtkNew<vtkPoints> points;
    vtkNew<vtkFloatArray> normals;
    normals->SetNumberOfComponents(3);
    for (const Vec3f& p : mesh.points) points->InsertNextPoint(p.data());
    for (const Vec3f& n : mesh.normals) normals->InsertNextTuple(n.data());
    vtkNew<vtkCellArray> triangles;
    for (const Triangle& t : mesh.triangles) {
        const vtkIdType ids[3] = {t[0], t[1], t[2]};
        triangles->InsertNextCell(3, ids);
    }
    auto surface = vtkSmartPointer<vtkPolyData>::New();
    surface->SetPoints(points);
    surface->GetPointData()->SetNormals(normals);
    surface->SetPolys(triangles);
    return surface;
}

}  // namespace

void draw_shaded_and_edges(const Mesh& mesh, const Vec3d& view, const std::filesystem::path& file) {
    const auto surface = to_vtk(mesh);
    vtkNew<vtkRenderWindow> window;
    window->SetOffScreenRendering(1);
    window->SetMultiSamples(8);
    window->SetSize(2 * kWidth, kHeight);
    for (const bool edges : {false, true}) {
        vtkNew<vtkPolyDataMapper> mapper;
        mapper->SetInputData(surface);
        vtkNew<vtkActor> actor;
        actor->SetMapper(mapper);
        actor->GetProperty()->SetColor(0.93, 0.89, 0.80);
        if (edges) {
            actor->GetProperty()->EdgeVisibilityOn();
            actor->GetProperty()->SetEdgeColor(0.15, 0.2, 0.3);
        }
        vtkNew<vtkRenderer> renderer;
        renderer->SetViewport(edges ? 0.5 : 0, 0, edges ? 1 : 0.5, 1);
        renderer->SetBackground(1, 1, 1);
        renderer->AddActor(actor);
        vtkCamera* camera = renderer->GetActiveCamera();
        double middle[3];
        surface->GetCenter(middle);
        camera->SetFocalPoint(middle);
        camera->SetPosition(middle[0] + view[0], middle[1] + view[1], middle[2] + view[2]);
        camera->SetViewUp(0, 0, 1);
        renderer->ResetCamera();
        camera->Zoom(1.3);
        window->AddRenderer(renderer);
    }
    window->Render();
    vtkNew<vtkWindowToImageFilter> image;
    image->SetInput(window);
    image->ReadFrontBufferOff();
    vtkNew<vtkPNGWriter> writer;
    writer->SetInputConnection(image->GetOutputPort());
    writer->SetFileName(file.c_str());
    writer->Write();
}

}  // namespace marrow::paper
