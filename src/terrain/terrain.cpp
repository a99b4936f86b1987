// Extracts terrain in strips of blocks.
#include <marrow/terrain.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <marrow/error.h>

#include "base/parallel.h"
#include "base/progress.h"
#include "ground.h"
#include "height_error.h"
#include "joined_mesh.h"
#include "raster.h"

namespace marrow {

using namespace internal::terrain;

namespace {

constexpr std::int64_t kBlock = 64;  // side of a block, in columns or rows

void check(const TerrainOptions& o) {
    if (o.cell && (!(*o.cell > 0) || !std::isfinite(*o.cell)))
        throw InputError("options.cell must be a positive number of metres");
    if (!(o.exaggerate > 0) || !std::isfinite(o.exaggerate))
        throw InputError("options.exaggerate must be a positive number");
    if (o.base && (!(*o.base > 0) || !std::isfinite(*o.base)))
        throw InputError("options.base must be a positive number of mm");
    if (o.size && (!(*o.size > 0) || !std::isfinite(*o.size)))
        throw InputError("options.size must be a positive number of mm");
}

// Counts the work that is done, and reports progress.
class Work {
  public:
    explicit Work(const Progress& progress) : progress_(progress) {}

    void advance(double fraction) {
        done_ = fraction;
        internal::report_progress(progress_, done_);
    }
    /// Reports the same progress again, so that the work can be cancelled in between.
    bool continues() const { return !progress_ || progress_(done_); }

  private:
    const Progress& progress_;
    double done_ = 0;
};

constexpr double kRangeWork = 0.1;  // share of the progress for find_range

// The range of columns and rows with ground.
struct Extent {
    double west = std::numeric_limits<double>::infinity(), east = -west, south = west, north = -west;

