#include <marrow/terrain.h>

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include <fmt/format.h>

#include <marrow/error.h>

#include "base/progress.h"
#include "ground.h"
#include "height_error.h"
#include "raster.h"

namespace marrow {

using namespace terrain;

namespace {

constexpr std::int64_t kBlock = 64;  // cells a side, in the plan

void check(const TerrainOptions& o) {
    if (!(o.cell >= 0) || !std::isfinite(o.cell))
        throw InputError("terrain: the cell must be a positive number of metres");
    if (!(o.exaggerate > 0) || !std::isfinite(o.exaggerate))
        throw InputError("terrain: heights can be exaggerated by a positive number");
    if (o.base && (!(*o.base > 0) || !std::isfinite(*o.base)))
        throw InputError("terrain: the base must be a positive number of mm");
    if (o.size && (!(*o.size > 0) || !std::isfinite(*o.size)))
        throw InputError("terrain: the size must be a positive number of mm");
}

// How much of the work is done, reported so that it can be stopped.
class Work {
  public:
    explicit Work(const Progress& progress) : progress_(progress) {}

    void advance(double fraction) {
        done_ = fraction;
        internal::report_progress(progress_, done_);
    }
    bool goes_on() const { return !progress_ || progress_(done_); }

  private:
    const Progress& progress_;
    double done_ = 0;
};

constexpr double kRangeWork = 0.1;  // the part of the work that finding the range is

// Columns and rows from the first to the last one where there is ground.
struct Extent {
    double west = std::numeric_limits<double>::infinity(), east = -west, south = west, north = -west;

    void add(double from_column, double to_column, double from_row, double to_row) {
        west = std::min(west, from_column);
        east = std::max(east, to_column);
        south = std::min(south, from_row);
        north = std::max(north, to_row);
    }
};

// The lowest and highest height, strip by strip, and where the ground ends.
Extent find_range(const Raster& raster, bool closed, TerrainInfo& info, Work& work) {
    Extent extent;
    info.lowest = std::numeric_limits<double>::infinity();
    info.highest = -info.lowest;
    const std::int64_t width = raster.columns(), last_column = width - 1, last_row = raster.rows() - 1;
    // The row before a strip comes first.
    std::vector<double> heights(static_cast<std::size_t>(width * (kBlock + 1)),
                                std::numeric_limits<double>::quiet_NaN());
    const auto known = [&](std::int64_t column, std::int64_t row) {
        return !std::isnan(heights[static_cast<std::size_t>(row * width + column)]);
    };
    for (std::int64_t first = 0; first < raster.rows(); first += kBlock) {
        const std::int64_t count = std::min(kBlock, raster.rows() - first);
        raster.read(first, count, heights.data() + width);
        for (std::int64_t row = 1; row <= count; ++row) {
            const std::int64_t j = first + row - 1;
            for (std::int64_t i = 0; i < width; ++i) {
                const double h = heights[static_cast<std::size_t>(row * width + i)];
                info.unknown_samples += std::isnan(h);
                info.lowest = std::fmin(info.lowest, h);
                info.highest = std::fmax(info.highest, h);
                if (closed && known(i, row)) {
                    const auto x = static_cast<double>(i), y = static_cast<double>(j);
                    extent.add(std::max(x - 0.5, 0.0), std::min(x + 0.5, static_cast<double>(last_column)),
                               std::max(y - 0.5, 0.0), std::min(y + 0.5, static_cast<double>(last_row)));
                } else if (!closed && i > 0 && known(i, row) && known(i - 1, row) && known(i, row - 1) &&
                           known(i - 1, row - 1)) {
                    const auto x = static_cast<double>(i), y = static_cast<double>(j);
                    extent.add(x - 1, x, y - 1, y);
                }
            }
        }
        std::copy_n(heights.end() - width, width, heights.begin());
        work.advance(kRangeWork * static_cast<double>(first + count) / static_cast<double>(raster.rows()));
    }
    return extent;
}

// Layers lie a golden section off the lowest ground: heights that are whole multiples of something rarely meet
// one, where points would coincide.
Grid make_grid(const Raster& raster, const TerrainOptions& options, const TerrainInfo& info) {
    const double lowest = info.lowest * options.exaggerate, highest = info.highest * options.exaggerate;
    double below = 0.381966 * info.cell[2];
    Grid grid;
    grid.columns = raster.columns();
    grid.rows = raster.rows();
    grid.layer = info.cell[2];
    if (options.base) {
        const double base = *options.base / info.mm_per_metre;
        below = std::min(below, base / 2);
        grid.closed = true;
        grid.bottom = lowest - base;
    }
    grid.lowest_layer = lowest - below;
    if (grid.columns > kMostColumns || grid.rows > kMostColumns ||
        (highest - lowest) / grid.layer > kMostLayers) {
        const std::string untold =
            raster.names_coordinates()
                ? ""
                : fmt::format(
                      "the raster does not name its coordinates, so {:.4g} between its samples was "
                      "taken for metres; where they are degrees, name them (a .prj file beside it, or "
                      "gdal_translate -a_srs EPSG:4326), else ",
                      raster.east_step());
        throw LimitError(
            fmt::format("the terrain needs {} x {} samples in {:.0f} layers and at most {} layers can be: {}"
                        "give a larger --cell",
                        grid.columns, grid.rows, (highest - lowest) / grid.layer, kMostLayers, untold));
    }
    return grid;
}

// The mesh that the blocks' surfaces are joined to.
class Joined {
  public:
    Joined(const Grid& grid, const TerrainInfo& info) : grid_(grid), info_(info) {}

