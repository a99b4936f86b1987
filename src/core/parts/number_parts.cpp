// Numbers the points and triangles of parts: the levels of the histogram pyramid above the parts.
#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <new>
#include <numeric>
#include <string>
#include <utility>

#include <marrow/buffer.h>
#include <marrow/parts.h>

#include "base/parallel.h"
#include "base/progress.h"
#include "core/volume/checks.h"
#include "core/volume/enlarged.h"
#include "core/volume/second_reading.h"
#include "part_passes.h"

namespace marrow {

using namespace internal;

namespace {

std::size_t size(std::int64_t n) {
    return static_cast<std::size_t>(n);
}

// The points on the edges that start at sample x of a row.
PointGroups points_at(const InsideBits& bits, std::size_t r, std::size_t x) {
    const auto inside = [&](std::size_t row, std::size_t at) {
        return bits.row(row)[at / 64] >> (at % 64) & 1;
    };
    const auto differs = [&](std::size_t row, std::size_t at) {
        return static_cast<std::uint32_t>(inside(r, x) ^ inside(row, at));
    };
    const auto ny = size(bits.ny);
    return {x < size(bits.cells_x) ? differs(r, x + 1) : 0, r % ny + 1 < ny ? differs(r + 1, x) : 0,
            r + ny < bits.rows() ? differs(r + ny, x) : 0, 0};
}

// The points inside the first cell of the row that `ambiguous` is at. \pre the row begins with a sample: the
// surface is not closed before it
std::uint32_t inner_points_at_start(const AmbiguousRows& ambiguous) {
    const AmbiguousCell& first = ambiguous.cells().front();
    return first.x == 0 ? first.topology.inner_points : 0;
}

// The points of the row that the part owns: those on edges that start at its samples, and those inside its
// cells. Those along y and z at the row's last sample may belong to the next part.
PointGroups owned_points(const PartPasses& passes, const PartExtent& extent, std::size_t r) {
    PointGroups points = passes.points_of_row(r);
    if (extent.owned(0) == extent.dims[0]) return points;
    const PointGroups last = points_at(passes.bits(), r, size(passes.bits().cells_x));
    for (std::size_t axis = 0; axis < 3; ++axis) points[axis] -= last[axis];
    return points;
}

// The numbers of the next point of each group, and of the next triangle, of every row between two cuts
// across z, and of the first slice after them.
class RowNumbers {
  public:
    RowNumbers(std::span<const PartCounts> parts, std::span<const PartCounts> next, const SurfaceSize& before)
        : parts_(parts),
          next_(next),
          ny_(parts.front().extent.whole[1]),
          topology_(parts.front().topology),
          groups_(point_group_count(topology_)) {
        find_range();
        const std::size_t rows = size(ny_ * (end_ - begin_ + (next_.empty() ? 0 : 1)));
        points_.assign(groups_ * rows, 0);
        triangles_.assign(rows, 0);
        std::int64_t x = 0;  // at which the next column must begin
        for_each_column([&](const Column& column) {
            check_coverage(column, x);
            x += column.all.front()->extent.owned(0);
            for (const PartCounts* counts : column.all) add(*counts);
        });
        if (x != parts.front().extent.whole[0]) throw_bad_cuts();
        std::uint64_t point = before.points, triangle = before.triangles;
        for (std::uint64_t& n : points_) point += std::exchange(n, point);
        for (std::uint64_t& n : triangles_) triangle += std::exchange(n, triangle);
        check_point_count(point);
    }

    // The numbers of all parts. They are found column by column: each begins where those at lower x end.
    std::vector<PartNumbers> number() {
        std::vector<PartNumbers> numbers(parts_.size());
        for_each_column([&](const Column& column) {
            for (const std::size_t p : column.parts) numbers[p] = numbers_of(parts_[p]);
            for (const PartCounts* counts : column.all) add(*counts);
        });
        return numbers;
    }

  private:
    // The parts that begin at the same x.
    struct Column {
        std::vector<std::size_t> parts;      // indices of those to number
        std::vector<const PartCounts*> all;  // those to number, and those that follow them
    };

    // Calls f(column) for each column in the order of x.
    template <class F>
    void for_each_column(const F& f) const {
        std::map<std::int64_t, Column> columns;
        for (std::size_t p = 0; p < parts_.size(); ++p) {
            Column& column = columns[parts_[p].extent.first[0]];
            column.parts.push_back(p);
            column.all.push_back(&parts_[p]);
        }
        for (const PartCounts& counts : next_) columns[counts.extent.first[0]].all.push_back(&counts);
        for (const auto& [x, column] : columns) f(column);
    }

