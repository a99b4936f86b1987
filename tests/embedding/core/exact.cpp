// Checks that Marrow computes exactly in a project that is compiled with -ffast-math.
#include "base/all_finite.h"
#include "base/exact_sum.h"

#include <array>
#include <limits>

int main() {
    volatile double large = 1e17;  // the compiler must not know the values
    marrow::internal::ExactSum sum;
    for (const double term : {+large, 1.0, -large}) sum.add(term);

    volatile float not_a_number = std::numeric_limits<float>::quiet_NaN();
    const std::array points{marrow::Vec3f{0, 0, not_a_number}};
    return sum.sign() == 1 && !marrow::internal::all_finite(points) ? 0 : 1;
}
