// Converts sessions to JSON and back.
#include "session_file.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string_view>

#include <nlohmann/json.hpp>

#include <marrow/atomic_file.h>
#include <marrow/error.h>

namespace marrow::viewer {
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr int kVersion = 1;
constexpr std::uintmax_t kMostBytes = 1 << 20;  // thousands of measurements
constexpr std::array kPlanes{"axial", "coronal", "sagittal"};
constexpr std::array kModes{"surface", "edges", "wireframe", "points"};
constexpr std::array kColourings{"surface", "shift", "noise"};

// Reads one value of the file. What is wrong with it is said by InputError, with its place.
[[noreturn]] void refuse(const std::string& place, const char* expected) {
    throw InputError(place + " is not " + expected);
}

const json& member(const json& object, const std::string& place, const char* name) {
    if (!object.is_object()) refuse(place.empty() ? "the file" : place, "a JSON object");
    const auto it = object.find(name);
    if (it == object.end()) throw InputError(place + (place.empty() ? "" : ".") + name + " is missing");
    return *it;
}

double number(const json& value, const std::string& place) {
    if (!value.is_number() || !std::isfinite(value.get<double>())) refuse(place, "a number");
    return value.get<double>();
}

std::int64_t integer(const json& value, const std::string& place) {
    if (!value.is_number_integer()) refuse(place, "a whole number");
    return value.get<std::int64_t>();
}

int within(const json& value, const std::string& place, int least, int most) {
    const std::int64_t number = integer(value, place);
    if (number < least || number > most) refuse(place, "in its range");
    return static_cast<int>(number);
}

bool flag(const json& value, const std::string& place) {
    if (!value.is_boolean()) refuse(place, "true or false");
    return value.get<bool>();
}

std::string text(const json& value, const std::string& place) {
    if (!value.is_string()) refuse(place, "a text");
    return value.get<std::string>();
}

const json& list(const json& value, const std::string& place, std::size_t least, std::size_t most) {
    if (!value.is_array() || value.size() < least || value.size() > most)
        refuse(place, "a list of this length");
    return value;
}

template <class Array, class Read>
Array triple(const json& value, const std::string& place, Read read) {
    list(value, place, 3, 3);
    return {read(value[0], place), read(value[1], place), read(value[2], place)};
}

Vec3d vector(const json& value, const std::string& place) {
    return triple<Vec3d>(value, place, number);
}

std::array<std::int64_t, 3> indices(const json& value, const std::string& place) {
    return triple<std::array<std::int64_t, 3>>(value, place, integer);
}

template <class Names>
std::size_t choice(const json& value, const std::string& place, const Names& names) {
    const std::string name = text(value, place);
    const auto it = std::find(names.begin(), names.end(), name);
    if (it == names.end()) refuse(place, "a known name");
    return static_cast<std::size_t>(it - names.begin());
}

template <class Optional, class Read>
void read_if_present(const json& object, const char* name, Optional& to, Read read) {
    const auto it = object.find(name);
    if (it != object.end()) to = read(*it, name);
}

json numbers(const Vec3d& v) {
    return {v[0], v[1], v[2]};
}

json to_json(const SurfaceParameters& surface) {
    return {{"name", surface.name.toStdString()},
            {"isovalue", surface.isovalue},
            {"colour", surface.colour.name().toStdString()},
            {"opacity", surface.opacity},
            {"visible", surface.visible}};
}

SurfaceParameters read_surface(const json& value, const std::string& place) {
    SurfaceParameters surface;
    surface.name = QString::fromStdString(text(member(value, place, "name"), place + ".name")).simplified();
    surface.isovalue = number(member(value, place, "isovalue"), place + ".isovalue");
    surface.colour = QColor(QString::fromStdString(text(member(value, place, "colour"), place + ".colour")));
    if (!surface.colour.isValid()) refuse(place + ".colour", "a colour such as #f2e8d5");
    surface.opacity = number(member(value, place, "opacity"), place + ".opacity");
    if (surface.opacity < 0 || surface.opacity > 1) refuse(place + ".opacity", "between 0 and 1");
    surface.visible = flag(member(value, place, "visible"), place + ".visible");
    return surface;
}

json scan_to_json(const SavedSession& session, const fs::path& folder) {
    const fs::path relative = session.scan.lexically_relative(folder);
    const bool inside = !relative.empty() && *relative.begin() != "..";
    json scan{{"path", (inside ? relative : session.scan).string()}, {"size", session.dims}};
    const ScanOptions& options = session.options;
    if (options.series) scan["series"] = *options.series;
    if (options.spacing) scan["spacing"] = numbers(*options.spacing);
    if (options.resample) scan["resample"] = true;
    if (options.volume) scan["volume"] = *options.volume;
    if (options.level) scan["level"] = *options.level;
    return scan;
}

void read_scan_section(const json& scan, const fs::path& folder, SavedSession& session) {
    session.scan = folder / text(member(scan, "scan", "path"), "scan.path");
    session.dims = indices(member(scan, "scan", "size"), "scan.size");
    read_if_present(scan, "series", session.options.series, text);
    read_if_present(scan, "spacing", session.options.spacing, vector);
    read_if_present(scan, "resample", session.options.resample, flag);
    read_if_present(scan, "volume", session.options.volume, integer);
    read_if_present(scan, "level", session.options.level, integer);
}

json parameters_to_json(const Parameters& p) {
    json surfaces = json::array(), measurements = json::array();
    std::size_t current = 0;
    for (std::size_t i = 0; i < p.surfaces.size(); ++i) {
        surfaces.push_back(to_json(p.surfaces[i]));
        if (p.surfaces[i].id == p.current) current = i;
    }
    for (const Measurement& m : p.measurements) {
        json points = json::array();
        for (const Vec3d& point : m.points) points.push_back(numbers(point));
        measurements.push_back(points);
    }
    json result{{"surfaces", surfaces},
                {"current", current},
                {"largest", p.largest},
                {"components", p.components},
                {"smooth", p.smooth},
                {"keep", p.keep},
                {"open", p.open},
                {"topology", p.topology},
                {"cut", {{"flipped", p.cut.flipped}}},
                {"draw", kModes[static_cast<std::size_t>(p.mode)]},
                {"colour_by", kColourings[static_cast<std::size_t>(p.colouring)]},
                {"window", {{"level", p.window.centre}, {"width", p.window.width}}},
                {"measurements", measurements}};
    if (p.cut.plane) result["cut"]["plane"] = kPlanes[static_cast<std::size_t>(*p.cut.plane)];
    if (p.crop) result["crop"] = {{"first", p.crop->first}, {"last", p.crop->last}};
    return result;
}

Parameters read_parameters(const json& root) {
    Parameters p;
    constexpr std::size_t kMostMeasurements = 10000;
    for (const json& surface : list(member(root, "", "surfaces"), "surfaces", 1, Parameters::kMostSurfaces)) {
        const auto place = static_cast<int>(p.surfaces.size());
        p.surfaces.push_back(read_surface(surface, "surfaces[" + std::to_string(place) + "]"));
        p.surfaces.back().id = place;
    }
    p.current = static_cast<int>(
        std::clamp<std::int64_t>(integer(member(root, "", "current"), "current"), 0, p.surfaces.size() - 1));
    p.largest = flag(member(root, "", "largest"), "largest");
    p.components = within(member(root, "", "components"), "components", 0, Parameters::kMostComponents);
    p.smooth = within(member(root, "", "smooth"), "smooth", 0, Parameters::kMostSmoothing);
    p.keep = within(member(root, "", "keep"), "keep", 1, 100);
    p.open = flag(member(root, "", "open"), "open");
    read_if_present(root, "topology", p.topology, flag);  // older sessions do not have it
    const json& cut = member(root, "", "cut");
    p.cut.flipped = flag(member(cut, "cut", "flipped"), "cut.flipped");
    if (cut.contains("plane")) p.cut.plane = Plane(choice(cut["plane"], "cut.plane", kPlanes));
    p.mode = DrawMode(choice(member(root, "", "draw"), "draw", kModes));
    read_if_present(root, "colour_by", p.colouring, [](const json& value, const std::string& place) {
        return Colouring(choice(value, place, kColourings));
    });
    const json& window = member(root, "", "window");
    p.window = {number(member(window, "window", "level"), "window.level"),
                number(member(window, "window", "width"), "window.width")};
    if (p.window.width <= 0) refuse("window.width", "above 0");
    for (const json& points : list(member(root, "", "measurements"), "measurements", 0, kMostMeasurements)) {
        Measurement measurement;
        for (const json& point : list(points, "measurements", 2, 3))
            measurement.points.push_back(vector(point, "measurements"));
        p.measurements.push_back(measurement);
    }
    if (root.contains("crop"))
        p.crop = SampleBox{indices(member(root["crop"], "crop", "first"), "crop.first"),
                           indices(member(root["crop"], "crop", "last"), "crop.last")};
    return p;
}

CameraState read_camera(const json& value, const std::string& place) {
    CameraState camera{vector(member(value, place, "position"), place + ".position"),
                       vector(member(value, place, "focal_point"), place + ".focal_point"),
                       vector(member(value, place, "up"), place + ".up")};
    const Vec3d direction = camera.focal_point - camera.position;
    if (length(cross(direction, camera.up)) <= 1e-9 * length(direction) * length(camera.up))
        refuse(place, "a camera that looks somewhere, with another direction up");
    return camera;
}

SavedSession read_root(const json& root, const fs::path& folder) {
    if (integer(member(root, "", "marrow_session"), "marrow_session") != kVersion)
        throw InputError("this version of the viewer reads only sessions of version " +
                         std::to_string(kVersion));
    SavedSession session;
    read_scan_section(member(root, "", "scan"), folder, session);
    session.parameters = read_parameters(root);
    session.crosshair = vector(member(root, "", "crosshair"), "crosshair");
    read_if_present(root, "camera", session.camera, read_camera);
    return session;
}

// Only what can be read again.
std::string content_of(const json& root) {
    try {
        std::string content = root.dump(2, ' ') + "\n";
        if (content.size() > kMostBytes) throw InputError("it would be too large to be opened");
        read_root(root, {});
        return content;
    } catch (const json::type_error&) {
        throw InputError("the session cannot be saved: the path of the scan is not UTF-8, rename it");
    } catch (const InputError& fault) {
        throw InputError(std::string("the session cannot be saved: ") + fault.what());
    }
}

}  // namespace

