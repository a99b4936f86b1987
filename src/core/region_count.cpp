#include "region_count.h"

#include <bit>
#include <utility>
#include <vector>

namespace marrow::internal {
namespace {

// Samples [begin, end) of a row that are all inside, or all outside.
struct Run {
    std::int32_t begin, end;
};

// Runs of one kind, row by row, and which of them hang together.
class Regions {
  public:
    explicit Regions(std::size_t rows) { start_.reserve(rows + 1); }

    void add_row(const std::vector<Run>& runs) {
        start_.push_back(runs_.size());
        for (const Run& run : runs) {
            parent_.push_back(static_cast<std::uint32_t>(runs_.size()));
            runs_.push_back(run);
        }
        regions_ += static_cast<std::int64_t>(runs.size());
    }
    // A row whose first and last run belong to the very first run's region.
    void add_row_within_first(const std::vector<Run>& runs) {
        add_row(runs);
        regions_ -= std::exchange(parent_[start_.back()], 0) != 0;
        regions_ -= std::exchange(parent_.back(), 0) != 0;
    }

    // Joins the last row's runs with those of an earlier row that they meet, `reach` samples beyond their ends included.
    void join_last_with(std::size_t row, std::int32_t reach) {
        std::size_t a = start_[row], b = start_.back();
        const std::size_t a_end = start_[row + 1], b_end = runs_.size();
        while (a < a_end && b < b_end) {
            const Run first = runs_[a], second = runs_[b];
            if (first.begin < second.end + reach && second.begin < first.end + reach &&
                parent_[a] != parent_[b])
                join(a, b);
            const bool first_ends = first.end < second.end;
            a += first_ends ? 1 : 0;
            b += first_ends ? 0 : 1;
        }
    }

    std::int64_t count() const { return regions_; }

  private:
    std::uint32_t root(std::uint32_t run) {
        while (parent_[run] != run) run = parent_[run] = parent_[parent_[run]];
        return run;
    }
    void join(std::size_t a, std::size_t b) {
        const std::uint32_t ra = root(static_cast<std::uint32_t>(a)),
                            rb = root(static_cast<std::uint32_t>(b));
        if (ra == rb) return;
        parent_[std::max(ra, rb)] = std::min(ra, rb);
        --regions_;
    }

    std::vector<Run> runs_;
    std::vector<std::uint32_t> parent_;
    std::vector<std::size_t> start_;  // of each row's runs
    std::int64_t regions_ = 0;
};

}  // namespace

std::int64_t count_surfaces(const InsideBits& bits) {
    Regions inside(bits.rows()), outside(bits.rows());
    std::vector<Run> inside_runs, outside_runs;
    const auto ny = static_cast<std::size_t>(bits.ny);
    for (std::size_t row = 0; row < bits.rows(); ++row) {
        inside_runs.clear();
        outside_runs.clear();
        // The row starts outside, and where its bits end it is outside again.
        const std::uint64_t* words = bits.row(row);
        std::int32_t begin = 0;
        std::uint64_t before = 0;  // the last bit of the word before
        for (std::size_t w = 0; w < bits.words_per_row; ++w) {
            std::uint64_t changes = words[w] ^ (words[w] << 1 | before);
            before = words[w] >> 63;
            for (; changes != 0; changes &= changes - 1) {
                const auto at = static_cast<std::int32_t>(64 * w) + std::countr_zero(changes);
                ((words[w] >> std::countr_zero(changes) & 1) != 0 ? outside_runs : inside_runs)
                    .push_back({begin, at});
                begin = at;
            }
        }
        const auto end = static_cast<std::int32_t>(64 * bits.words_per_row);
        if (before != 0) {
            inside_runs.push_back({begin, end});
            begin = end;
        }
        outside_runs.push_back({begin, end + 1});

        inside.add_row(inside_runs);
        outside.add_row_within_first(outside_runs);  // rows begin and end in the air round the volume
        const std::size_t y = row % ny;
        if (y > 0) {
            inside.join_last_with(row - 1, 0);
            outside.join_last_with(row - 1, 1);
        }
        if (row >= ny) {
            inside.join_last_with(row - ny, 0);
            outside.join_last_with(row - ny, 1);
            if (y > 0) outside.join_last_with(row - ny - 1, 0);
            if (y + 1 < ny) outside.join_last_with(row - ny + 1, 0);
        }
    }
    return inside.count() + outside.count() - 1;
}

}  // namespace marrow::internal
