// Measures the surfaces at many isovalues: area and volume cell by cell, components from inside bits.
#include <marrow/isovalue_sweep.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <optional>

#include <marrow/isosurface.h>
#include <marrow/measure.h>

#include "base/parallel.h"
#include "cell_measures.h"
#include "core/marching_cubes/classify.h"
#include "core/volume/checks.h"
#include "core/volume/rows.h"
#include "surface_counter.h"

namespace marrow {

using namespace internal;

namespace {

// The isovalues as samples.
std::vector<double> checked_isovalues(const VolumeView& volume, std::span<const double> isovalues) {
    check_volume(volume);
    std::vector<double> samples;
    for (std::size_t i = 0; i < isovalues.size(); ++i) {
        const double sample = checked_isovalue(isovalues[i], volume.rescale);
        if (i > 0 && !(isovalues[i - 1] < isovalues[i]))
            throw InputError("the isovalues of a sweep must ascend");
        // Rounding can swap the samples of neighbouring numbers.
        samples.push_back(i > 0 ? std::max(sample, samples.back()) : sample);
    }
    return samples;
}

template <class T>
std::uint8_t level_of(T value, std::span<const double> isovalues) {
    if (!std::isfinite(static_cast<double>(value))) return 0;
    const auto above = std::upper_bound(isovalues.begin(), isovalues.end(), static_cast<double>(value));
    return static_cast<std::uint8_t>(above - isovalues.begin());
}

void find_levels(const VolumeView& volume, std::span<const double> isovalues, Levels& levels, Stage& stage) {
    const auto [nx, ny, nz] = volume.geometry.dims;
    visit_sample_type(volume.type, [&, nx = nx, ny = ny, nz = nz](auto sample) {
        using T = decltype(sample);
        const auto fill = [&](const auto& level) {
            parallel_for(std::int64_t{0}, nz, [&](std::int64_t z) {
                for (std::int64_t y = 0; y < ny; ++y) {
                    const T* from = row_of<T>(volume, y, z);
                    std::uint8_t* to = levels.bytes.data() + (z * ny + y) * levels.stride + 1;
                    for (std::int64_t x = 0; x < nx; ++x) to[x] = level(from[x]);
                }
                stage.step();
            });
        };
        if constexpr (sizeof(T) <= 2) {  // a table of all values is small and faster
            constexpr int kLowest = std::numeric_limits<T>::lowest();
            std::vector<std::uint8_t> table(std::size_t{1} << (8 * sizeof(T)));
            for (std::size_t i = 0; i < table.size(); ++i)
                table[i] = level_of(static_cast<int>(i) + kLowest, isovalues);
            fill([&](T value) { return table[static_cast<std::size_t>(value - kLowest)]; });
        } else {
            fill([&](T value) { return level_of(value, isovalues); });
        }
    });
}

// Measures area, volume and triangles in one pass over the cells.
void measure_cells(const VolumeView& volume, std::span<const double> isovalues,
                   std::span<SweepSample> samples, Levels& levels, Stage& stage) {
    find_levels(volume, isovalues, levels, stage);
    const IndexToPhysical to_physical(volume);
    const std::int64_t nz = volume.geometry.dims[2];
    // The sums of slices are added in order, so that the result does not depend on the threads.
    std::vector<CellMeasures> slices(static_cast<std::size_t>(nz + 1), CellMeasures(isovalues.size()));
    parallel_for(std::int64_t{-1}, nz, [&](std::int64_t z) {
        add_cells(volume, to_physical, levels, isovalues, z, slices[static_cast<std::size_t>(z + 1)]);
        stage.step();
    });
    for (std::size_t k = 0; k < isovalues.size(); ++k) {
        double z = 0;  // from the first slice of the surface, so that it is small
        for (const CellMeasures& slice : slices) {
            samples[k].area += slice.twice_area[k] / 2;
            samples[k].volume += (slice.six_volumes[k] + 3 * z * slice.facing_z[k]) / 6;
            samples[k].triangles += slice.triangles[k];
            if (samples[k].triangles > 0) ++z;
        }
    }
}

void count_components(const VolumeView& volume, std::span<const double> isovalues,
                      std::span<SweepSample> samples, Stage& stage) {
    struct Counting {
        explicit Counting(const std::array<std::int64_t, 3>& dims) : bits(dims, ClosedSides::all(true)) {}
        InsideBits bits;
        SurfaceCounter counter;
    };
    PerThread<std::optional<Counting>> counting_of_threads;
    parallel_for(std::size_t{0}, samples.size(), [&](std::size_t k) {
        std::optional<Counting>& own = counting_of_threads.local();
        if (!own) own.emplace(volume.geometry.dims);
        for (std::int64_t z = 0; z < own->bits.nz; ++z)
            classify_slice(volume, isovalues[k], z, own->bits, nullptr);
        samples[k].components = own->counter.count(own->bits);
        stage.step();
    });
}

// Cells alone do not tell the exact topology; the surface does.
void measure_surfaces(const VolumeView& volume, std::span<SweepSample> samples, const SweepOptions& options) {
    std::size_t k = 0;
    const auto surfaces = static_cast<double>(samples.size());
    const Progress within = [&](double fraction) {
        return !options.progress || options.progress((static_cast<double>(k) + 0.8 * fraction) / surfaces);
    };
    IsosurfaceExtractor extractor(
        volume,
        {.normals = false, .closed = true, .topology = true, .threads = options.threads, .progress = within});
    Mesh mesh;
    for (; k < samples.size(); ++k) {
        extractor.extract(samples[k].isovalue, mesh);
        const MeshMeasures found = measure(mesh, {.threads = options.threads});
        samples[k].volume = found.volume;
        samples[k].area = found.area;
        samples[k].components = found.components;
        samples[k].triangles = found.triangles;
        report_progress(options.progress, static_cast<double>(k + 1) / surfaces);
    }
}

// The cells give area, volume and triangles, and the samples the components.
void measure_samples(const VolumeView& volume, std::span<const double> isovalues,
                     std::span<SweepSample> samples, const SweepOptions& options) {
    const std::size_t groups = (isovalues.size() + Levels::kMost - 1) / Levels::kMost;
    const auto nz = static_cast<std::size_t>(volume.geometry.dims[2]);
    Stage cells(options.progress, 0, 0.6, groups * (2 * nz + 1));
    Levels levels(volume.geometry.dims);
    for (std::size_t first = 0; first < isovalues.size(); first += Levels::kMost) {
        const std::size_t size = std::min(Levels::kMost, isovalues.size() - first);
        measure_cells(volume, isovalues.subspan(first, size), samples.subspan(first, size), levels, cells);
    }
    Stage components(options.progress, 0.6, 1, samples.size());
    count_components(volume, isovalues, samples, components);
}

}  // namespace

std::vector<SweepSample> sweep_isovalues(const VolumeView& volume, std::span<const double> isovalues,
                                         const SweepOptions& options) {
    const std::vector<double> sample_isovalues = checked_isovalues(volume, isovalues);
    std::vector<SweepSample> samples(isovalues.size());
    for (std::size_t k = 0; k < isovalues.size(); ++k) samples[k].isovalue = isovalues[k];
    if (!has_cells(volume.geometry, true)) return samples;
    try {
        if (options.topology)
            measure_surfaces(volume, samples, options);
        else
            with_threads(options.threads,
                         [&] { measure_samples(volume, sample_isovalues, samples, options); });
    } catch (const std::bad_alloc&) {
        throw_out_of_memory(volume.geometry);
    }
    return samples;
}

double surface_shift(const SweepSample& a, const SweepSample& b) {
    const double area = (a.area + b.area) / 2;
    return area > 0 ? std::abs(a.volume - b.volume) / area : 0;
}

std::vector<Plateau> find_plateaus(std::span<const SweepSample> sweep, double spacing, double contrast) {
    constexpr double kFewestTriangles = 0.01;  // of the most in the sweep; fewer are noise
    const double width = contrast / 5;
    if (sweep.empty() || !(width > 0)) return {};
    std::int64_t most_triangles = 0;
    for (const SweepSample& s : sweep) most_triangles = std::max(most_triangles, s.triangles);
    const auto has_surface = [&](const SweepSample& s) {
        return s.triangles > 0 &&
               static_cast<double>(s.triangles) >= kFewestTriangles * static_cast<double>(most_triangles);
    };
    const auto hardly_moves = [&](const SweepSample& a, const SweepSample& b) {
        const double most = spacing / 2 * (b.isovalue - a.isovalue) / width;
        return has_surface(a) && has_surface(b) && surface_shift(a, b) < most;
    };
    std::vector<Plateau> plateaus;
    std::size_t first = 0;
    for (std::size_t i = 0; i < sweep.size(); ++i) {
        if (i + 1 < sweep.size() && hardly_moves(sweep[i], sweep[i + 1])) continue;
        if (sweep[i].isovalue - sweep[first].isovalue >= width) plateaus.push_back({first, i});
        first = i + 1;
    }
    return plateaus;
}

}  // namespace marrow
