// Estimates file sizes and composes command lines.
#include "export_formats.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <marrow/tissue_presets.h>

namespace marrow::viewer {
namespace {

// The shortest text that is read back as this number.
std::string number_text(double value) {
    char text[40];
    return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

// The option of the command line that selects the isovalue.
struct IsovalueOption {
    const char* option;
    std::string value;
    const Preset* preset;
};

IsovalueOption isovalue_option(const Scan& scan, const Parameters& parameters,
                               const SurfaceParameters& surface) {
    const auto preset = std::find_if(kPresets.begin(), kPresets.end(),
                                     [&](const Preset& p) { return p.isovalue() == surface.isovalue; });
    if (scan.hounsfield && preset != kPresets.end()) return {"--type", std::string(preset->name), &*preset};
    // With --crop, the command line computes Otsu's isovalue from the cropped samples.
    if (scan.otsu && *scan.otsu == surface.isovalue && !parameters.crop)
        return {"--isovalue", "otsu", nullptr};
    return {"--isovalue", number_text(surface.isovalue), nullptr};
}

double digits(std::size_t n) {
    return std::floor(std::log10(static_cast<double>(std::max<std::size_t>(n, 1)))) + 1;
}

}  // namespace

std::optional<double> estimated_bytes(const std::string& extension, std::size_t points, std::size_t triangles,
                                      bool trust) {
    const auto p = static_cast<double>(points), t = static_cast<double>(triangles);
    const double numbers = trust ? 12 * p : 0, colours = trust ? 4 * p : 0;
    if (extension == ".stl") return 84 + 50 * t;
    if (extension == ".ply") return 300 + 24 * p + 13 * t + numbers;
    if (extension == ".vtp") return 1000 + 24 * p + 16 * t + numbers;
    if (extension == ".glb") return 1000 + 24 * p + 12 * t + colours;
    if (extension == ".obj")
        return 60 + 62 * p + t * (2 + 3 * (2 * digits(points) + 3));  // text, with indices of varying length
    return {};
}

QString size_text(double bytes) {
    if (bytes < 1e6) return QString::number(bytes / 1e3, 'f', bytes < 1e4 ? 1 : 0) + " kB";
    if (bytes < 1e9) return QString::number(bytes / 1e6, 'f', 1) + " MB";
    return QString::number(bytes / 1e9, 'f', 2) + " GB";
}

MeshObject export_object(const Scan& scan, const Parameters& parameters, const SurfaceParameters& surface,
                         const Mesh& mesh) {
    const IsovalueOption isovalue = isovalue_option(scan, parameters, surface);
    MeshObject object{mesh, isovalue.value};
    if (isovalue.preset) object.colour = isovalue.preset->colour;
    return object;
}

std::vector<std::string> command_arguments(const Scan& scan, const Parameters& parameters,
                                           const SurfaceParameters& surface,
                                           const std::filesystem::path& output, Space space) {
    std::vector<std::string> result{scan.input.string(), "-o", output.string()};
    const auto add = [&](const char* option, const std::string& value) {
        result.emplace_back(option);
        result.push_back(value);
    };
    const IsovalueOption isovalue = isovalue_option(scan, parameters, surface);
    add(isovalue.option, isovalue.value);
    if (parameters.crop) {
        std::string box = "vox:";
        for (std::size_t a = 0; a < 3; ++a)
            box.append(a > 0 ? "," : "")
                .append(std::to_string(parameters.crop->first[a]))
                .append(",")
                .append(std::to_string(parameters.crop->last[a]));
        add("--crop", box);
    }
    if (parameters.largest)
        result.emplace_back("--largest");
    else if (parameters.components > 0)
        add("--components", std::to_string(parameters.components));
    if (parameters.smooth > 0) add("--smooth", std::to_string(parameters.smooth));
    if (parameters.keep < 100) add("--keep", number_text(parameters.keep / 100.0));
    if (parameters.open) result.emplace_back("--open");
    if (parameters.topology) result.emplace_back("--topology");
    if (parameters.colouring != Colouring::own) result.emplace_back("--trust");
    if (space == Space::RAS) add("--space", "RAS");

    const ScanOptions& options = scan.options;
    if (options.series) add("--series", *options.series);
    if (options.spacing) {
        const Vec3d& s = *options.spacing;
        add("--spacing", number_text(s[0]) + "," + number_text(s[1]) + "," + number_text(s[2]));
    }
    if (options.resample) result.emplace_back("--resample");
    if (options.volume) add("--volume", std::to_string(*options.volume));
    if (options.level) add("--level", std::to_string(*options.level));
    return result;
}

QString shell_line(const std::vector<std::string>& arguments) {
    QString line = "marrow";
    for (const std::string& argument : arguments) {
        QString text = QString::fromStdString(argument);
        constexpr std::string_view kPlain =
            "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./,:=+@";
        if (argument.empty() || argument.find_first_not_of(kPlain) != std::string::npos)
            text = "'" + text.replace("'", "'\\''") + "'";
        line += " " + text;
    }
    return line;
}

QString file_name(const Scan& scan, const SurfaceParameters& surface, const std::string& extension) {
    QString name;
    for (const QChar c : surface_name(scan, surface).simplified())
        name += c.isLetterOrNumber() || c == '-' || c == '_' || c == '.' ? c : QChar('-');
    while (name.startsWith('.') || name.startsWith('-')) name.remove(0, 1);
    return (name.isEmpty() ? QString("surface") : name) + QString::fromStdString(extension);
}

}  // namespace marrow::viewer
