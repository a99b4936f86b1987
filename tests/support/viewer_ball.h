/// A test fixture: a window that shows a ball.
#pragma once

#include <cmath>

#include "viewer_window.h"

namespace marrow::test {

inline constexpr int kSide = 48, kSlices = 25;  // samples 1 x 1 x 2 mm apart
inline constexpr double kRadius = 15;           // mm
inline constexpr Vec3d kMiddle{24, 22, 12};     // index

inline Vec3d position_of(const Vec3d& index) {  // in the files of write_nrrd
    return {10 + index[0], 20 + index[1], 30 + 2 * index[2]};
}

inline double distance(const Vec3d& a, const Vec3d& b) {
    return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

class BallViewer : public ViewerTest {
  protected:
    void SetUp() override {
        ViewerTest::SetUp();
        if (IsSkipped()) return;
        scan = folder / "ball.nrrd";
        write_nrrd(scan, kSide, kSide, kSlices, ball(kMiddle[0], kMiddle[1], kMiddle[2], kRadius));
        ASSERT_TRUE(open(scan));
        session().set_isovalue(0);  // the ball's surface
        ASSERT_TRUE(settle());
    }

    std::filesystem::path scan;
};

}  // namespace marrow::test
