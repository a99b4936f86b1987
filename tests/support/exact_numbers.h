/// Numbers whose signs are never wrong: rounded ones with a bound of their error, and wide
/// integers where that leaves doubt.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include <boost/multiprecision/cpp_int.hpp>

namespace marrow::test {

/// Thrown where the sign of a rounded number is in doubt.
struct Undecided {};

/// A rounded number and a bound of its error.
class Rounded {
  public:
    explicit Rounded(std::int64_t x) : value_(static_cast<long double>(x)) {
        static_assert(std::numeric_limits<long double>::digits > 63,
                      "long double must hold all 64-bit integers");
    }

    friend Rounded operator+(const Rounded& a, const Rounded& b) {
        return {a.value_ + b.value_, a.error_ + b.error_};
    }
    friend Rounded operator-(const Rounded& a, const Rounded& b) {
        return {a.value_ - b.value_, a.error_ + b.error_};
    }
    friend Rounded operator*(const Rounded& a, const Rounded& b) {
        return {a.value_ * b.value_,
                std::abs(a.value_) * b.error_ + std::abs(b.value_) * a.error_ + a.error_ * b.error_};
    }
    /// -1, 0 or 1. \throw Undecided
    int sign() const {
        if (std::abs(value_) > error_) return value_ > 0 ? 1 : -1;
        if (value_ == 0 && error_ == 0) return 0;
        throw Undecided();
    }

  private:
    // `error` is that of the operands; it grows by twice the rounding of the value, and by its own.
    Rounded(long double value, long double error)
        : value_(value),
          error_(1.001L * error + std::numeric_limits<long double>::epsilon() * std::abs(value)) {}

    long double value_, error_ = 0;
};

/// Throws if 512 bits do not hold a result.
using Exact = boost::multiprecision::checked_int512_t;

/// The result of f.operator()<Number>() for rounded numbers, or for exact ones where these leave doubt.
template <class F>
auto decide_exactly(const F& f) {
    try {
        return f.template operator()<Rounded>();
    } catch (const Undecided&) {
        return f.template operator()<Exact>();
    }
}

}  // namespace marrow::test
