// Finds ambiguous cells from the inside bits, and asks their samples.
#include "ambiguous_cells.h"

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "core/volume/rows.h"
#include "inner_points.h"
#include "row_bits-inl.h"

namespace marrow::internal {

namespace {

using namespace HWY_NAMESPACE;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// The samples of the cells of a row.
template <class T>
class CornerSamples {
  public:
    CornerSamples(const VolumeView& volume, std::int64_t y, std::int64_t z) : nx_(volume.geometry.dims[0]) {
        const auto [nx, ny, nz] = volume.geometry.dims;
        for (std::size_t r = 0; r < 4; ++r) {
            const std::int64_t row_y = y + static_cast<std::int64_t>(r & 1),
                               row_z = z + static_cast<std::int64_t>(r >> 1);
            const bool within = row_y >= 0 && row_y < ny && row_z >= 0 && row_z < nz;
            rows_[r] = within ? row_of<T>(volume, row_y, row_z) : nullptr;
            all_rows_ &= within;
        }
    }

    CellValues minus(double isovalue, std::int64_t x) const {
        CellValues values;
        if (HWY_LIKELY(all_rows_ && x >= 0 && x + 1 < nx_)) {
            for (std::size_t v = 0; v < 8; ++v)
                values[v] = difference(rows_[v >> 1][x + static_cast<std::int64_t>(v & 1)], isovalue);
            return values;
        }
        for (std::size_t v = 0; v < 8; ++v) {
            const std::int64_t at = x + static_cast<std::int64_t>(v & 1);
            const T* const row = rows_[v >> 1];
            values[v] = row != nullptr && at >= 0 && at < nx_ ? difference(row[at], isovalue) : kNan;
        }
        return values;
    }

    void prefetch(std::int64_t x) const {
        for (const T* row : rows_) {
            if (row != nullptr) hwy::Prefetch(row + x);
        }
    }

  private:
    // It has the right sign: a rounded difference is 0 only if the exact one is.
    static double difference(T sample, double isovalue) {
        const double result = static_cast<double>(sample) - isovalue;
        if constexpr (std::is_floating_point_v<T>) {
            if (HWY_UNLIKELY(!std::isfinite(result))) {
                constexpr double kMost = std::numeric_limits<double>::max();
                return std::isfinite(sample) ? std::clamp(result, -kMost, kMost) : kNan;
            }
        }
        return result;
    }

    const std::int64_t nx_;
    const T* rows_[4];
    bool all_rows_ = true;
};

// The cells with two antipodal corners that differ from the other six.
std::uint64_t have_antipodes(const CellBits& cells) {
    const auto& c = cells.corners;
    std::uint64_t result = 0;
    for (unsigned v = 0; v < 4; ++v) {
        std::uint64_t all = ~std::uint64_t{0}, some = 0;
        for (unsigned other = 0; other < 8; ++other) {
            if (other == v || other == 7 - v) continue;
            all &= c[other];
            some |= c[other];
        }
        result |= (c[v] & c[7 - v] & ~some) | (~(c[v] | c[7 - v]) & all);
    }
    return result;
}

// Of the cells that start in word w, those in which the samples may decide something.
std::uint64_t ambiguous_bits(const RowBits& row, std::size_t w, const CellBits& cells) {
    const CellVecs vecs(row, w);
    return (hn::GetLane(have_ambiguous_faces(vecs)) | have_antipodes(cells)) & row.valid(w);
}

std::uint8_t case_of(const CellBits& cells, unsigned bit) {
    unsigned cell_case = 0;
    for (unsigned v = 0; v < 8; ++v) cell_case |= static_cast<unsigned>(cells.corners[v] >> bit & 1) << v;
    return static_cast<std::uint8_t>(cell_case);
}

// A cell in which the samples may decide something.
struct Candidate {
    std::size_t row = 0;
    std::int64_t x = 0, y = 0, z = 0;  // of the first corner in the grid
    std::uint8_t cell_case = 0;
};

// Calls f for each candidate in the words of a row that are marked in its masks, in the order of x.
template <class F>
void for_each_candidate(const InsideBits& bits, const GridRow& row, const std::uint64_t* masks, std::size_t count,
                        const F& f) {
    const RowBits row_bits(bits, row);
    for_each_marked_word(masks, count, [&](std::size_t w) {
        const CellBits corners(row_bits, w);
        for (std::uint64_t left = ambiguous_bits(row_bits, w, corners); left != 0; left &= left - 1) {
            const auto bit = static_cast<unsigned>(std::countr_zero(left));
            f(Candidate{row.index, 64 * static_cast<std::int64_t>(w) + bit, row.y, row.z,
                        case_of(corners, bit)});
        }
    });
}

// Decides candidates in the order in which they are added, each a while after it has asked for its samples: those of a
// large volume are not in the cache, and a miss takes longer than a decision.
template <class T, class Found>
class Decisions {
  public:
    // Calls found(row, cell, topology) for each ambiguous cell.
    Decisions(const VolumeView& volume, double isovalue, const InsideBits& bits, const Found& found)
        : volume_(volume), isovalue_(isovalue), bits_(bits), found_(found) {}