    void find_range() {
        begin_ = std::numeric_limits<std::int64_t>::max();
        end_ = 0;
        for (const PartCounts& counts : parts_) {
            check(counts);
            begin_ = std::min(begin_, counts.extent.first[2]);
            end_ = std::max(end_, counts.extent.first[2] + counts.extent.owned(2));
        }
        for (const PartCounts& counts : next_) {
            check(counts);
            if (counts.extent.first[2] != end_)
                throw InputError("the next parts do not begin where the parts to number end");
        }
        if (next_.empty() && end_ != parts_.front().extent.whole[2])
            throw InputError("the counts of the next parts are missing, and the volume does not end here");
    }

    void check(const PartCounts& counts) const {
        const PartExtent& extent = counts.extent;
        if (extent.whole != parts_.front().extent.whole)
            throw InputError(
                "the parts are of different volumes, or only some are closed; extract all parts of one "
                "volume alike");
        if (counts.topology != topology_) throw_mixed_topology();
        for (std::size_t a = 0; a < 3; ++a) {
            const std::int64_t last = extent.whole[a] - extent.dims[a];  // place for the part's first sample
            if (extent.dims[a] < 1 || extent.first[a] < 0 || extent.first[a] > last)
                throw InputError("a part leaves the whole volume along axis " + std::to_string(a));
        }
        const std::size_t rows = size(extent.owned(1) * extent.owned(2));
        if (counts.points.size() != groups_ * rows || counts.triangles.size() != rows)
            throw InputError("the counts of a part do not have its number of rows");
    }

    // The slices of a part that are counted here: of parts after the second cut, the first one.
    std::int64_t slices_here(const PartExtent& extent) const {
        return std::min(extent.owned(2), end_ + (next_.empty() ? 0 : 1) - extent.first[2]);
    }

    // A column has every row once, from x on, and its parts have the same samples along x.
    void check_coverage(const Column& column, std::int64_t x) const {
        std::vector<char> covered(triangles_.size());
        std::size_t rows = 0;
        for (const PartCounts* counts : column.all) {
            const PartExtent& extent = counts->extent;
            if (extent.first[0] != x || extent.dims[0] != column.all.front()->extent.dims[0])
                throw_bad_cuts();
            for (std::int64_t z = 0; z < slices_here(extent); ++z) {
                for (std::int64_t y = 0; y < extent.owned(1); ++y, ++rows) {
                    if (std::exchange(covered[row_index(extent, y, z)], 1) != 0) throw_bad_cuts();
                }
            }
        }
        if (rows != covered.size()) throw_bad_cuts();
    }

    [[noreturn]] static void throw_bad_cuts() {
        throw InputError("the parts overlap, leave a gap, or are not cut by planes through the whole volume");
    }

    std::size_t row_index(const PartExtent& extent, std::int64_t y, std::int64_t z) const {
        return size((extent.first[2] + z - begin_) * ny_ + extent.first[1] + y);
    }

    void add(const PartCounts& counts) {
        const PartExtent& extent = counts.extent;
        std::size_t from = 0;
        for (std::int64_t z = 0; z < slices_here(extent); ++z) {
            for (std::int64_t y = 0; y < extent.owned(1); ++y, ++from) {
                const std::size_t row = row_index(extent, y, z);
                for (std::size_t group = 0; group < groups_; ++group)
                    points_[groups_ * row + group] += counts.points[groups_ * from + group];
                triangles_[row] += counts.triangles[from];
            }
        }
    }

    PartNumbers numbers_of(const PartCounts& counts) const {
        const PartExtent& extent = counts.extent;
        PartNumbers numbers{extent, {}, {}, topology_};
        for (const std::uint32_t n : counts.points) numbers.counts_hash = add_to_hash(numbers.counts_hash, n);
        for (const std::uint32_t n : counts.triangles)
            numbers.counts_hash = add_to_hash(numbers.counts_hash, n);
        numbers.points.reserve(groups_ * size(extent.dims[1] * extent.dims[2]));
        numbers.triangles.reserve(size(extent.dims[1] * extent.dims[2]));
        for (std::int64_t z = 0; z < extent.dims[2]; ++z) {
            for (std::int64_t y = 0; y < extent.dims[1]; ++y) {
                const std::size_t row = row_index(extent, y, z);
                for (std::size_t group = 0; group < groups_; ++group)
                    numbers.points.push_back(static_cast<std::uint32_t>(points_[groups_ * row + group]));
                numbers.triangles.push_back(triangles_[row]);
            }
        }
        return numbers;
    }

