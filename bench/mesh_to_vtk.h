/// Passes meshes to VTK and back, to compare with its filters.
#pragma once

#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <marrow/mesh.h>

namespace marrow::bench {

inline vtkSmartPointer<vtkPolyData> to_vtk(const Mesh& mesh) {
    vtkNew<vtkPoints> points;
    vtkNew<vtkCellArray> polys;
    for (const Vec3f& p : mesh.points) points->InsertNextPoint(p.data());
    for (const Triangle& t : mesh.triangles) {
        const vtkIdType corners[3] = {t[0], t[1], t[2]};
        polys->InsertNextCell(3, corners);
    }
    const auto data = vtkSmartPointer<vtkPolyData>::New();
    data->SetPoints(points);
    data->SetPolys(polys);
    return data;
}

inline Mesh from_vtk(vtkPolyData* data) {
    Mesh mesh;
    for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i) {
        const double* p = data->GetPoint(i);
        mesh.points.push_back({static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
    }
    for (vtkIdType i = 0; i < data->GetNumberOfPolys(); ++i) {
        vtkIdType n = 0;
        const vtkIdType* corners = nullptr;
        data->GetPolys()->GetCellAtId(i, n, corners);
        mesh.triangles.push_back({static_cast<std::uint32_t>(corners[0]),
                                  static_cast<std::uint32_t>(corners[1]),
                                  static_cast<std::uint32_t>(corners[2])});
    }
    return mesh;
}

}  // namespace marrow::bench
