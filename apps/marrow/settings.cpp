#include <charconv>
#include <cmath>
#include <ostream>
#include <set>
#include <string_view>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include "settings.h"

namespace marrow {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kName = "{name}";

// Does not depend on the locale, and takes all of the text or nothing.
std::optional<double> parse_number(std::string_view text) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return {};
    return value;
}

SurfaceRequest parse_isovalue(const std::string& text) {
    if (text == "otsu") return {text, {}, nullptr};
    const std::optional<double> value = parse_number(text);
    if (!value) throw UsageError(fmt::format("--isovalue takes a finite number or 'otsu', not '{}'", text));
    return {text, value, nullptr};
}

SurfaceRequest parse_type(const std::string& text) {
    const Preset* preset = find_preset(text);
    if (!preset)
        throw UsageError(fmt::format("--type takes bone, skin, soft, fat or muscle, not '{}'", text));
    return {text, {}, preset};
}

Vec3d parse_spacing(std::string_view text) {
    const std::string as_given(text);
    Vec3d spacing{};
    for (int axis = 0; axis < 3; ++axis) {
        const std::size_t comma = axis < 2 ? text.find(',') : text.size();
        const auto value = comma == text.npos ? std::nullopt : parse_number(text.substr(0, comma));
        if (!value || *value <= 0)
            throw UsageError(
                fmt::format("--spacing takes three positive numbers in mm, X,Y,Z, not '{}'", as_given));
        spacing[static_cast<std::size_t>(axis)] = *value;
        text.remove_prefix(std::min(comma + 1, text.size()));
    }
    return spacing;
}

// "800M", "1.5G" or bytes.
std::size_t parse_memory(const std::string& text) {
    double unit = 1;
    std::string_view number = text;
    if (!number.empty()) {
        const char last = number.back();
        if (last == 'K' || last == 'k') unit = 1024.0;
        if (last == 'M' || last == 'm') unit = 1024.0 * 1024;
        if (last == 'G' || last == 'g') unit = 1024.0 * 1024 * 1024;
        if (unit > 1) number.remove_suffix(1);
    }
    const std::optional<double> value = parse_number(number);
    if (!value || *value <= 0 || *value * unit > 1e18)
        throw UsageError(fmt::format("--max-memory takes a size such as 800M or 4G, not '{}'", text));
    return static_cast<std::size_t>(*value * unit);
}

std::string preset_list() {
    std::string list;
    for (const Preset& preset : kPresets)
        list += fmt::format("{}{} >= {:g}", list.empty() ? "" : ", ", preset.name, preset.isovalue);
    return list;
}

std::string footer() {
    return fmt::format(
        "Presets in Hounsfield units: {}.\n"
        "Two surfaces of a scan: repeat --isovalue or --type; OUT is then a folder or a pattern with "
        "{{name}}.\n"
        "Terrain from elevation rasters: see marrow terrain --help.\n"
        "To look at a scan and find the isovalue: marrow view INPUT.\n"
        "Exit codes: 0 ok, 2 usage, 3 unreadable or not writable, 4 ambiguous or refused geometry,\n"
        "5 empty surface, 130 cancelled.\n"
        "For research use only; not a medical device.",
        preset_list());
}

}  // namespace

