/// Sums of doubles without rounding, for predicates that must not err.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace marrow::internal {

/// An exact sum of doubles: an expansion of terms that do not overlap, the smallest first. After Shewchuk
/// 1997. \pre nothing that is added overflows or underflows
class ExactSum {
  public:
    /// What may be added in all; each addition makes at most one more term.
    static constexpr std::size_t kMaxTerms = 192;

    void add(double x) {
        std::size_t kept = 0;
        for (std::size_t i = 0; i < count_; ++i) {
            const double sum = x + terms_[i], back = sum - x;
            const double lost = (x - (sum - back)) + (terms_[i] - back);
            if (lost != 0) terms_[kept++] = lost;
            x = sum;
        }
        if (x != 0) terms_[kept++] = x;
        count_ = kept;
    }
    void add_product(double x, double y) {
        const double product = x * y;
        add(product);
        add(std::fma(x, y, -product));
    }
    void add_product(double x, double y, double z) {
        const double xy = x * y, lost = std::fma(x, y, -xy);
        for (const double term : {xy, lost}) add_product(term, z);
    }
    /// -1, 0 or 1.
    int sign() const { return count_ == 0 ? 0 : terms_[count_ - 1] > 0 ? 1 : -1; }

  private:
    std::array<double, kMaxTerms> terms_;
    std::size_t count_ = 0;
};

}  // namespace marrow::internal