bool is_session_file(const fs::path& file) {
    return file.extension() == kSessionExtension;
}

void write_session(const SavedSession& session, const fs::path& file) {
    json root{{"marrow_session", kVersion},
              {"scan", scan_to_json(session, absolute_path(file).parent_path())},
              {"crosshair", numbers(session.crosshair)}};
    root.update(parameters_to_json(session.parameters));
    if (session.camera)
        root["camera"] = {{"position", numbers(session.camera->position)},
                          {"focal_point", numbers(session.camera->focal_point)},
                          {"up", numbers(session.camera->up)}};
    const std::string content = content_of(root);
    AtomicFile out(file);
    out.write(content.data(), content.size());
    out.commit();
}

SavedSession read_session(const fs::path& file) {
    const std::string name = std::string("'").append(file.string()).append("': ");
    std::error_code error;
    const std::uintmax_t bytes = fs::file_size(file, error);
    if (error) throw IoError(name + error.message());
    if (bytes > kMostBytes) throw InputError(name + "too large for a session file");
    std::ifstream in(file, std::ios::binary);
    std::string content(static_cast<std::size_t>(bytes), '\0');
    if (!in.read(content.data(), static_cast<std::streamsize>(bytes))) throw IoError(name + "cannot be read");
    const json root = json::parse(content, nullptr, false);
    if (root.is_discarded()) throw InputError(name + "not a session file: it is not JSON");
    try {
        return read_root(root, absolute_path(file).parent_path());
    } catch (const InputError& fault) {
        throw InputError(name + fault.what());
    }
}

void check_session(const SavedSession& session, const Scan& scan) {
    const auto& dims = scan.volume.geometry().dims;
    if (session.dims != dims)
        throw InputError("the session is of another scan: '" + session.scan.string() +
                         "' has changed its size since");
    if (!session.parameters.crop) return;
    for (std::size_t a = 0; a < 3; ++a) {
        const std::int64_t first = session.parameters.crop->first[a], last = session.parameters.crop->last[a];
        if (first < 0 || first > last || last >= dims[a])
            throw InputError("the crop box of the session is not inside its scan");
    }
}

}  // namespace marrow::viewer