    void add(double from_column, double to_column, double from_row, double to_row) {
        west = std::min(west, from_column);
        east = std::max(east, to_column);
        south = std::min(south, from_row);
        north = std::max(north, to_row);
    }
};

// Finds the lowest and highest height, strip by strip, and the extent of the ground.
Extent find_range(const Raster& raster, bool closed, TerrainInfo& info, Work& work) {
    Extent extent;
    info.lowest = std::numeric_limits<double>::infinity();
    info.highest = -info.lowest;
    const std::int64_t width = raster.columns(), last_column = width - 1, last_row = raster.rows() - 1;
    // The first row is the last row of the strip before.
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

// Programs mark samples without a height by -9999, -32768 (which is -9988 m in feet) or far lower values.
// Only in a few trenches of the oceans is ground as deep.
constexpr double kMark = -9900;
constexpr const char* kNameMark =
    "if such a value marks samples without a height, name it (gdal_translate -a_nodata VALUE)";

// The lowest layer is a golden section below the lowest ground. So heights with regular steps are rarely
// exactly at a layer, where points would coincide.
Grid make_grid(const Raster& raster, const TerrainOptions& options, const TerrainInfo& info) {
    const double lowest = info.lowest * options.exaggerate, highest = info.highest * options.exaggerate;
    if (!(std::max(-lowest, highest) / info.cell[2] <= kMostHeight))
        throw InputError(
            fmt::format("heights from {:g} to {:g} m are too large for samples {:g} m apart: {}, else give a "
                        "larger options.cell{}",
                        info.lowest, info.highest, info.cell[2], kNameMark,
                        options.exaggerate > 1 ? " or a smaller options.exaggerate" : ""));
    double below = 0.381966 * info.cell[2];
    Grid grid;
    grid.columns = raster.columns();
    grid.rows = raster.rows();
    grid.layer = info.cell[2];
    if (options.base) {
        grid.closed = true;
        grid.bottom = options.first_level != nullptr ? options.first_level->zero * options.exaggerate
                                                     : lowest - *options.base / info.mm_per_metre;
        below = std::min(below, (lowest - grid.bottom) / 2);
        if (!(below > 0))
            throw OptionError(
                fmt::format("the lowest ground, {:g} m, is not above the bottom of the block, {:g} "
                            "m: give a larger options.base",
                            info.lowest, grid.bottom / options.exaggerate));
    }
    grid.lowest_layer = lowest - below;
    if (grid.columns > kMostColumns || grid.rows > kMostColumns ||
        (highest - lowest) / grid.layer > kMostLayers) {
        const std::string unit_hint =
            raster.has_coordinate_system()
                ? ""
                : "the raster does not name its coordinate system; if its coordinates are degrees, name it "
                  "(in a .prj file, or by gdal_translate -a_srs EPSG:4326), else ";
        throw LimitError(fmt::format(
            "the terrain needs {} x {} samples in {:.0f} layers, and at most {} layers are possible: {}"
            "give a larger options.cell{}",
            grid.columns, grid.rows, (highest - lowest) / grid.layer, kMostLayers, unit_hint,
            options.exaggerate > 1 ? " or a smaller options.exaggerate" : ""));
    }
    return grid;
}

// Reads strips of exaggerated heights. A strip begins with the last row of the strip before.
class Heights {
  public:
    Heights(const Raster& raster, double exaggerate) : raster_(raster), exaggerate_(exaggerate) {}

    Strip rows(const Grid& grid, std::int64_t south, std::int64_t north) {
        south = std::max<std::int64_t>(south, 0);
        north = std::min(north, grid.rows - 1);
        const auto width = static_cast<std::size_t>(grid.columns);
        // If GDAL resamples, reading a row twice may give different bits, and adjacent blocks would not
        // match.
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

Mesh extract(const Raster& raster, const Raster& reference, const TerrainOptions& options, TerrainInfo& info,
             Work& work) {
    const Grid grid = make_grid(raster, options, info);
    // A closed block has a ring of air around the raster.
    const std::int64_t ring = grid.closed ? 1 : 0;
    const std::int64_t first_column = -ring, last_column = grid.columns - 1 + ring;
    const std::int64_t first_row = -ring, last_row = grid.rows - 1 + ring;

    const std::array<double, 2> centre = raster.centre();
    JoinedMesh joined(grid, info, {centre[0] - info.centre[0], centre[1] - info.centre[1]});
    Heights heights(raster, options.exaggerate);
    HeightError error(reference);
    double measured_to = -std::numeric_limits<double>::infinity();
    for (std::int64_t south = first_row; south < last_row; south += kBlock) {
        const std::int64_t north = std::min(south + kBlock, last_row);
        const Strip strip = heights.rows(grid, south, north);
        std::vector<BlockSurface> blocks(
            static_cast<std::size_t>((last_column - first_column + kBlock - 1) / kBlock));
        internal::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
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
    info.zero = grid.closed ? grid.bottom / options.exaggerate : 0;
    info.rms_error = error.rms();
    info.max_error = error.max();
    joined.add_normals();
    return std::move(joined.mesh());
}

}  // namespace

Mesh extract_terrain(const std::filesystem::path& path, const TerrainOptions& options, TerrainInfo* result) {
    check(options);
    Work work(options.progress);
    const auto should_continue = [&] { return work.continues(); };
    const Raster raster(path, options.cell, should_continue);
    if (raster.columns() < 2 || raster.rows() < 2)
        throw InputError(fmt::format("'{}': has {} x {} samples, but a terrain needs at least 2 x 2",
                                     path.string(), raster.columns(), raster.rows()));
    if (static_cast<double>(raster.columns()) * static_cast<double>(raster.rows()) > kMostSamples)
        throw LimitError(
            fmt::format("'{}': has {} x {} samples, but a surface has at most 2^32 - 1 points: give a larger "
                        "options.cell",
                        path.string(), raster.columns(), raster.rows()));
    TerrainInfo info;
    info.format = raster.format();
    info.georeferenced = raster.georeferenced();
    info.projection = raster.projection();
    info.warnings = raster.warnings();
    info.samples = {raster.columns(), raster.rows()};
    const double upwards = options.cell.value_or(std::min(raster.east_step(), raster.north_step()));
    info.cell = {raster.east_step(), raster.north_step(), upwards};
    info.centre = options.first_level != nullptr ? options.first_level->centre : raster.centre();
    const Extent ground = find_range(raster, options.base.has_value(), info, work);
    if (info.lowest > info.highest) throw InputError(fmt::format("'{}': has no known height", path.string()));
    if (info.lowest <= kMark)
        info.warnings.push_back(fmt::format("the lowest height is {:g} m: {}", info.lowest, kNameMark));

    const double length =
        std::max((ground.east - ground.west) * info.cell[0], (ground.north - ground.south) * info.cell[1]);
    if (!(length > 0)) {  // no four adjacent samples with heights
        if (result != nullptr) *result = std::move(info);
        return {};
    }
    if (options.first_level != nullptr)
        info.mm_per_metre = options.first_level->mm_per_metre;
    else if (options.size)
        info.mm_per_metre = *options.size / length;
    if (options.base && options.first_level == nullptr &&
        *options.base > kMostTerrainBase * length * info.mm_per_metre)
        throw OptionError(fmt::format("options.base must be at most {:g} times the model's length of {:g} mm",
                                      kMostTerrainBase, length * info.mm_per_metre));

    // The raster at its own resolution.
    const Raster reference(path, raster.georeferenced() ? std::optional<double>() : options.cell,
                           should_continue);
    Mesh mesh;
    internal::with_threads(options.threads, [&] { mesh = extract(raster, reference, options, info, work); });
    if (result != nullptr) *result = std::move(info);
    return mesh;
}

std::optional<int> most_terrain_levels(const std::filesystem::path& path, std::optional<double> cell) {
    const Raster raster(path, cell);
    if (!raster.georeferenced()) return {};
    int levels = 1;
    const double first = cell.value_or(std::min(raster.east_step(), raster.north_step()));
    for (double next = 2 * first;; next *= 2, ++levels) {
        try {
            const Raster coarser(path, next);
        } catch (const InputError&) {  // fewer than 2 x 2 samples
            return levels;
        }
    }
}

}  // namespace marrow