    void add(const BlockSurface& block) {
        number_.assign(block.points.size(), kNone);
        for (const Triangle& t : block.triangles) {
            Triangle joined;
            for (std::size_t c = 0; c < 3; ++c) joined[c] = number_of(block, t[c]);
            // Where the ground's border turns a corner, edges that end in one sample take a triangle's width.
            if (joined[0] != joined[1] && joined[1] != joined[2] && joined[2] != joined[0])
                mesh_.triangles.push_back(joined);
        }
    }

    /// Easting, northing and height of the corners of the triangles from one on, as they are in the mesh.
    std::vector<Vec3d> corners_from(std::size_t first, double exaggerate) const {
        std::vector<Vec3d> corners;
        for (std::size_t t = first; t < mesh_.triangles.size(); ++t) {
            for (const std::uint32_t p : mesh_.triangles[t]) {
                const Vec3f& at = mesh_.points[p];
                corners.push_back({at[0] / info_.mm_per_metre + info_.centre[0],
                                   at[1] / info_.mm_per_metre + info_.centre[1],
                                   (at[2] / info_.mm_per_metre + zero()) / exaggerate});
            }
        }
        return corners;
    }

    Mesh& mesh() { return mesh_; }

  private:
    static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

    double zero() const { return grid_.closed ? grid_.bottom : 0; }

    std::uint32_t number_of(const BlockSurface& block, std::uint32_t point) {
        std::uint32_t& number = number_[point];
        if (number != kNone) return number;
        const std::uint64_t edge = block.shared[point];
        if (edge == BlockSurface::kOwn) return number = append(block.points[point]);
        const auto [at, added] = on_edge_.try_emplace(edge, kNone);
        if (added) at->second = append(block.points[point]);
        return number = at->second;
    }

    std::uint32_t append(const Vec3d& p) {
        if (mesh_.points.size() >= kNone)
            throw LimitError("the terrain has more than 2^32 - 1 points: give a larger --cell");
        const double scale = info_.mm_per_metre;
        const auto plan = [&](double sample, std::int64_t samples, double step) {
            return static_cast<float>((sample - static_cast<double>(samples - 1) / 2) * step * scale);
        };
        mesh_.points.push_back({plan(p[0], grid_.columns, info_.cell[0]),
                                plan(p[1], grid_.rows, info_.cell[1]),
                                static_cast<float>((p[2] - zero()) * scale)});
        return static_cast<std::uint32_t>(mesh_.points.size() - 1);
    }

