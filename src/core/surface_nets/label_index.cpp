// Finds which label values a map has, from the few samples that can be the first of their label.
#include "label_index.h"

#include <algorithm>
#include <bit>
#include <unordered_set>
#include <utility>

#include <marrow/error.h>

#include "base/parallel.h"

namespace marrow::internal {
namespace {

// A set of labels. \throw InputError too many, as soon as there are: each sample of a noisy scan is another
template <class T>
class LabelSet {
  public:
    explicit LabelSet(T first) : values_{first}, recent_(first) {}

    void insert(T value) {
        if (std::exchange(recent_.entry(value), value) == value) return;
        values_.insert(value);
        if (values_.size() > kMostLabelValues)
            throw InputError(
                "the volume has more than 65535 different values besides the background, so it is not a "
                "label map; give a volume in which each structure has one value");
    }
    const std::unordered_set<T>& values() const { return values_; }

  private:
    std::unordered_set<T> values_;
    RecentLabels<T, T> recent_;
};

// The edges along x, y and z that end at the samples of row (j, k), 64 to a word.
class EdgesBefore {
  public:
    EdgesBefore(const BorderBits& bits, std::int64_t j, std::int64_t k)
        : x_(&bits.crossed[0][bits.first_word(j, k)]),
          y_(&bits.crossed[1][bits.first_word(j - 1, k)]),
          z_(&bits.crossed[2][bits.first_word(j, k - 1)]) {}

    // Bit b: the edges along all three axes that end at sample 64 w + b + 1 are crossed. The last word of a
    // row may read the next one's first bits, which are 0 for the edges along x.
    std::uint64_t all_crossed(std::size_t w) const {
        return x_[w] & (y_[w] >> 1 | y_[w + 1] << 63) & (z_[w] >> 1 | z_[w + 1] << 63);
    }

  private:
    const std::uint64_t *x_, *y_, *z_;
};

template <class T>
std::vector<std::int64_t> find_values_of_type(const LabelReader<T>& labels, const BorderBits& bits,
                                              const Progress& progress) {
    Stage stage(progress, 0, 1, static_cast<std::size_t>(bits.dims[2]));
    PerThread<LabelSet<T>> set_of_thread(labels.background);
    parallel_for(std::int64_t{1}, bits.dims[2] + 1, [&](std::int64_t k) {
        LabelSet<T>& set = set_of_thread.local();
        for (std::int64_t j = 1; j <= bits.dims[1]; ++j) {
            // The first sample of a label, in memory order, differs from the samples before it along every
            // axis: they come earlier or are background, which is in the set already. So only samples at
            // which all three edges are crossed can add a label.
            const EdgesBefore edges(bits, j, k);
            const T* row = labels.row(j, k);
            for (std::size_t w = 0; w < bits.words; ++w) {
                for (std::uint64_t left = edges.all_crossed(w); left != 0; left &= left - 1)
                    set.insert(
                        labels.label(row, static_cast<std::int64_t>(64 * w) + std::countr_zero(left) + 1));
            }
        }
        stage.step();
    });
    LabelSet<T> all(labels.background);
    for (const LabelSet<T>& set : set_of_thread) {
        for (const T value : set.values()) all.insert(value);
    }
    std::vector<std::int64_t> result;
    for (const T value : all.values()) result.push_back(static_cast<std::int64_t>(value));
    std::sort(result.begin(), result.end());
    return result;
}

}  // namespace

std::vector<std::int64_t> find_label_values(const LabelMap& map, const BorderBits& bits,
                                            const Progress& progress) {
    return visit_sample_type(map.type, [&](auto sample) {
        return find_values_of_type(LabelReader<decltype(sample)>(map), bits, progress);
    });
}

}  // namespace marrow::internal
