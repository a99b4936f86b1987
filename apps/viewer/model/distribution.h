/// How often the values of a scan occur, in bins that suit a part of the range.
#pragma once

#include <optional>
#include <vector>

#include <marrow/histogram.h>
#include <marrow/volume.h>

namespace marrow::viewer {

/// Whether all values are whole numbers because of the type.
bool has_integers(const VolumeView& volume);

/// The smallest number of the form 1, 2 or 5 times a power of ten that is not
/// below `minimum`. \pre minimum > 0
double round_step(double minimum);

/// Counts in bins of equal width, the first of which begins at `first`.
struct Bins {
    double first = 0, width = 1;
    std::vector<double> counts;
};

class Distribution {
  public:
    /// An empty one.
    Distribution() = default;
    /// Approximates the values by a histogram with few bins.
    explicit Distribution(const Histogram& histogram);
    /// Counts each integer, or fractions in bins so fine that they are not
    /// visible; `padding` as by histogram().
    Distribution(const VolumeView& volume, const Histogram& histogram, std::optional<double> padding = {});

    /// The bins from `lower` to `upper`, about `count` of them. Their width is a round number and their
    /// borders are multiples of it; those of integers lie half a unit below, so that each bin holds the same
    /// number of integers. Where bins cut finer ones, counts are divided. \pre lower < upper
    Bins bins(double lower, double upper, double count) const;

  private:
    Histogram histogram_;
    double first_ = 0, width_ = 1;  // of the bins of the histogram
    bool integers_ = false;
};

/// A range of values.
struct ValueRange {
    double lower = 0, upper = 1;
};

/// From the 0.1 to the 99.9 percentile with a margin, if outliers such as metal and padding stretch the range
/// to far more; else all values.
ValueRange usual_range(const Histogram& histogram);

}  // namespace marrow::viewer