    const Grid& grid_;
    const TerrainInfo& info_;
    Mesh mesh_;
    std::vector<std::uint32_t> number_;  // in the mesh, of each point of a block
    std::unordered_map<std::uint64_t, std::uint32_t> on_edge_;
};

// Heights of rows [south, north], exaggerated, where the first ones may be those that the last strip ended with.
class Heights {
  public:
    Heights(const Raster& raster, double exaggerate) : raster_(raster), exaggerate_(exaggerate) {}

    Strip rows(const Grid& grid, std::int64_t south, std::int64_t north) {
        south = std::max<std::int64_t>(south, 0);
        north = std::min(north, grid.rows - 1);
        const auto width = static_cast<std::size_t>(grid.columns);
        // Reading a border row twice could give other bits where GDAL resamples; then blocks would not fit.
        const std::size_t kept = south <= last_ ? static_cast<std::size_t>(last_ - south + 1) * width : 0;
        heights_.erase(heights_.begin(), heights_.end() - static_cast<std::ptrdiff_t>(kept));
        const std::int64_t first_new = std::max(south, last_ + 1);
        if (first_new <= north) {
            heights_.resize(kept + static_cast<std::size_t>(north - first_new + 1) * width);
            raster_.read(first_new, north - first_new + 1, heights_.data() + kept);
            for (std::size_t i = kept; i < heights_.size(); ++i) heights_[i] *= exaggerate_;
            last_ = north;
        }
        return {grid, south, heights_};
    }

  private:
    const Raster& raster_;
    const double exaggerate_;
    std::vector<double> heights_;
    std::int64_t last_ = -1;  // row
};

// A unit normal for each point: that of the triangles round it, by area.
void add_normals(Mesh& mesh) {
    mesh.normals.assign(mesh.points.size(), {0, 0, 0});
    for (const Triangle& t : mesh.triangles) {
        const Vec3f &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
        const Vec3f u{b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
        for (const std::uint32_t p : t) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const std::size_t y = (axis + 1) % 3, z = (axis + 2) % 3;
                mesh.normals[p][axis] += u[y] * v[z] - u[z] * v[y];
            }
        }
    }
    for (Vec3f& n : mesh.normals) {
        const double length = std::hypot(double{n[0]}, double{n[1]}, double{n[2]});
        if (!(length > 0))
            n = {0, 0, 1};
        else
            for (float& x : n) x = static_cast<float>(x / length);
    }
}

Mesh extract(const Raster& raster, const Raster& reference, const TerrainOptions& options, TerrainInfo& info,
             Work& work) {
    const Grid grid = make_grid(raster, options, info);
    // A closed block has a ring of air round the raster.
    const std::int64_t ring = grid.closed ? 1 : 0;
    const std::int64_t first_column = -ring, last_column = grid.columns - 1 + ring;
    const std::int64_t first_row = -ring, last_row = grid.rows - 1 + ring;

    Joined joined(grid, info);
    Heights heights(raster, options.exaggerate);
    HeightError error(reference);
    double measured_to = -std::numeric_limits<double>::infinity();
    for (std::int64_t south = first_row; south < last_row; south += kBlock) {
        const std::int64_t north = std::min(south + kBlock, last_row);
        const Strip strip = heights.rows(grid, south, north);
        std::vector<BlockSurface> blocks(
            static_cast<std::size_t>((last_column - first_column + kBlock - 1) / kBlock));
        tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
            const std::int64_t west = first_column + static_cast<std::int64_t>(b) * kBlock;
            blocks[b] = extract_block(strip, {west, std::min(west + kBlock, last_column), south, north});
        });
        const std::size_t first_triangle = joined.mesh().triangles.size();
        for (const BlockSurface& block : blocks) joined.add(block);

