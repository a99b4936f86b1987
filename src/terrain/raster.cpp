// Reads elevation rasters by GDAL.
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
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <marrow/error.h>

#include "projection.h"

namespace marrow::internal::terrain {

namespace {

// The drivers that may open a file. Some others of GDAL read remote data that a file refers to.
constexpr const char* kDrivers[] = {"GTiff", "USGSDEM", "SRTMHGT", "DTED", "AAIGrid",
                                    "EHdr",  "HFA",     "PNG",     nullptr};

// Collects GDAL's messages for our errors instead of printing them to stderr.
class QuietErrors {
  public:
    QuietErrors() {
        CPLPushErrorHandler(CPLQuietErrorHandler);
        CPLErrorReset();
    }
    ~QuietErrors() { CPLPopErrorHandler(); }
    QuietErrors(const QuietErrors&) = delete;

    std::string message() const {
        std::string text = CPLGetLastErrorMsg();
        std::replace(text.begin(), text.end(), '\n', ' ');
        return text;
    }
};

// Returns whether the raster has a georeference.
bool read_grid(GDALDatasetH dataset, PixelGrid& grid) {
    grid.columns = GDALGetRasterXSize(dataset);
    grid.rows = GDALGetRasterYSize(dataset);
    grid.reference = GDALGetSpatialRef(dataset);
    return GDALGetGeoTransform(dataset, grid.transform.data()) == CE_None;
}

std::string zone_of(const PixelGrid& grid, const std::string& name) {
    const std::optional<std::string> zone = utm_zone(grid);
    if (!zone) {
        throw GeometryError(
            fmt::format("{}: there is no UTM zone at its position on the earth; project it to metres first "
                        "(gdalwarp -t_srs)",
                        name));
    }
    return *zone;
}

struct Unit {
    std::string_view names;  // each between bars, in lower case and without what is not a letter
    double metres;
};
constexpr double kFoot = 0.3048, kSurveyFoot = 1200.0 / 3937;
constexpr Unit kUnits[] = {
    {"|m|metre|metres|meter|meters|", 1},
    {"|mm|millimetre|millimetres|millimeter|millimeters|", 0.001},
    {"|cm|centimetre|centimetres|centimeter|centimeters|", 0.01},
    {"|dm|decimetre|decimetres|decimeter|decimeters|", 0.1},
    {"|km|kilometre|kilometres|kilometer|kilometers|", 1000},
    {"|ft|foot|feet|internationalfoot|internationalfeet|", kFoot},
    {"|usft|ftus|usfoot|footus|usfeet|surveyfoot|surveyfeet|ussurveyfoot|ussurveyfeet|", kSurveyFoot}};

// The metres of a unit, which programs write as "US survey foot", "us-ft" or "Foot_US". No value if it is
// unknown.
std::optional<double> metres_of(std::string_view unit) {
    std::string name = "|";
    for (const char c : unit) {
        const char lower = static_cast<char>(c | 0x20);  // the same in every locale
        if (lower >= 'a' && lower <= 'z') name += lower;
    }
    name += '|';
    for (const Unit& known : kUnits) {
        if (known.names.find(name) != known.names.npos) return known.metres;
    }
    // Other names, such as "feet (international)" and "US survey ft".
    if (name.find("survey") != name.npos) return kSurveyFoot;
    if (name.find("foot") != name.npos || name.find("feet") != name.npos) return kFoot;
    return {};
}

// The number of samples that GDAL's warper fits into a length.
double samples_across(double length, double step) {
    return std::floor(length / step + 0.5);
}

}  // namespace

Raster::Raster(const std::filesystem::path& path, std::optional<double> cell, Continue should_continue)
    : path_(path), name_(fmt::format("'{}'", path.string())), should_continue_(std::move(should_continue)) {
    static std::once_flag registered;
    std::call_once(registered, GDALAllRegister);
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(path, error);
    if (status.type() == std::filesystem::file_type::not_found)
        throw IoError(fmt::format("{}: there is no such file", name_));
    if (error) throw IoError(fmt::format("cannot open {}: {}", name_, error.message()));
    if (!std::filesystem::is_regular_file(status))
        throw InputError(fmt::format("{}: is not a regular file", name_));

    const QuietErrors errors;
    open();

    PixelGrid grid;
    georeferenced_ = read_grid(dataset_, grid);
    const std::array<double, 6>& g = grid.transform;
    if (!georeferenced_) {
        if (!cell)
            throw GeometryError(fmt::format(
                "{}: has no georeference; give the distance between its samples with options.cell, in metres",
                name_));
        grid.transform = {-*cell / 2, *cell, 0, -*cell / 2, 0, -*cell};
    } else if (grid.reference == nullptr) {
        has_coordinate_system_ = false;
        warnings_.push_back(
            "the raster does not name its coordinate system; its coordinates are assumed to be metres");
    }
    const bool degrees = grid.reference != nullptr && OSRIsGeographic(grid.reference);
    const bool rotated = g[2] != 0 || g[4] != 0 || g[1] < 0 || g[5] > 0;
    const PixelGrid source = grid;
    if (georeferenced_ && (degrees || rotated || cell)) {
        project(degrees ? zone_of(grid, name_) : "", cell);
        read_grid(dataset_, grid);
    }
    projection_ = projection_name(grid.reference);
    if (georeferenced_ && grid.reference != nullptr)
        warn_of_distortion(length_distortion(source, grid.reference));

    // Without a georeference, the steps are options.cell, in metres whatever the unit of the coordinates.
    const double unit =
        georeferenced_ && grid.reference != nullptr ? OSRGetLinearUnits(grid.reference, nullptr) : 1;
    columns_ = grid.columns;
    rows_ = grid.rows;
    east_step_ = g[1] * unit;
    north_step_ = -g[5] * unit;
    west_ = (g[0] + g[1] / 2) * unit;
    south_ = (g[3] + g[5] * (static_cast<double>(rows_) - 0.5)) * unit;
}

void Raster::warn_of_distortion(double distortion) {
    constexpr double kMost = 1.05;
    if (distortion < kMost && distortion > 1 / kMost) return;
    warnings_.push_back(
        fmt::format("horizontal lengths in the projection '{}' are {:.3g} times the true ones in places, but "
                    "heights are true: project the raster, or a smaller part of it, to one that suits its "
                    "region (gdalwarp -t_srs, -te)",
                    projection_, distortion));
}

void Raster::open() {
    const QuietErrors errors;
    source_.reset(GDALOpenEx(path_.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, kDrivers, nullptr, nullptr));
    if (!source_) {
        const std::string message = errors.message();
        throw InputError(
            fmt::format("{}: cannot be read as an elevation raster (GeoTIFF, USGS DEM, SRTM .hgt, "
                        "DTED, Arc/Info ASCII grid, ERDAS Imagine, PNG){}{}",
                        name_, message.empty() ? "" : ": ", message));
    }
    dataset_ = source_.get();
    if (GDALGetRasterCount(dataset_) != 1) {
        throw InputError(fmt::format(
            "{}: has {} bands, but a raster of heights has one: extract it first (gdal_translate -b 1)",
            name_, GDALGetRasterCount(dataset_)));
    }
    format_ = GDALGetDriverShortName(GDALGetDatasetDriver(dataset_));
    const GDALRasterBandH band = GDALGetRasterBand(dataset_, 1);
    if (GDALGetRasterColorInterpretation(band) == GCI_PaletteIndex) {
        throw InputError(fmt::format(
            "{}: has a colour table, so its values are numbers of colours: if these are greys that stand for "
            "heights, expand them first (gdal_translate -expand gray); if the values are heights after all, "
            "name them so (-colorinterp gray)",
            name_));
    }
    const std::string unit = GDALGetRasterUnitType(band);
    const OGRSpatialReferenceH reference = GDALGetSpatialRef(dataset_);
    const std::optional<double> metres = metres_of(unit);
    height_unit_ = metres.value_or(1);
    if (unit.empty() && reference != nullptr && OSRIsCompound(reference))
        height_unit_ = OSRGetTargetLinearUnits(reference, "VERT_CS", nullptr);
    if (unit.empty() && reference != nullptr && !OSRIsCompound(reference) && OSRIsProjected(reference) &&
        std::abs(OSRGetLinearUnits(reference, nullptr) - 1) > 1e-9)
        warnings_.push_back(fmt::format(
            "the raster's heights state no unit and are assumed to be metres, but its coordinates are in "
            "units of {:g} m; if the heights are in them too, multiply options.exaggerate by {:g}",
            OSRGetLinearUnits(reference, nullptr), OSRGetLinearUnits(reference, nullptr)));
    if (!metres && !unit.empty())
        warnings_.push_back(fmt::format(
            "the raster's heights are in an unknown unit, '{}'; they are assumed to be metres", unit));
    height_scale_ = GDALGetRasterScale(band, nullptr);
    height_offset_ = GDALGetRasterOffset(band, nullptr);
}

// Opens the file through GDAL's warper, which computes only the rows that are read.
void Raster::project(const std::string& to, std::optional<double> cell) {
    // Heights stay in the file's unit, and no overview takes the place of samples.
    std::vector<std::string> words{"-of", "VRT",       "-ot",  "Float64", "-dstnodata",
                                   "nan", "-novshift", "-ovr", "NONE"};
    const auto add = [&](std::initializer_list<std::string> more) { words.insert(words.end(), more); };
    if (!to.empty()) add({"-t_srs", to});
    // Samples are averaged if they become fewer along both axes, else interpolated: an average within one
    // sample would make steps. GDAL's interpolation skips no sample where they become fewer along one axis.
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
    if (!cell) return;

    std::array<double, 6> own{};
    GDALGetGeoTransform(dataset_, own.data());
    const OGRSpatialReferenceH reference = GDALGetSpatialRef(dataset_);
    const double step = *cell / (reference != nullptr ? OSRGetLinearUnits(reference, nullptr) : 1);
    const double columns = samples_across(own[1] * GDALGetRasterXSize(dataset_), step);
    const double rows = samples_across(-own[5] * GDALGetRasterYSize(dataset_), step);
    if (columns < 2 || rows < 2)
        throw OptionError(fmt::format(
            "{}: with {:g} m between samples there are {:.0f} x {:.0f} of them, but a terrain needs 2 x 2: "
            "give a smaller options.cell; the raster's own is {:.4g} m",
            name_, *cell, columns, rows, own[1] * *cell / step));
    if (columns * rows > kMostSamples)
        throw LimitError(fmt::format(
            "{}: with {:g} m between samples there are {:.0f} x {:.0f} of them, but a surface has "
            "at most 2^32 - 1 points: give a larger options.cell; the raster's own is {:.4g} m",
            name_, *cell, columns, rows, own[1] * *cell / step));
    // The spacing of the file's own samples, since a projected raster has square cells.
    const double along_x = own[1] * GDALGetRasterXSize(dataset_) / GDALGetRasterXSize(source_.get());
    const double along_y = -own[5] * GDALGetRasterYSize(dataset_) / GDALGetRasterYSize(source_.get());
    if (step > std::max(along_x, along_y)) words.back() = "average";
    const std::string text = fmt::format("{:.17g}", step);
    add({"-tr", text, text});
    warp();
}

void Raster::read(std::int64_t first, std::int64_t count, double* heights) const {
    constexpr std::int64_t kTile = 4096;  // columns at a time, so that a wide raster can be cancelled
    const QuietErrors errors;
    const GDALRasterBandH band = GDALGetRasterBand(dataset_, 1);
    const int height = static_cast<int>(count);
    const int top = static_cast<int>(rows_ - first - count);  // GDAL numbers rows from the north
    std::vector<unsigned char> known(static_cast<std::size_t>(columns_ * count));
    struct Cancellation {
        const Continue& should_continue;
        bool stopped = false;

        bool continues() { return !stopped && !(stopped = should_continue && !should_continue()); }
    } cancellation{should_continue_};
    GDALRasterIOExtraArg arguments;
    INIT_RASTERIO_EXTRA_ARG(arguments);
    arguments.pProgressData = &cancellation;
    arguments.pfnProgress = [](double, const char*, void* data) {
        return static_cast<int>(static_cast<Cancellation*>(data)->continues());
    };
    const auto read_tile = [&](GDALRasterBandH from, std::int64_t west, auto* to, GDALDataType type) {
        const auto width = static_cast<int>(std::min(kTile, columns_ - west));
        const auto row_bytes = static_cast<GSpacing>(columns_) * static_cast<GSpacing>(sizeof *to);
        return GDALRasterIOEx(from, GF_Read, static_cast<int>(west), top, width, height, to + west, width,
                              height, type, 0, row_bytes, &arguments) == CE_None;
    };
    for (std::int64_t west = 0; west < columns_; west += kTile) {
        if (cancellation.continues() && read_tile(band, west, heights, GDT_Float64) &&
            read_tile(GDALGetMaskBand(band), west, known.data(), GDT_Byte))
            continue;
        if (cancellation.stopped) throw Cancelled();
        throw IoError(fmt::format("{}: cannot be read: {}", name_, errors.message()));
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

}  // namespace marrow::internal::terrain
