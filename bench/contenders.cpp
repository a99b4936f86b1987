// Wraps Marrow, VTK and the classic algorithm.
#include "contenders.h"

#include <vtkCellArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkMarchingCubes.h>
#include <vtkNew.h>
#include <vtkPolyData.h>

#include <chrono>
#include <memory>

#include <marrow/isosurface.h>

#include "timing.h"
#include "vtk_image.h"

namespace marrow::bench {
namespace {

std::int64_t mesh_bytes(const Mesh& mesh) {
    return static_cast<std::int64_t>((mesh.points.size() + mesh.normals.size()) * sizeof(Vec3f) +
                                     mesh.triangles.size() * sizeof(Triangle));
}

Contender marrow_contender(const VolumeView& volume, double isovalue, int threads, bool normals) {
    return {normals ? "marrow" : "marrow-no-normals", [=] {
                const auto start = std::chrono::steady_clock::now();
                IsosurfaceStats stats;
                const Mesh mesh =
                    extract_isosurface(volume, isovalue, {.normals = normals, .threads = threads}, &stats);
                return Result{milliseconds_since(start), static_cast<std::int64_t>(mesh.points.size()),
                              static_cast<std::int64_t>(mesh.triangles.size()), mesh_bytes(mesh),
                              stats.scratch_bytes};
            }};
}

// Uses an extractor that already knows the block ranges of the volume, and alternates between two isovalues 4
// % apart.
Contender next_contender(const VolumeView& volume, double isovalue, int threads) {
    auto extractor = std::make_shared<IsosurfaceExtractor>(volume, IsosurfaceOptions{.threads = threads});
    extractor->extract(isovalue);
    return {"marrow-next", [=, other = false]() mutable {
                other = !other;
                const auto start = std::chrono::steady_clock::now();
                IsosurfaceStats stats;
                const Mesh& mesh = extractor->extract(other ? isovalue * 1.04 : isovalue, 0, &stats);
                return Result{milliseconds_since(start), static_cast<std::int64_t>(mesh.points.size()),
                              static_cast<std::int64_t>(mesh.triangles.size()), mesh_bytes(mesh),
                              stats.scratch_bytes};
            }};
}

template <class Filter>
Contender vtk_contender(const std::string& name, const VolumeView& volume, double isovalue, bool normals) {
    return {name, [=, image = vtk_image(volume)] {
                const auto start = std::chrono::steady_clock::now();
                vtkNew<Filter> filter;
                filter->SetInputData(image);
                filter->SetValue(0, isovalue);
                filter->SetComputeNormals(normals);
                filter->ComputeGradientsOff();
                filter->ComputeScalarsOff();
                filter->Update();
                const double milliseconds = milliseconds_since(start);
                vtkPolyData* surface = filter->GetOutput();
                return Result{milliseconds, surface->GetNumberOfPoints(), surface->GetNumberOfPolys(),
                              static_cast<std::int64_t>(surface->GetActualMemorySize()) * 1024};
            }};
}

Contender classic_contender(const VolumeView& volume, double isovalue) {
    return {"classic", [=] {
                const auto start = std::chrono::steady_clock::now();
                const Mesh mesh = extract_isosurface_classic(volume, isovalue);
                return Result{milliseconds_since(start), static_cast<std::int64_t>(mesh.points.size()),
                              static_cast<std::int64_t>(mesh.triangles.size()), mesh_bytes(mesh), 0};
            }};
}

}  // namespace

std::vector<Contender> make_contenders(const VolumeView& volume, double isovalue, int threads) {
    std::vector<Contender> contenders{
        marrow_contender(volume, isovalue, threads, true),
        next_contender(volume, isovalue, threads),
        marrow_contender(volume, isovalue, threads, false),
        vtk_contender<vtkFlyingEdges3D>("flying-edges", volume, isovalue, true),
        vtk_contender<vtkFlyingEdges3D>("flying-edges-no-normals", volume, isovalue, false),
    };
    if (threads == 1) {  // the others have no threads
        contenders.push_back(vtk_contender<vtkMarchingCubes>("vtk-marching-cubes", volume, isovalue, true));
        contenders.push_back(classic_contender(volume, isovalue));
    }
    return contenders;
}

}  // namespace marrow::bench