        const double north_end = north == last_row
                                     ? std::numeric_limits<double>::infinity()
                                     : raster.south() + static_cast<double>(north) * info.cell[1];
        error.add_strip(measured_to, north_end, joined.corners_from(first_triangle, options.exaggerate));
        measured_to = north_end;
        work.advance(kRangeWork + (1 - kRangeWork) * static_cast<double>(north - first_row) /
                                      static_cast<double>(last_row - first_row));
    }
    info.rms_error = error.rms();
    info.max_error = error.max();
    add_normals(joined.mesh());
    return std::move(joined.mesh());
}

}  // namespace

Mesh extract_terrain(const std::filesystem::path& path, const TerrainOptions& options, TerrainInfo* result) {
    check(options);
    Work work(options.progress);
    const auto go_on = [&] { return work.goes_on(); };
    const Raster raster(path, options.cell, go_on);
    if (raster.columns() < 2 || raster.rows() < 2)
        throw InputError(fmt::format("{}: a terrain needs at least 2 x 2 samples and there are {} x {}",
                                     path.string(), raster.columns(), raster.rows()));
    if (static_cast<double>(raster.columns()) * static_cast<double>(raster.rows()) > kMostSamples)
        throw LimitError(
            fmt::format("{}: has {} x {} samples, and a surface has 2^32 - 1 points at most: give "
                        "a larger --cell",
                        path.string(), raster.columns(), raster.rows()));
    TerrainInfo info;
    info.format = raster.format();
    info.georeferenced = raster.placed();
    info.projection = raster.projection();
    info.warnings = raster.warnings();
    info.samples = {raster.columns(), raster.rows()};
    const double upwards =
        options.cell > 0 ? options.cell : std::min(raster.east_step(), raster.north_step());
    info.cell = {raster.east_step(), raster.north_step(), upwards};
    const double width = static_cast<double>(raster.columns() - 1) * info.cell[0];
    const double height = static_cast<double>(raster.rows() - 1) * info.cell[1];
    info.centre = {raster.west() + width / 2, raster.south() + height / 2};
    const Extent ground = find_range(raster, options.base.has_value(), info, work);
    if (info.lowest > info.highest) throw InputError(fmt::format("{}: has no known height", path.string()));

    const double length =
        std::max((ground.east - ground.west) * info.cell[0], (ground.north - ground.south) * info.cell[1]);
    if (!(length > 0)) {  // no four known samples side by side
        if (result != nullptr) *result = std::move(info);
        return {};
    }
    if (options.size) info.mm_per_metre = *options.size / length;
    if (options.base && *options.base > kMostTerrainBase * length * info.mm_per_metre)
        throw InputError(
            fmt::format("a base of {:g} mm is more than {:g} times as thick as the model is long, {:g} mm",
                        *options.base, kMostTerrainBase, length * info.mm_per_metre));

    const Raster reference(path, raster.placed() ? 0 : options.cell, go_on);  // at its own resolution
    const auto most =
        static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
    const int threads = options.threads > 0 ? std::min(options.threads, most) : most;
    Mesh mesh =
        tbb::task_arena(threads).execute([&] { return extract(raster, reference, options, info, work); });
    if (result != nullptr) *result = std::move(info);
    return mesh;
}

std::optional<int> most_terrain_levels(const std::filesystem::path& path, double cell) {
    const Raster raster(path, cell);
    if (!raster.placed()) return {};
    int levels = 1;
    const double first = cell > 0 ? cell : std::min(raster.east_step(), raster.north_step());
    for (double next = 2 * first;; next *= 2, ++levels) {
        try {
            const Raster coarser(path, next);
        } catch (const InputError&) {  // less than 2 x 2 samples
            return levels;
        }
    }
}

}  // namespace marrow