    const std::span<const PartCounts> parts_, next_;
    const std::int64_t ny_;
    const bool topology_;
    const std::size_t groups_;          // of points in each row
    std::int64_t begin_ = 0, end_ = 0;  // slices of the grid that the parts own
    Buffer<std::uint64_t> points_, triangles_;
};

// Lists runs, joining those that follow each other.
void append(std::vector<NumberedRun>& runs, const NumberedRun& run) {
    if (run.count == 0) return;
    if (!runs.empty()) {
        NumberedRun& last = runs.back();
        if (last.number + last.count == run.number && last.begin + last.count == run.begin) {
            last.count += run.count;
            return;
        }
    }
    runs.push_back(run);
}

// The cells that an extraction has before those of its part, along each axis. With them, all triangles around
// the points that the part owns are known. The part has their samples already, for normals; only the normals
// of the points that come with these cells are not right.
using CellsBefore = std::array<std::int64_t, 3>;

PartExtent with_cells_before(const PartExtent& part, const CellsBefore& before) {
    PartExtent extent = part;
    for (std::size_t a = 0; a < 3; ++a) {
        extent.first[a] -= before[a];
        extent.dims[a] += before[a];
    }
    return extent;
}

// Calls f(row of the passes, row of the part, y, z) for each row; y and z count in the part.
template <class F>
void for_each_row(const InsideBits& bits, const PartExtent& extent, const CellsBefore& before, const F& f) {
    for (std::size_t r = 0; r < bits.rows(); ++r) {
        const std::int64_t y = static_cast<std::int64_t>(r) % bits.ny - before[1];
        const std::int64_t z = static_cast<std::int64_t>(r) / bits.ny - before[2];
        f(r, size(z * extent.dims[1] + y), y, z);
    }
}

// Returns the hash of the counts of the points that the part owns.
std::uint64_t number_points(const PartPasses& passes, const PartNumbers& numbers, const CellsBefore& before,
                            NumberedPart& part) {
    const PartExtent& extent = numbers.extent;
    part.numbers.assign(part.mesh.points.size(), NumberedPart::kNoNumber);
    const std::size_t groups = point_group_count(numbers.topology);
    AmbiguousRows ambiguous(passes.ambiguous(), 0);
    std::size_t point = 0;
    std::uint64_t hash = 0;
    for_each_row(
        passes.bits(), extent, before, [&](std::size_t r, std::size_t row, std::int64_t y, std::int64_t z) {
            if (y < 0 || z < 0) {
                point += passes.rows().points[r];
                return;
            }
            const bool owns_row = y < extent.owned(1) && z < extent.owned(2);
            if (passes.rows().points[r] == 0) {
                for (std::size_t group = 0; owns_row && group < groups; ++group) hash = add_to_hash(hash, 0);
                return;
            }
            const PointGroups counts = passes.points_of_row(r), owned = owned_points(passes, extent, r);
            PointGroups skipped{};
            if (before[0] > 0) {
                skipped = points_at(passes.bits(), r, 0);
                if (ambiguous.reach(r)) skipped[kInner] = inner_points_at_start(ambiguous);
            }
            for (std::size_t group = 0; group < groups; ++group) {
                const std::uint32_t first = numbers.points[groups * row + group];
                const std::size_t begin = point + skipped[group];
                point += counts[group];
                std::iota(part.numbers.begin() + static_cast<std::ptrdiff_t>(begin),
                          part.numbers.begin() + static_cast<std::ptrdiff_t>(point), first);
                if (!owns_row) continue;
                const std::uint32_t count = owned[group] - skipped[group];
                append(part.points, {first, begin, count});
                hash = add_to_hash(hash, count);
            }
        });
    return hash;
}

// Adds the counts of the triangles to a hash.
std::uint64_t number_triangles(const PartPasses& passes, const PartNumbers& numbers,
                               const CellsBefore& before, NumberedPart& part, std::uint64_t hash) {
    const PartExtent& extent = numbers.extent;
    // The triangles of a cell before the part have a point that begins before it, and so has no number.
    const auto is_before = [&](const Triangle& t) {
        return std::any_of(t.begin(), t.end(),
                           [&](std::uint32_t p) { return part.numbers[p] == NumberedPart::kNoNumber; });
    };
    std::size_t triangle = 0;
    for_each_row(passes.bits(), extent, before,
                 [&](std::size_t r, std::size_t row, std::int64_t y, std::int64_t z) {
                     std::size_t begin = triangle;
                     triangle += passes.rows().triangles[r];
                     if (y < 0 || z < 0) return;
                     while (before[0] > 0 && begin < triangle && is_before(part.mesh.triangles[begin]))
                         ++begin;
                     append(part.triangles, {numbers.triangles[row], begin, triangle - begin});
                     if (y < extent.owned(1) && z < extent.owned(2))
                         hash = add_to_hash(hash, triangle - begin);
                 });
    return hash;
}

}  // namespace

SurfaceSize PartCounts::total() const {
    return {std::accumulate(points.begin(), points.end(), std::uint64_t{0}),
            std::accumulate(triangles.begin(), triangles.end(), std::uint64_t{0})};
}

PartCounts count_part(const VolumeView& part, const std::array<std::int64_t, 3>& whole, double isovalue,
                      const IsosurfaceOptions& given_options) {
    IsosurfaceOptions options = given_options;
    options.normals = false;  // which would need more samples
    PartCounts counts{extent_of(part, whole, options), {}, {}, options.topology};
    const double sample_isovalue = checked_isovalue(isovalue, part.rescale);
    const PartExtent& extent = counts.extent;
    const std::size_t rows = size(extent.owned(1) * extent.owned(2));
    const std::size_t groups = point_group_count(options.topology);
    try {
        counts.points.resize(groups * rows);
        counts.triangles.resize(rows);
        if (!has_cells(extent)) return counts;
        with_threads(options.threads, [&] {
            const PartPasses passes(part, extent, sample_isovalue, options);
            std::size_t to = 0;
            for (std::int64_t z = 0; z < extent.owned(2); ++z) {
                for (std::int64_t y = 0; y < extent.owned(1); ++y, ++to) {
                    const std::size_t r = passes.bits().row_index(y, z);
                    const PointGroups points = owned_points(passes, extent, r);
                    for (std::size_t group = 0; group < groups; ++group)
                        counts.points[groups * to + group] = points[group];
                    counts.triangles[to] = passes.rows().triangles[r];
                }
            }
        });
    } catch (const std::bad_alloc&) {
        throw_out_of_memory(part.geometry);
    }
    report_progress(options.progress, 1);
    return counts;
}

PartCounts first_slice(const PartCounts& counts) {
    PartExtent extent = counts.extent;
    extent.dims[2] = std::min<std::int64_t>(extent.dims[2], 2);  // of which it owns the first
    const std::size_t rows = size(extent.owned(1) * extent.owned(2));
    // As a copy that is cut would keep the memory of all slices.
    const auto first = [](const std::vector<std::uint32_t>& all, std::size_t n) {
        return std::vector<std::uint32_t>(all.begin(),
                                          all.begin() + static_cast<std::ptrdiff_t>(std::min(n, all.size())));
    };
    return {extent, first(counts.points, point_group_count(counts.topology) * rows),
            first(counts.triangles, rows), counts.topology};
}

std::vector<PartNumbers> number_parts(std::span<const PartCounts> parts, std::span<const PartCounts> next,
                                      const SurfaceSize& before) {
    if (parts.empty()) return {};
    try {
        return RowNumbers(parts, next, before).number();
    } catch (const std::bad_alloc&) {
        throw LimitError("there is not enough memory to number " + std::to_string(parts.size()) +
                         " parts; number fewer at a time, or make parts larger along x");
    }
}

NumberedPart extract_numbered_part(const VolumeView& part, const PartNumbers& numbers, double isovalue,
                                   const IsosurfaceOptions& options) {
    std::array<std::int64_t, 3> whole = numbers.extent.whole;
    for (std::int64_t& n : whole) n -= options.closed ? 2 : 0;
    const double sample_isovalue = checked_isovalue(isovalue, part.rescale);
    const PartExtent extent = extent_of(part, whole, options);
    const std::size_t rows = size(extent.dims[1] * extent.dims[2]);
    if (extent != numbers.extent || numbers.topology != options.topology ||
        numbers.points.size() != point_group_count(numbers.topology) * rows ||
        numbers.triangles.size() != rows)
        throw InputError("the numbers belong to another part, or to one with other options");
    NumberedPart result;
    if (!has_cells(extent)) return result;
    try {
        with_threads(options.threads, [&] {
            CellsBefore before{};
            for (std::size_t a = 0; options.normals && a < 3; ++a) before[a] = part.first[a] > 0 ? 1 : 0;
            const VolumeView view = enlarged(part, before, {});
            const PartPasses passes(view, with_cells_before(extent, before), sample_isovalue, options);
            result.mesh = passes.emit();
            const std::uint64_t hash = number_points(passes, numbers, before, result);
            if (number_triangles(passes, numbers, before, result, hash) != numbers.counts_hash)
                throw_samples_changed();
        });
    } catch (const std::bad_alloc&) {
        throw_out_of_memory(part.geometry);
    }
    return result;
}

}  // namespace marrow
