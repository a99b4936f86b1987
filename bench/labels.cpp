// marrow-bench-labels: compares extracting all labels in one pass with one extraction per label, in one
// process.
#include <fmt/core.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <vtkDiscreteFlyingEdges3D.h>
#include <vtkPolyData.h>
#include <vtkPolyDataNormals.h>
#include <vtkWindowedSincPolyDataFilter.h>

#include <CLI/CLI.hpp>

#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/labels.h>
#include <marrow/scan_io.h>
#include <marrow/smooth.h>

#include "timing.h"
#include "vtk_image.h"

namespace marrow::bench {
namespace {

// The map with only the labels that have the largest surfaces, as 16-bit samples.
Volume with_labels(const Volume& map, std::size_t most, std::vector<std::int64_t>& labels) {
    std::vector<LabelSurface> surfaces = extract_labels(map, {.relax = 0, .normals = false});
    std::sort(surfaces.begin(), surfaces.end(),
              [](const auto& a, const auto& b) { return a.mesh.points.size() > b.mesh.points.size(); });
    if (surfaces.size() > most) surfaces.resize(most);
    std::vector<bool> kept(65536, false);
    for (const LabelSurface& s : surfaces) {
        if (s.label < 0 || s.label > 65535) throw InputError("labels must be from 0 to 65535");
        labels.push_back(s.label);
        kept[static_cast<std::size_t>(s.label)] = true;
    }
    Volume result(map.geometry(), SampleType::uint16);
    visit_sample_type(map.type(), [&](auto type) {
        for (std::int64_t i = 0; i < map.geometry().sample_count(); ++i) {
            const auto label = static_cast<std::size_t>(map.samples<decltype(type)>()[i]);
            result.samples<std::uint16_t>()[i] =
                static_cast<std::uint16_t>(label < kept.size() && kept[label] ? label : 0);
        }
    });
    return result;
}

// Each of the following functions holds the surfaces of all labels in memory at its end.

std::size_t extract_all_at_once(const Volume& map, const LabelOptions& options) {
    std::size_t triangles = 0;
    for (const LabelSurface& s : extract_labels(map, options)) triangles += s.mesh.triangles.size();
    return triangles;
}

std::size_t extract_each(const Volume& map, const std::vector<std::int64_t>& labels, bool smoothed) {
    const std::int64_t samples = map.geometry().sample_count();
    Volume mask(map.geometry(), SampleType::uint8);
    std::vector<Mesh> meshes;
    std::size_t triangles = 0;
    for (const std::int64_t label : labels) {
        tbb::parallel_for(tbb::blocked_range<std::int64_t>(0, samples, 1 << 16), [&](const auto& range) {
            const auto wanted = static_cast<std::uint16_t>(label);
            for (std::int64_t i = range.begin(); i < range.end(); ++i)
                mask.samples<std::uint8_t>()[i] = map.samples<std::uint16_t>()[i] == wanted;
        });
        meshes.push_back(extract_isosurface(mask, 0.5, {.normals = smoothed, .closed = true}));
        if (smoothed) meshes.back() = smooth(meshes.back());
        triangles += meshes.back().triangles.size();
    }
    return triangles;
}

std::size_t run_flying_edges(vtkImageData* image, const std::vector<std::int64_t>& labels, bool smoothed) {
    std::vector<vtkSmartPointer<vtkPolyData>> meshes;
    std::size_t triangles = 0;
    for (const std::int64_t label : labels) {
        vtkNew<vtkDiscreteFlyingEdges3D> filter;
        filter->SetInputData(image);
        filter->SetValue(0, static_cast<double>(label));
        filter->ComputeNormalsOff();
        filter->ComputeGradientsOff();
        filter->ComputeScalarsOff();
        filter->Update();
        meshes.emplace_back(filter->GetOutput());
        if (smoothed) {
            vtkNew<vtkWindowedSincPolyDataFilter> sinc;
            sinc->SetInputData(meshes.back());
            vtkNew<vtkPolyDataNormals> with_normals;
            with_normals->SetInputConnection(sinc->GetOutputPort());
            with_normals->SplittingOff();
            with_normals->ConsistencyOff();
            with_normals->Update();
            meshes.back() = with_normals->GetOutput();
        }
        triangles += static_cast<std::size_t>(meshes.back()->GetNumberOfPolys());
    }
    return triangles;
}

void run(const std::string& input, std::size_t most, int rounds, int threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    std::vector<std::int64_t> labels;
    const Volume map = with_labels(read_scan(input), most, labels);
    const auto image = vtk_image(map);
    const Method plain[] = {
        {"all at once", [&] { return extract_all_at_once(map, {.relax = 0, .normals = false}); }},
        {"one extraction per label", [&] { return extract_each(map, labels, false); }},
        {"vtkDiscreteFlyingEdges3D", [&] { return run_flying_edges(image, labels, false); }},
    };
    const Method smoothed[] = {
        {"all at once, relaxed, with normals", [&] { return extract_all_at_once(map, {}); }},
        {"one extraction per label, smooth()", [&] { return extract_each(map, labels, true); }},
        {"vtkDiscreteFlyingEdges3D, windowed sinc, normals",
         [&] { return run_flying_edges(image, labels, true); }},
    };
    const auto& dims = map.geometry().dims;
    fmt::print("{} labels of {} x {} x {} samples, {} threads\n", labels.size(), dims[0], dims[1], dims[2],
               threads);
    compare(plain, rounds);
    compare(smoothed, rounds);
}

}  // namespace
}  // namespace marrow::bench

int main(int argc, char** argv) {
    CLI::App app(
        "Compares extract_labels with one extraction per label, without and with smoothing.\n"
        "ratio: wall and processor time relative to all labels at once");
    std::string input;
    std::size_t labels = 20;
    int rounds = 5, threads = 1;
    app.add_option("INPUT", input, "a label map")->required();
    app.add_option("--labels", labels, "number of labels; those with the largest surfaces")
        ->capture_default_str();
    app.add_option("--rounds", rounds)->capture_default_str()->check(CLI::PositiveNumber);
    app.add_option("--threads", threads)->capture_default_str()->check(CLI::PositiveNumber);
    CLI11_PARSE(app, argc, argv);
    try {
        marrow::bench::run(input, labels, rounds, threads);
        return 0;
    } catch (const std::exception& error) {
        fmt::print(stderr, "marrow-bench-labels: {}\n", error.what());
        return 3;
    }
}
