#include "label_index.h"

#include <utility>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <marrow/error.h>

namespace marrow::internal {
namespace {

// Ascending values.
template <class T>
class Values {
  public:
    explicit Values(T first) : values_{first}, recent_(first) {}

    void add(T value) {
        if (std::exchange(recent_.of(value), value) == value) return;
        const auto at = std::lower_bound(values_.begin(), values_.end(), value);
        if (at == values_.end() || *at != value) values_.insert(at, value);
    }
    const std::vector<T>& all() const { return values_; }

  private:
    std::vector<T> values_;
    Recent<T, T> recent_;
};

// Of every label that is there one sample comes first. Those before it along x, y and z have others, as beyond the volume there
// is background.
template <class T>
std::vector<std::int64_t> values_of(const LabelReader<T>& labels, const BorderBits& bits) {
    constexpr std::size_t kMost = 65535;
    tbb::enumerable_thread_specific<Values<T>> of_thread(labels.background);
    tbb::parallel_for(std::int64_t{1}, bits.dims[2] + 1, [&](std::int64_t k) {
        Values<T>& seen = of_thread.local();
        for (std::int64_t j = 1; j <= bits.dims[1]; ++j) {
            const T* row = labels.row(j, k);
            const std::uint64_t *x = &bits.crossed[0][bits.row(j, k)],
                                *y = &bits.crossed[1][bits.row(j - 1, k)],
                                *z = &bits.crossed[2][bits.row(j, k - 1)];
            for (std::size_t w = 0; w < bits.words; ++w) {
                // The edge along x has its bit one before the others'. Behind a row's last word there is no edge.
                for (std::uint64_t left = x[w] & (y[w] >> 1 | y[w + 1] << 63) & (z[w] >> 1 | z[w + 1] << 63);
                     left != 0; left &= left - 1)
                    seen.add(labels.at(row, static_cast<std::int64_t>(64 * w) + __builtin_ctzll(left) + 1));
            }
        }
        if (seen.all().size() > kMost)
            throw InputError("the label map has more than 65535 different values: is it one?");
    });
    Values<T> values(labels.background);
    for (const Values<T>& seen : of_thread) {
        for (const T value : seen.all()) values.add(value);
    }
    if (values.all().size() > kMost)
        throw InputError("the label map has more than 65535 different values: is it one?");
    std::vector<std::int64_t> result;
    for (const T value : values.all()) result.push_back(static_cast<std::int64_t>(value));
    return result;
}

}  // namespace

std::vector<std::int64_t> find_values(const LabelMap& map, const BorderBits& bits) {
    return visit_sample_type(
        map.type, [&](auto sample) { return values_of(LabelReader<decltype(sample)>(map), bits); });
}

}  // namespace marrow::internal