    void add(const Candidate& candidate) {
        if (added_ - decided_ == waiting_.size()) decide(CellBatch::kCells);
        waiting_[added_++ % waiting_.size()] = candidate;
        samples_of(candidate).prefetch(candidate.x - bits_.first_x);
    }
    void finish() {
        while (decided_ < added_) decide(std::min(CellBatch::kCells, added_ - decided_));
    }

  private:
    CornerSamples<T> samples_of(const Candidate& candidate) const {
        return {volume_, candidate.y - bits_.first_y, candidate.z - bits_.first_z};
    }
    void decide(std::size_t count) {
        const Candidate* const candidates = &waiting_[decided_ % waiting_.size()];
        std::uint8_t cases[CellBatch::kCells] = {};
        for (std::size_t i = 0; i < count; ++i) {
            const Candidate& c = candidates[i];
            cases[i] = c.cell_case;
            batch_.set(i, samples_of(c).minus(isovalue_, c.x - bits_.first_x));
        }
        CellTopology topologies[CellBatch::kCells];
        decide_topologies(batch_, cases, count, topologies);
        for (std::size_t i = 0; i < count; ++i) {
            const Candidate& c = candidates[i];
            const CellTopology& topology = topologies[i];
            if (topology.is_default(c.cell_case)) continue;
            const auto shape = static_cast<std::uint16_t>(topology.shape - kShapes.data());
            found_(c.row,
                   AmbiguousCell{static_cast<std::uint32_t>(c.x), shape, c.cell_case, topology.inner_points() > 0},
                   topology);
        }
        decided_ += count;
    }