std::variant<Settings, int> parse_command_line(int argc, const char* const* argv, std::ostream& out) {
    Settings settings;
    std::vector<std::string> isovalues, types;
    std::string spacing, space = "LPS", max_memory;

    CLI::App app("Turns CT and MRI scans into surfaces.", "marrow");
    app.set_version_flag("--version", "marrow " MARROW_VERSION);
    app.footer(footer());
    const char* input_help =
        "DICOM folder or file; NIfTI, NRRD, MetaImage or TIFF file; folder of slice images";
    app.add_option("INPUT", settings.inputs, input_help)->expected(1);
    app.add_option("-o,--output", settings.output, "mesh to write: .stl, .ply, .obj or .vtp")
        ->type_name("OUT");
    app.add_option("--isovalue", isovalues,
                   "surface where samples reach N, or 'otsu' to choose N from the samples")
        ->type_name("N|otsu")
        ->allow_extra_args(false);
    app.add_option("--type", types, "surface of a tissue in CT: bone, skin, soft, fat or muscle")
        ->type_name("TYPE")
        ->allow_extra_args(false);
    app.add_option("--picture", settings.picture, "picture of the surfaces to write")->type_name("FILE.png");
    const auto add_scan_options = [&](CLI::App& to) {
        to.add_option("--series", settings.series, "DICOM series to read, as 'marrow info' lists it")
            ->type_name("UID");
        to.add_option("--spacing", spacing, "mm between samples, for images that do not say")
            ->type_name("X,Y,Z");
        to.add_flag("--resample", settings.resample, "make uneven DICOM slices even, by linear interpolation");
        to.add_option("--volume", settings.volume, "volume of a 4D NIfTI or MetaImage file, counted from 0")
            ->type_name("K");
        to.add_flag("--json", settings.json, "print the results as one JSON object");
    };
    add_scan_options(app);
    app.add_option("--space", space, "axes of the written coordinates: LPS (default) or RAS")
        ->type_name("SPACE");
    app.add_option("--threads", settings.threads, "threads to use; 0: all (default)")->type_name("N");
    app.add_option("--max-memory", max_memory,
                   "read and write slab by slab within this much memory: uncompressed NRRD, MetaImage or "
                   "NIfTI to .stl or .ply, with --isovalue N")
        ->type_name("SIZE");
    app.add_flag("--open", settings.open, "leave the surface open where the scan ends");
    app.add_flag("--largest", settings.largest, "keep only the largest connected piece");
    app.add_flag("-q,--quiet", settings.quiet, "print errors only (and JSON, if asked for)");
    app.add_flag("-v,--verbose", settings.verbose, "say how long each stage took");

    CLI::App* info = app.add_subcommand(
        "info", "Say what is in scans: which series would be read and why, and what is wrong with them.");
    info->add_option("INPUT", settings.inputs, input_help)->required();
    add_scan_options(*info);
    info->add_flag("--show-patient", settings.show_patient, "print patients' names");

    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        out << (info->parsed() ? info : &app)->help();
        return 0;
    } catch (const CLI::CallForVersion& version) {
        out << version.what() << '\n';
        return 0;
    } catch (const CLI::ParseError& error) {
        throw UsageError(fmt::format("{} (see marrow --help)", error.what()));
    }

    settings.info = info->parsed();
    if (settings.inputs.empty()) throw UsageError("which scan? give a file or folder (see marrow --help)");
    if (!spacing.empty()) settings.spacing = parse_spacing(spacing);
    if (settings.info) return settings;

    if (settings.output.empty() && settings.picture.empty())
        throw UsageError("where to? give -o OUT.stl (or .ply, .obj, .vtp), --picture FILE.png, or both");
    for (const std::string& text : isovalues) settings.surfaces.push_back(parse_isovalue(text));
    for (const std::string& text : types) settings.surfaces.push_back(parse_type(text));
    if (settings.surfaces.empty())
        throw UsageError("which surface? give --isovalue N, --isovalue otsu, or for CT --type bone");
    if (space != "LPS" && space != "RAS")
        throw UsageError(fmt::format("--space takes LPS or RAS, not '{}'", space));
    if (space == "RAS") settings.space = Space::RAS;
    if (settings.threads < 0) throw UsageError("--threads takes a number from 0 (all) upwards");
    if (!settings.picture.empty() && settings.picture.extension() != ".png")
        throw UsageError(fmt::format("--picture writes .png, not '{}'", settings.picture.string()));
    if (!max_memory.empty()) {
        settings.max_memory = parse_memory(max_memory);
        const bool plain = settings.surfaces.size() == 1 && settings.surfaces.front().isovalue;
        if (!plain || settings.output.empty() || !settings.picture.empty() || settings.largest)
            throw UsageError(
                "--max-memory never has the whole surface: it goes with one --isovalue N and -o, and not "
                "with --type, --largest or --picture");
    }
    output_files(settings);  // so that a mistake shows before the work
    return settings;
}

std::vector<fs::path> output_files(const Settings& settings) {
    std::vector<fs::path> files(settings.surfaces.size());
    if (settings.output.empty()) return files;

    std::string pattern = settings.output.string();
    if (!settings.output.has_filename() || fs::is_directory(settings.output))
        pattern = (settings.output / "{name}.stl").string();
    const std::size_t at = pattern.find(kName);
    if (at == pattern.npos && files.size() > 1)
        throw UsageError(fmt::format(
            "several surfaces do not fit in one file '{}': give a folder or a pattern such as '{{name}}.stl'",
            pattern));

    for (std::size_t i = 0; i < files.size(); ++i) {
        std::string file = pattern;
        if (at != pattern.npos) file.replace(at, kName.size(), settings.surfaces[i].name);
        files[i] = file;
        try {
            mesh_format(files[i]);
        } catch (const InputError& error) {
            throw UsageError(error.what());
        }
    }
    if (std::set<fs::path>(files.begin(), files.end()).size() < files.size())
        throw UsageError("two surfaces of the same name would be written to one file: ask for each once");
    return files;
}

}  // namespace marrow
