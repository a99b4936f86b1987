#include "raster.h"

#include <cpl_conv.h>
#include <cpl_error.h>
#include <gdal_utils.h>
#include <ogr_srs_api.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

#include <fmt/format.h>

#include <marrow/error.h>

namespace marrow::terrain {

namespace {

// What is opened. Not every driver that GDAL has: some of them read what a file points to, from elsewhere.
constexpr const char* kDrivers[] = {"GTiff", "USGSDEM", "SRTMHGT", "DTED", "AAIGrid",
                                    "EHdr",  "HFA",     "PNG",     nullptr};

// GDAL's messages come back in our errors and not on stderr.
class QuietErrors {
  public:
    QuietErrors() {
        CPLPushErrorHandler(CPLQuietErrorHandler);
        CPLErrorReset();
    }
    ~QuietErrors() { CPLPopErrorHandler(); }
    QuietErrors(const QuietErrors&) = delete;

    std::string said() const {
        std::string text = CPLGetLastErrorMsg();
        std::replace(text.begin(), text.end(), '\n', ' ');
        return text;
    }
};

struct SpatialReference {
    explicit SpatialReference(OGRSpatialReferenceH h) : handle(h) {}
    ~SpatialReference() { OSRRelease(handle); }
    SpatialReference(const SpatialReference&) = delete;
    OGRSpatialReferenceH handle;
};

std::string name_of(OGRSpatialReferenceH reference) {
    if (reference == nullptr) return {};
    int north = 0;
    const int zone = OSRGetUTMZone(reference, &north);
    const char* name = OSRGetName(reference);
    const std::string text = name != nullptr ? name : "";
    if (text != "unnamed" && text != "unknown") return text;
    return zone != 0 ? fmt::format("UTM zone {}{}", std::abs(zone), north ? 'N' : 'S') : "";
}

// The UTM zone of the raster's middle.
std::string utm_zone(GDALDatasetH dataset, const std::array<double, 6>& g, OGRSpatialReferenceH from,
                     const std::string& name) {
    const double column = GDALGetRasterXSize(dataset) / 2.0, row = GDALGetRasterYSize(dataset) / 2.0;
    double longitude = g[0] + g[1] * column + g[2] * row, latitude = g[3] + g[4] * column + g[5] * row;
    const SpatialReference wgs84(OSRNewSpatialReference(nullptr));
    OSRImportFromEPSG(wgs84.handle, 4326);
    OSRSetAxisMappingStrategy(wgs84.handle, OAMS_TRADITIONAL_GIS_ORDER);
    OGRCoordinateTransformationH to = OCTNewCoordinateTransformation(from, wgs84.handle);
    const bool known = to != nullptr && OCTTransform(to, 1, &longitude, &latitude, nullptr);
    if (to != nullptr) OCTDestroyCoordinateTransformation(to);
    if (!known || std::abs(latitude) > 84) {
        throw GeometryError(fmt::format(
            "{}: no UTM zone for its place on the earth; project it to metres first (gdalwarp -t_srs)",
            name));
    }
    const int zone = std::clamp(static_cast<int>(std::floor((longitude + 180) / 6)) + 1, 1, 60);
    return fmt::format("EPSG:{}", (latitude < 0 ? 32700 : 32600) + zone);
}

// Heights are metres where the raster does not say otherwise.
double metres_of(std::string unit) {
    std::transform(unit.begin(), unit.end(), unit.begin(), [](unsigned char c) { return std::tolower(c); });
    if (unit.find("survey") != unit.npos || unit == "us-ft") return 1200.0 / 3937;
    if (unit == "ft" || unit.find("foot") != unit.npos || unit.find("feet") != unit.npos) return 0.3048;
    return 1;
}

// How many samples GDAL's warper puts into a length.
double samples_across(double length, double step) {
    return std::floor(length / step + 0.5);
}

}  // namespace

Raster::Raster(const std::filesystem::path& path, double cell, GoOn go_on)
    : name_(path.string()), go_on_(std::move(go_on)) {
    static std::once_flag registered;
    std::call_once(registered, GDALAllRegister);
    if (!std::filesystem::exists(path)) throw IoError(fmt::format("{}: there is no such file", name_));
    if (!std::filesystem::is_regular_file(path)) throw InputError(fmt::format("{}: is not a file", name_));

    const QuietErrors errors;
    source_.reset(GDALOpenEx(name_.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, kDrivers, nullptr, nullptr));
    if (!source_) {
        const std::string said = errors.said();
        throw InputError(
            fmt::format("{}: cannot be read as an elevation raster (GeoTIFF, USGS DEM, SRTM .hgt, "
                        "DTED, Arc/Info grid, ERDAS Imagine, PNG){}{}",
                        name_, said.empty() ? "" : ": ", said));
    }
    dataset_ = source_.get();
    if (GDALGetRasterCount(dataset_) != 1) {
        throw InputError(fmt::format("{}: has {} bands; a raster of heights has one", name_,
                                     GDALGetRasterCount(dataset_)));
    }
    format_ = GDALGetDriverShortName(GDALGetDatasetDriver(dataset_));
    const GDALRasterBandH band = GDALGetRasterBand(dataset_, 1);
    height_unit_ = metres_of(GDALGetRasterUnitType(band));
    height_scale_ = GDALGetRasterScale(band, nullptr);
    height_offset_ = GDALGetRasterOffset(band, nullptr);

    std::array<double, 6> g{0, 1, 0, 0, 0, -1};
    placed_ = GDALGetGeoTransform(dataset_, g.data()) == CE_None;
    OGRSpatialReferenceH reference = GDALGetSpatialRef(dataset_);
    if (!placed_) {
        if (!(cell > 0))
            throw GeometryError(fmt::format(
                "{}: does not say where on the earth its samples are; give the metres between them: --cell M",
                name_));
        g = {-cell / 2, cell, 0, -cell / 2, 0, -cell};
    } else if (reference == nullptr) {
        names_coordinates_ = false;
        warnings_.push_back("the raster does not name its coordinates; they are taken for metres");
    }
    const bool degrees = reference != nullptr && OSRIsGeographic(reference);
    const bool turned = g[2] != 0 || g[4] != 0 || g[1] < 0 || g[5] > 0;
    if (placed_ && (degrees || turned || cell > 0)) {
        project(degrees ? utm_zone(dataset_, g, reference, name_) : "", cell);
        GDALGetGeoTransform(dataset_, g.data());
        reference = GDALGetSpatialRef(dataset_);
    }
    projection_ = name_of(reference);

    const double unit = reference != nullptr ? OSRGetLinearUnits(reference, nullptr) : 1;
    columns_ = GDALGetRasterXSize(dataset_);
    rows_ = GDALGetRasterYSize(dataset_);
    east_step_ = g[1] * unit;
    north_step_ = -g[5] * unit;
    west_ = (g[0] + g[1] / 2) * unit;
    south_ = (g[3] + g[5] * (static_cast<double>(rows_) - 0.5)) * unit;
}

// Reads the file through GDAL's warper, which works on what is asked for and keeps no whole image.
void Raster::project(const std::string& to, double cell) {
    std::vector<std::string> words{"-of", "VRT", "-ot", "Float64", "-dstnodata", "nan"};
    const auto add = [&](std::initializer_list<std::string> more) { words.insert(words.end(), more); };
    if (!to.empty()) add({"-t_srs", to});
    // Averages where samples become fewer, so that none is passed over; else between neighbours.
    const auto warp = [&] {
        std::vector<char*> argv;
        for (std::string& word : words) argv.push_back(word.data());
        argv.push_back(nullptr);
        GDALWarpAppOptions* options = GDALWarpAppOptionsNew(argv.data(), nullptr);
        GDALDatasetH source = source_.get();
        warped_.reset(GDALWarp("", nullptr, 1, &source, options, nullptr));
        GDALWarpAppOptionsFree(options);
        if (!warped_)
            throw InputError(fmt::format("{}: cannot be projected: {}", name_, CPLGetLastErrorMsg()));
        dataset_ = warped_.get();
    };
    add({"-r", "bilinear"});
    warp();
    if (!(cell > 0)) return;

    std::array<double, 6> own{};
    GDALGetGeoTransform(dataset_, own.data());
    const OGRSpatialReferenceH reference = GDALGetSpatialRef(dataset_);
    const double step = cell / (reference != nullptr ? OSRGetLinearUnits(reference, nullptr) : 1);
    const double columns = samples_across(own[1] * GDALGetRasterXSize(dataset_), step);
    const double rows = samples_across(-own[5] * GDALGetRasterYSize(dataset_), step);
    if (columns < 2 || rows < 2)
        throw InputError(
            fmt::format("{}: samples {:g} m apart leave {:.0f} x {:.0f} of them, and a terrain needs 2 x 2: "
                        "give a smaller --cell; the raster's own is {:.4g} m",
                        name_, cell, columns, rows, own[1] * cell / step));
    if (columns * rows > kMostSamples)
        throw LimitError(
            fmt::format("{}: samples {:g} m apart are {:.0f} x {:.0f}, and a surface has 2^32 - 1 points at "
                        "most: give a larger --cell; the raster's own is {:.4g} m",
                        name_, cell, columns, rows, own[1] * cell / step));
    if (step > own[1]) words.back() = "average";
    const std::string text = fmt::format("{:.17g}", step);
    add({"-tr", text, text});
    warp();
}

void Raster::read(std::int64_t first, std::int64_t count, double* heights) const {
    constexpr std::int64_t kTile = 4096;  // columns at a time, so that a wide raster can be stopped too
    const QuietErrors errors;
    const GDALRasterBandH band = GDALGetRasterBand(dataset_, 1);
    const int height = static_cast<int>(count);
    const int top = static_cast<int>(rows_ - first - count);  // GDAL counts rows from the north
    std::vector<unsigned char> known(static_cast<std::size_t>(columns_ * count));
    struct Asking {
        const GoOn& go_on;
        bool stopped = false;

        bool goes_on() { return !stopped && !(stopped = go_on && !go_on()); }
    } asking{go_on_};
    GDALRasterIOExtraArg stoppable;
    INIT_RASTERIO_EXTRA_ARG(stoppable);
    stoppable.pProgressData = &asking;
    stoppable.pfnProgress = [](double, const char*, void* to_ask) {
        return static_cast<int>(static_cast<Asking*>(to_ask)->goes_on());
    };
    const auto read_tile = [&](GDALRasterBandH from, std::int64_t west, auto* to, GDALDataType type) {
        const auto width = static_cast<int>(std::min(kTile, columns_ - west));
        const auto row_bytes = static_cast<GSpacing>(columns_) * static_cast<GSpacing>(sizeof *to);
        return GDALRasterIOEx(from, GF_Read, static_cast<int>(west), top, width, height, to + west, width,
                              height, type, 0, row_bytes, &stoppable) == CE_None;
    };
    for (std::int64_t west = 0; west < columns_; west += kTile) {
        if (asking.goes_on() && read_tile(band, west, heights, GDT_Float64) &&
            read_tile(GDALGetMaskBand(band), west, known.data(), GDT_Byte))
            continue;
        if (asking.stopped) throw Cancelled();
        throw IoError(fmt::format("{}: cannot be read: {}", name_, errors.said()));
    }
    for (std::size_t i = 0; i < known.size(); ++i) {
        const double metres = (heights[i] * height_scale_ + height_offset_) * height_unit_;
        heights[i] =
            known[i] != 0 && std::isfinite(metres) ? metres : std::numeric_limits<double>::quiet_NaN();
    }
    for (std::int64_t row = 0; row < count / 2; ++row)
        std::swap_ranges(heights + row * columns_, heights + (row + 1) * columns_,
                         heights + (count - 1 - row) * columns_);
}

}  // namespace marrow::terrain
