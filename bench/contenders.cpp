#include "contenders.h"

#include <malloc.h>
#include <vtkCellArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkMarchingCubes.h>
#include <vtkNew.h>
#include <vtkPolyData.h>

#include <chrono>
#include <limits>
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

Arm marrow_arm(const VolumeView& volume, double isovalue, int threads, bool normals) {
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

// The extractor that has the volume's block ranges already, going back and forth between two isovalues 4 %
// apart.
Arm next_arm(const VolumeView& volume, double isovalue, int threads) {
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
Arm vtk_arm(const std::string& name, const VolumeView& volume, double isovalue, bool normals) {
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

Arm classic_arm(const VolumeView& volume, double isovalue) {
    return {"classic", [=] {
                const auto start = std::chrono::steady_clock::now();
                const Mesh mesh = extract_isosurface_classic(volume, isovalue);
                return Result{milliseconds_since(start), static_cast<std::int64_t>(mesh.points.size()),
                              static_cast<std::int64_t>(mesh.triangles.size()), mesh_bytes(mesh), 0};
            }};
}

}  // namespace

std::vector<Arm> make_arms(const VolumeView& volume, double isovalue, int threads) {
    std::vector<Arm> arms{
        marrow_arm(volume, isovalue, threads, true),
        next_arm(volume, isovalue, threads),
        marrow_arm(volume, isovalue, threads, false),
        vtk_arm<vtkFlyingEdges3D>("flying-edges", volume, isovalue, true),
        vtk_arm<vtkFlyingEdges3D>("flying-edges-no-normals", volume, isovalue, false),
    };
    if (threads == 1) {  // these have no threads
        arms.push_back(vtk_arm<vtkMarchingCubes>("vtk-marching-cubes", volume, isovalue, true));
        arms.push_back(classic_arm(volume, isovalue));
    }
    return arms;
}

void set_memory(Memory memory) {
    if (memory == Memory::fresh) {
        mallopt(M_MMAP_MAX, 1 << 16);
        mallopt(M_MMAP_THRESHOLD, 1 << 17);
        mallopt(M_TRIM_THRESHOLD, 1 << 17);
        malloc_trim(0);
    } else {
        mallopt(M_MMAP_MAX, 0);
        mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
        mallopt(M_TOP_PAD, 1 << 26);
    }
}

}  // namespace marrow::bench