    const VolumeView& volume_;
    const double isovalue_;
    const InsideBits& bits_;
    const Found& found_;
    std::array<Candidate, 3 * CellBatch::kCells> waiting_{};
    CellBatch batch_;
    std::size_t added_ = 0, decided_ = 0;
};

// The derivative of the samples at an index along an axis: central differences where the samples allow, else
// one-sided ones, as for the normals of points on edges.
template <class T>
double slope(const VolumeView& volume, const std::array<std::int64_t, 3>& index, std::size_t axis) {
    const std::array<std::int64_t, 3> stride{1, volume.row_pitch(), volume.slice_pitch()};
    const T* const p = row_of<T>(volume, index[1], index[2]) + index[0];
    const std::int64_t i = index[axis];
    const std::int64_t before = i > -volume.below[axis] ? stride[axis] : 0;
    const std::int64_t after = i + 1 < volume.geometry.dims[axis] + volume.above[axis] ? stride[axis] : 0;
    // Halved before the difference, so that it does not overflow.
    const double rise = static_cast<double>(p[after]) / 2 - static_cast<double>(p[-before]) / 2;
    return before != 0 && after != 0 ? rise : 2 * rise;
}

Vec3d gradient_at(const VolumeView& volume, const std::array<std::int64_t, 3>& index) {
    return visit_sample_type(volume.type, [&](auto sample) -> Vec3d {
        using T = decltype(sample);
        return {slope<T>(volume, index, 0), slope<T>(volume, index, 1), slope<T>(volume, index, 2)};
    });
}

// The gradient at a point of a cell: that of the samples around it, which is smooth across cells. Where it would
// turn the surface over, or a sample is not finite, it is that of the interpolant or of the inside bits.
Vec3d gradient_in_cell(const VolumeView& volume, const std::array<std::int64_t, 3>& cell,
                       const CellValues& values, const Vec3d& at) {
    if (std::any_of(values.begin(), values.end(), [](double v) { return std::isnan(v); })) {
        CellValues sides;
        for (std::size_t v = 0; v < 8; ++v) sides[v] = values[v] >= 0 ? 1 : -1;
        return Interpolant(sides, at).gradient;
    }
    Vec3d smooth{};
    for (std::size_t v = 0; v < 8; ++v) {
        std::array<std::int64_t, 3> index;
        double weight = 1;
        for (std::size_t a = 0; a < 3; ++a) {
            const bool far = (v >> a & 1) != 0;
            index[a] = cell[a] + (far ? 1 : 0);
            weight *= far ? at[a] : 1 - at[a];
        }
        smooth = smooth + weight * gradient_at(volume, index);
    }
    const Vec3d own = Interpolant(well_scaled(values), at).gradient;
    return dot(smooth, own) > 0 ? smooth : own;
}

Vec3f normal_of(const IndexToPhysical& to_physical, const Vec3d& gradient) {
    double steepest = 0;
    for (const double g : gradient) steepest = std::max(steepest, std::abs(g));
    Vec3d normal;
    for (std::size_t r = 0; r < 3; ++r)
        normal[r] = dot(to_double(to_physical.normal_matrix[r]), (1 / steepest) * gradient);
    const double per_length = 1 / length(normal);
    if (!std::isfinite(per_length)) return to_physical.axis[0];  // where there is no gradient
    return to_float(per_length * normal);
}

}  // namespace

std::size_t KeptCells::bytes() const {
    std::size_t bytes = row_begin.size() * sizeof(std::uint32_t);
    for (const auto& cells : of_slice) bytes += cells.capacity() * sizeof(AmbiguousCell);
    return bytes;
}

void AmbiguousCells::count(std::int64_t slice, RowCounts& counts) const {
    const std::size_t row_begin = bits_.row_index(0, slice), row_end = bits_.row_index(0, slice + 1);
    std::vector<AmbiguousCell>* const kept = kept_ ? &kept_->of_slice[static_cast<std::size_t>(slice)] : nullptr;
    if (kept != nullptr) kept->clear();
    visit_sample_type(volume_.type, [&](auto sample) {
        std::size_t next_row = row_begin;  // the first whose cells were not kept yet
        const auto keep_until = [&](std::size_t row) {
            for (; next_row < row; ++next_row)
                kept_->row_begin[next_row] = static_cast<std::uint32_t>(kept->size());
        };
        const auto found = [&](std::size_t row, const AmbiguousCell& cell, const CellTopology& topology) {
            const std::size_t w = cell.x / 64;
            words_.row(row)[w / 64] |= std::uint64_t{1} << w % 64;
            counts.inner[row] += static_cast<std::uint32_t>(topology.inner_points());
            counts.more_triangles[row] +=
                static_cast<std::uint32_t>(topology.triangles() - kCases[cell.cell_case].triangles);
            if (kept == nullptr) return;
            keep_until(row + 1);
            kept->push_back(cell);
        };
        Decisions<decltype(sample), decltype(found)> decisions(volume_, isovalue_, bits_, found);
        std::vector<std::uint64_t> masks(words_.masks_per_row);
        for (GridRow row(bits_, row_begin); row.index < row_end; row.advance(bits_)) {
            counts.inner[row.index] = counts.more_triangles[row.index] = 0;
            if (!has_any(row.index)) continue;
            std::copy_n(words_.row(row.index), masks.size(), masks.begin());
            std::fill_n(words_.row(row.index), masks.size(), std::uint64_t{0});
            for_each_candidate(bits_, row, masks.data(), masks.size(),
                               [&](const Candidate& c) { decisions.add(c); });
        }
        decisions.finish();
        if (kept != nullptr) keep_until(row_end);
    });
}

std::span<const AmbiguousCell> AmbiguousCells::of_row(std::size_t row, std::vector<AmbiguousCell>& memory) const {
    const GridRow at(bits_, row);
    if (kept_ != nullptr) {
        const auto& cells = kept_->of_slice[static_cast<std::size_t>(at.z)];
        const std::size_t begin = kept_->row_begin[row];
        const std::size_t end = at.y + 1 < bits_.ny ? kept_->row_begin[row + 1] : cells.size();
        return {cells.data() + begin, end - begin};
    }
    memory.clear();
    visit_sample_type(volume_.type, [&](auto sample) {
        const auto found = [&](std::size_t, const AmbiguousCell& cell, const CellTopology&) {
            memory.push_back(cell);
        };
        Decisions<decltype(sample), decltype(found)> decisions(volume_, isovalue_, bits_, found);
        for_each_candidate(bits_, at, words_.row(row), words_.masks_per_row,
                           [&](const Candidate& c) { decisions.add(c); });
        decisions.finish();
    });
    return memory;
}

AmbiguousCells::InnerCell AmbiguousCells::inner_cell(std::size_t row, const AmbiguousCell& cell) const {
    const GridRow at(bits_, row);
    InnerCell result;
    result.index = {cell.x - bits_.first_x, at.y - bits_.first_y, at.z - bits_.first_z};
    visit_sample_type(volume_.type, [&](auto sample) {
        const CornerSamples<decltype(sample)> samples(volume_, result.index[1], result.index[2]);
        result.values = samples.minus(isovalue_, result.index[0]);
    });
    result.topology = decide_topology(cell.cell_case, result.values);
    return result;
}

void AmbiguousCells::emit_points(std::size_t row, std::vector<AmbiguousCell>& memory, Vec3f* points,
                                 Vec3f* normals) const {
    for (const AmbiguousCell& ambiguous : of_row(row, memory)) {
        if (!ambiguous.has_inner_points) continue;
        const InnerCell cell = inner_cell(row, ambiguous);
        const auto& first = to_physical_.first;
        std::array<Vec3d, CellTopology::kTunnelPoints> inner;
        const int count = place_inner_points(cell.topology, cell.values, inner);
        for (int k = 0; k < count; ++k) {
            const Vec3d& in_cell = inner[static_cast<std::size_t>(k)];
            Vec3d in_whole;
            for (std::size_t a = 0; a < 3; ++a)
                in_whole[a] = static_cast<double>(first[a] + cell.index[a]) + in_cell[a];
            *points++ = to_float(to_physical_.origin + to_physical_.exact * in_whole);
            if (normals != nullptr)
                *normals++ =
                    normal_of(to_physical_, gradient_in_cell(volume_, cell.index, cell.values, in_cell));
        }
    }
}

std::uint32_t* AmbiguousCells::emit_triangles(std::size_t row, const AmbiguousCell& ambiguous,
                                              const std::uint32_t* edge_ids, std::uint32_t& inner_id,
                                              std::uint32_t* out) const {
    const InnerCell cell = inner_cell(row, ambiguous);
    const std::size_t second = to_physical_.mirrored ? 2 : 1, third = 3 - second;
    const auto id = [&](std::uint8_t corner) {
        return corner < kCellEdges ? edge_ids[corner] : inner_id + (corner - kCellEdges);
    };
    const auto emit = [&](const std::uint8_t* corners, int triangles) {
        for (const std::uint8_t* const end = corners + 3 * triangles; corners != end; corners += 3) {
            *out++ = id(corners[0]);
            *out++ = id(corners[second]);
            *out++ = id(corners[third]);
        }
    };
    if (cell.topology.has_tunnel) {
        const TunnelTriangles triangles = triangulate_tunnel(cell.topology, cell.values);
        emit(triangles.corners.data(), triangles.count);
    } else {
        emit(cell.topology.shape->corners.data(), cell.topology.shape->triangles);
    }
    inner_id += static_cast<std::uint32_t>(cell.topology.inner_points());
    return out;
}

}  // namespace marrow::internal
