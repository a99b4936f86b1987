// Asks PROJ about map projections, through GDAL.
#include "projection.h"

#include <cmath>
#include <cstdlib>
#include <memory>

#include <ogr_srs_api.h>

#include <fmt/format.h>

#include <marrow/volume.h>

namespace marrow::internal::terrain {

namespace {

struct Release {
    void operator()(void* reference) const { OSRRelease(reference); }
};
using SpatialReference = std::unique_ptr<void, Release>;

struct Destroy {
    void operator()(void* transformation) const { OCTDestroyCoordinateTransformation(transformation); }
};

// Transforms positions from one coordinate system to another, with x to the east before y to the north.
class Transformation {
  public:
    Transformation(OGRSpatialReferenceH from, OGRSpatialReferenceH to)
        : handle_(OCTNewCoordinateTransformation(from, to)) {}

    std::optional<std::array<double, 2>> operator()(std::array<double, 2> p) const {
        const bool known = handle_ && OCTTransform(handle_.get(), 1, &p[0], &p[1], nullptr);
        if (!known || !std::isfinite(p[0]) || !std::isfinite(p[1])) return {};
        return p;
    }

  private:
    std::unique_ptr<void, Destroy> handle_;
};

// Where a longitude and a latitude are in space, in metres from the centre of the ellipsoid.
Vec3d in_space(OGRSpatialReferenceH reference, const std::array<double, 2>& position) {
    const double inverse_flattening = OSRGetInvFlattening(reference, nullptr);  // 0: a sphere
    const double f = inverse_flattening > 0 ? 1 / inverse_flattening : 0, e2 = f * (2 - f);
    const double unit = OSRGetAngularUnits(reference, nullptr);
    const double longitude = position[0] * unit, latitude = position[1] * unit, sine = std::sin(latitude);
    const double across = OSRGetSemiMajor(reference, nullptr) / std::sqrt(1 - e2 * sine * sine);
    return {across * std::cos(latitude) * std::cos(longitude),
            across * std::cos(latitude) * std::sin(longitude), across * (1 - e2) * sine};
}

}  // namespace

std::string projection_name(OGRSpatialReferenceH reference) {
    if (reference == nullptr) return {};
    int north = 0;
    const int zone = OSRGetUTMZone(reference, &north);
    const char* name = OSRGetName(reference);
    const std::string text = name != nullptr ? name : "";
    if (text != "unnamed" && text != "unknown") return text;
    return zone != 0 ? fmt::format("UTM zone {}{}", std::abs(zone), north ? 'N' : 'S') : "";
}

std::optional<std::string> utm_zone(const PixelGrid& grid) {
    const SpatialReference wgs84(OSRNewSpatialReference(nullptr));
    OSRImportFromEPSG(wgs84.get(), 4326);
    OSRSetAxisMappingStrategy(wgs84.get(), OAMS_TRADITIONAL_GIS_ORDER);
    const auto centre = Transformation(grid.reference, wgs84.get())(
        grid.at(static_cast<double>(grid.columns) / 2, static_cast<double>(grid.rows) / 2));
    if (!centre || std::abs((*centre)[1]) > 84) return {};
    // Rasters may count longitudes from 0 to 360 degrees.
    const double longitude = (*centre)[0] - 360 * std::floor(((*centre)[0] + 180) / 360);
    const int zone = static_cast<int>((longitude + 180) / 6) + 1;
    return fmt::format("EPSG:{}", ((*centre)[1] < 0 ? 32700 : 32600) + zone);
}

double length_distortion(const PixelGrid& grid, OGRSpatialReferenceH map) {
    const SpatialReference geographic(OSRCloneGeogCS(map));
    if (!geographic) return 1;
    OSRSetAxisMappingStrategy(geographic.get(), OAMS_TRADITIONAL_GIS_ORDER);
    const Transformation to_map(grid.reference, map), to_geographic(map, geographic.get());
    constexpr double kLength = 10;  // metres: as good as straight
    const double half = kLength / 2 / OSRGetLinearUnits(map, nullptr);
    const auto distortion = [&](const std::array<double, 2>& at, std::size_t axis) {
        std::array<double, 2> from = at, to = at;
        from[axis] -= half;
        to[axis] += half;
        const auto start = to_geographic(from), end = to_geographic(to);
        if (!start || !end) return 1.0;
        const Vec3d a = in_space(geographic.get(), *start), b = in_space(geographic.get(), *end);
        return kLength / std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
    };

    constexpr int kIntervals = 4;  // between the places along a side
    double worst = 1;
    for (int i = 0; i <= kIntervals; ++i) {
        for (int j = 0; j <= kIntervals; ++j) {
            const auto at = to_map(grid.at(static_cast<double>(grid.columns * i) / kIntervals,
                                           static_cast<double>(grid.rows * j) / kIntervals));
            if (!at) continue;
            for (std::size_t axis = 0; axis < 2; ++axis) {
                const double found = distortion(*at, axis);
                if (std::abs(std::log(found)) > std::abs(std::log(worst))) worst = found;
            }
        }
    }
    return worst;
}

}  // namespace marrow::internal::terrain
