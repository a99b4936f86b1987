// Wraps the classic algorithm, VTK and Marrow.
#include "contenders.h"

#include <vtkCellArray.h>
#include <vtkCellArrayIterator.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkMarchingCubes.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkShortArray.h>

#include <array>
#include <chrono>
#include <cstring>
#include <unordered_map>

#include <marrow/error.h>
#include <marrow/isosurface.h>

namespace marrow::paper {
namespace {

using PositionBits = std::array<std::uint32_t, 3>;

struct Hash {
    std::size_t operator()(const PositionBits& p) const {
        return p[0] * 73856093u ^ (p[1] * 19349663ull << 16) ^ (p[2] * 83492791ull << 32);
    }
};

// Merges points at the same position.
Mesh weld(const Mesh& soup) {
    Mesh mesh;
    std::unordered_map<PositionBits, std::uint32_t, Hash> index;
    index.reserve(soup.points.size() / 5);
    std::vector<std::uint32_t> welded(soup.points.size());
    for (std::size_t p = 0; p < soup.points.size(); ++p) {
        PositionBits bits;
        std::memcpy(bits.data(), soup.points[p].data(), sizeof bits);
        const auto [at, added] = index.try_emplace(bits, static_cast<std::uint32_t>(mesh.points.size()));
        if (added) mesh.points.push_back(soup.points[p]);
        welded[p] = at->second;
    }
    for (const Triangle& t : soup.triangles)
        mesh.triangles.push_back({welded[t[0]], welded[t[1]], welded[t[2]]});
    return mesh;
}

Mesh to_mesh(vtkPolyData* surface, const VolumeView& volume) {
    Mesh mesh;
    for (vtkIdType i = 0; i < surface->GetNumberOfPoints(); ++i) {
        // VTK 9.1 ignores the direction here and multiplies indices only by the spacing.
        double p[3];
        surface->GetPoint(i, p);
        const Geometry& g = volume.geometry;
        const Vec3d at = g.physical({p[0] / g.spacing[0], p[1] / g.spacing[1], p[2] / g.spacing[2]});
        mesh.points.push_back(
            {static_cast<float>(at[0]), static_cast<float>(at[1]), static_cast<float>(at[2])});
    }
    const auto cell = vtk::TakeSmartPointer(surface->GetPolys()->NewIterator());
    for (cell->GoToFirstCell(); !cell->IsDoneWithTraversal(); cell->GoToNextCell()) {
        vtkIdType size = 0;
        const vtkIdType* ids = nullptr;
        cell->GetCurrentCell(size, ids);
        mesh.triangles.push_back({static_cast<std::uint32_t>(ids[0]), static_cast<std::uint32_t>(ids[1]),
                                  static_cast<std::uint32_t>(ids[2])});
    }
    return mesh;
}

template <class Work>
auto timed(double& milliseconds, const Work& work) {
    const auto start = std::chrono::steady_clock::now();
    auto result = work();
    milliseconds =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    return result;
}

Contender vtk_contender(const VolumeView& volume, double isovalue) {
    if (volume.type != SampleType::int16) throw InputError("the models must have int16 samples");
    const Geometry& g = volume.geometry;
    vtkNew<vtkShortArray> samples;
    samples->SetArray(const_cast<short*>(static_cast<const short*>(volume.data)), g.sample_count(), 1);
    const auto image = vtkSmartPointer<vtkImageData>::New();
    image->SetDimensions(static_cast<int>(g.dims[0]), static_cast<int>(g.dims[1]),
                         static_cast<int>(g.dims[2]));
    image->SetSpacing(g.spacing.data());
    image->GetPointData()->SetScalars(samples);
    return {"vtkMarchingCubes, normals", [=](double& milliseconds) {
                vtkNew<vtkMarchingCubes> filter;
                filter->SetInputData(image);
                filter->SetValue(0, isovalue);
                filter->ComputeNormalsOn();
                filter->ComputeGradientsOff();
                filter->ComputeScalarsOff();
                timed(milliseconds, [&] {
                    filter->Update();
                    return true;
                });
                return to_mesh(filter->GetOutput(), volume);
            }};
}

}  // namespace

std::vector<Contender> make_contenders(const VolumeView& volume, double isovalue) {
    const auto classic = [=] { return extract_isosurface_classic(volume, isovalue); };
    const auto marrow = [=](bool normals, double snap = 0) {
        return extract_isosurface(volume, isovalue, {.normals = normals, .snap = snap, .threads = 1});
    };
    return {
        {"classic", [=](double& ms) { return timed(ms, classic); }},
        {"classic + welding", [=](double& ms) { return timed(ms, [&] { return weld(classic()); }); }},
        vtk_contender(volume, isovalue),
        {"Marrow", [=](double& ms) { return timed(ms, [&] { return marrow(false); }); }},
        {"Marrow, normals", [=](double& ms) { return timed(ms, [&] { return marrow(true); }); }},
        {"Marrow, snap 0.3", [=](double& ms) { return timed(ms, [&] { return marrow(false, 0.3); }); }},
    };
}

}  // namespace marrow::paper
