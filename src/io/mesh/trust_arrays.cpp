// Names the numbers of points that say how far a surface can be trusted.
#include <marrow/trust_arrays.h>

#include <string>

#include <fmt/format.h>

namespace marrow {
namespace {

std::string thin_wall_meaning(ThinWallState thin_walls) {
    switch (thin_walls) {
        case ThinWallState::found:
            return "1 on the rims of walls that are too thin for the scan";
        case ThinWallState::restored:
            return "1 on walls that were restored, and beside them";
        case ThinWallState::unknown:
            break;
    }
    return "0, as no walls were looked for that are too thin for the scan";
}

}  // namespace

std::vector<PointArray> trust_arrays(const TrustReport& report, std::span<const float> near_thin_walls,
                                     ThinWallState thin_walls, bool hounsfield) {
    const char* const unit = hounsfield ? " HU" : "";
    const bool known = report.noise.windows > 0;
    return {{"shift_mm",
             fmt::format("mm that the surface moves if the isovalue changes by {:g}{}", report.step, unit),
             report.shift},
            {"noise_mm",
             known ? fmt::format("mm, standard deviation by noise of {:.3g}{}", report.noise.sigma, unit)
                   : "0, as the noise is unknown",
             report.noise_shift},
            {"thin_wall", thin_wall_meaning(thin_walls), near_thin_walls}};
}

}  // namespace marrow
