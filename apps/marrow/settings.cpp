#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <ostream>
#include <set>
#include <string_view>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include <marrow/version.h>

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

// N numbers with commas between; nothing where they are not.
template <std::size_t N>
std::optional<std::array<double, N>> parse_numbers(std::string_view text) {
    std::array<double, N> numbers{};
    for (std::size_t i = 0; i < N; ++i) {
        const std::size_t comma = i + 1 < N ? text.find(',') : text.size();
        const auto value = comma == text.npos ? std::nullopt : parse_number(text.substr(0, comma));
        if (!value) return {};
        numbers[i] = *value;
        text.remove_prefix(std::min(comma + 1, text.size()));
    }
    return numbers;
}

Vec3d parse_spacing(std::string_view text) {
    const auto spacing = parse_numbers<3>(text);
    if (!spacing || *std::min_element(spacing->begin(), spacing->end()) <= 0)
        throw UsageError(fmt::format("--spacing takes three positive numbers in mm, X,Y,Z, not '{}'", text));
    return {(*spacing)[0], (*spacing)[1], (*spacing)[2]};
}

// In mm, or behind "vox:" in samples.
void parse_crop(std::string_view text, Space space, Steps& steps) {
    constexpr std::string_view kSamples = "vox:";
    steps.crop_in_samples = text.starts_with(kSamples);
    const auto ends = parse_numbers<6>(steps.crop_in_samples ? text.substr(kSamples.size()) : text);
    if (!ends || (*ends)[0] > (*ends)[1] || (*ends)[2] > (*ends)[3] || (*ends)[4] > (*ends)[5])
        throw UsageError(
            fmt::format("--crop takes X0,X1,Y0,Y1,Z0,Z1 in mm, or vox:X0,X1,Y0,Y1,Z0,Z1 in samples, each X0 "
                        "<= X1, not '{}'",
                        text));
    const auto& e = *ends;
    if (steps.crop_in_samples) {
        for (const double end : e) {
            if (end != std::floor(end) || std::abs(end) > 1e9)
                throw UsageError(fmt::format("--crop vox: takes whole numbers, not '{}'", text));
        }
    }
    steps.crop = Box{{e[0], e[2], e[4]}, {e[1], e[3], e[5]}};
    steps.crop_in_ras = space == Space::RAS;
    if (!steps.crop_in_samples && steps.crop_in_ras)
        steps.crop = Box{{-e[1], -e[3], e[4]}, {-e[0], -e[2], e[5]}};
}

void check_steps(const Steps& steps) {
    const auto refuse = [](const char* why) { throw UsageError(why); };
    if (steps.median < 0 || steps.median > 16) refuse("--median takes a radius from 1 to 16 samples");
    if (!(steps.blur >= 0)) refuse("--blur takes a standard deviation in mm");
    if (!(steps.isotropic >= 0)) refuse("--isotropic takes a spacing in mm");
    if (steps.components.count < 0) refuse("--components takes a number from 1 upwards");
    if (!(steps.components.min_volume >= 0)) refuse("--clean-small takes a volume in mm3");
    if (steps.smooth < 0 || steps.smooth > 1000) refuse("--smooth takes a number from 1 to 1000");
    if (steps.smooth_bound && steps.smooth == 0) refuse("--smooth-bound goes with --smooth N");
    if (steps.keep && !(*steps.keep > 0 && *steps.keep <= 1)) refuse("--keep takes a fraction, above 0 to 1");
    if (steps.triangles && *steps.triangles < 1) refuse("--triangles takes a number from 1 upwards");
    if (steps.max_error && !(*steps.max_error > 0)) refuse("--max-error takes a distance in mm");
    if (steps.keep && steps.triangles) refuse("--keep and --triangles say the same twice: give one");
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

// Whether that can be written, in this space.
void check_format(const Settings& settings, const fs::path& output) {
    try {
        if (mesh_format(output) == MeshFormat::glb && settings.space != Space::LPS)
            throw UsageError("--space does not go with .glb, which has axes of its own");
    } catch (const InputError& error) {
        throw UsageError(error.what());
    }
}

SweepSettings check_sweep(SweepSettings sweep, const std::string& from, const std::string& to,
                          const fs::path& output) {
    const auto number = [](const char* option, const std::string& text) -> std::optional<double> {
        if (text.empty()) return {};
        const auto value = parse_number(text);
        if (!value) throw UsageError(fmt::format("{} takes a finite number, not '{}'", option, text));
        return value;
    };
    sweep.from = number("--from", from);
    sweep.to = number("--to", to);
    if (sweep.from && sweep.to && !(*sweep.from < *sweep.to)) throw UsageError("--from must be below --to");
    if (sweep.samples < 2 || sweep.samples > 100'000) throw UsageError("-n takes a number from 2 to 100000");
    if (!output.empty() && output.extension() != ".csv" && output.extension() != ".json")
        throw UsageError(fmt::format("sweep writes .csv or .json, not '{}'", output.string()));
    if (!sweep.plot.empty() && sweep.plot.extension() != ".svg")
        throw UsageError(fmt::format("--plot writes .svg, not '{}'", sweep.plot.string()));
    return sweep;
}

constexpr const char* kExitCodes =
    "Exit codes: 0 ok, 2 usage, 3 unreadable or not writable, 4 ambiguous or refused geometry,\n"
    "5 empty surface, 6 a check failed, 130 cancelled.\n"
    "For research use only; not a medical device.";

std::string preset_list() {
    std::string list;
    for (const Preset& preset : kPresets)
        list += fmt::format("{}{} >= {:g}", list.empty() ? "" : ", ", preset.name, preset.lowest);
    return list;
}

std::string footer() {
    return fmt::format(
        "Presets in Hounsfield units: {}.\n"
        "Two surfaces of a scan: repeat --isovalue or --type; OUT is then .3mf, .glb, .vtp or .obj, which "
        "hold\n"
        "several, or a folder or a pattern with {{name}}.\n"
        "Order of the steps, whatever that of the options: crop, median, blur, isotropic; extract; "
        "components,\n"
        "smooth, reduce (keep, triangles, max-error); write, verify.\n"
        "Which isovalue to trust: see marrow sweep --help.\n{}",
        preset_list(), kExitCodes);
}

}  // namespace

std::variant<Settings, int> parse_command_line(int argc, const char* const* argv, std::ostream& out) {
    Settings settings;
    std::vector<std::string> isovalues, types;
    std::string spacing, space = "LPS", max_memory, crop;

    CLI::App app("Turns CT and MRI scans into surfaces.", "marrow");
    app.set_version_flag("--version", "marrow " MARROW_VERSION);
    app.footer(footer());
    const char* input_help =
        "DICOM folder or file; NIfTI, NRRD, MetaImage or TIFF file; folder of slice images";
    app.add_option("INPUT", settings.inputs, input_help)->expected(1);
    app.add_option("-o,--output", settings.output,
                   "mesh to write: .stl, .ply, .obj (also .gz), .vtp, .3mf or .glb")
        ->type_name("OUT");
    app.add_option("--isovalue", isovalues,
                   "surface where samples reach N, or 'otsu' to choose N from the samples")
        ->type_name("N|otsu")
        ->allow_extra_args(false);
    app.add_option("--type", types, "surface of a tissue in CT: bone, skin, soft, fat or muscle")
        ->type_name("TYPE")
        ->allow_extra_args(false);
    CLI::Option* labels =
        app.add_option("--labels", settings.label_table,
                       "INPUT is a label map: a surface for each label; TABLE has names and colours "
                       "(3D Slicer, ITK-SNAP or plain)")
            ->type_name("[TABLE]")
            ->expected(0, 1);
    app.add_option("--relax", settings.relax,
                   "passes that smooth the surfaces of labels; 0: none; default: 40")
        ->type_name("N")
        ->needs(labels);
    app.add_option("--only", settings.only, "of the labels, those of these numbers or names")
        ->type_name("LABEL[,LABEL]")
        ->needs(labels);
    app.add_option("--picture", settings.picture, "picture of the surfaces to write")->type_name("FILE.png");
    const auto add_scan_options = [&](CLI::App& to) {
        to.add_option("--series", settings.series, "DICOM series to read, as 'marrow info' lists it")
            ->type_name("UID");
        to.add_option("--spacing", spacing, "mm between samples, for images that do not say")
            ->type_name("X,Y,Z");
        to.add_flag("--resample", settings.resample,
                    "make uneven DICOM slices even, by linear interpolation");
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
    app.add_option(
           "--snap", settings.snap,
           "fewer points and no slivers: join points round samples that the surface comes within this part "
           "of an edge of; 0 <= T < 0.5, 0: off (default), 0.3 is a good value")
        ->type_name("T");
    Steps& steps = settings.steps;
    app.add_option(
           "--crop", crop,
           "keep the part of the scan in a box, in mm along the patient's axes (those of --space), or with "
           "vox: before in samples, both ends included; an oblique scan keeps the block that holds the box")
        ->type_name("X0,X1,Y0,Y1,Z0,Z1");
    app.add_option("--median", steps.median,
                   "median of the scan, N samples to every side: takes off specks of noise")
        ->type_name("N");
    app.add_option("--blur", steps.blur, "blur the scan by a Gaussian of standard deviation MM")
        ->type_name("MM");
    app.add_option("--isotropic", steps.isotropic,
                   "resample the scan to MM between samples along all axes, for thick slices")
        ->type_name("MM");
    app.add_flag("--largest", steps.largest,
                 "keep only the largest connected piece, as --components 1 --no-cavities");
    app.add_option("--components", steps.components.count, "keep the N pieces with the most triangles")
        ->type_name("N");
    app.add_option("--clean-small", steps.components.min_volume,
                   "drop pieces and fill cavities that enclose less than MM3")
        ->type_name("MM3");
    bool no_cavities = false;
    app.add_flag("--no-cavities", no_cavities, "fill all hollows: drop the shells inside");
    app.add_option("--smooth", steps.smooth,
                   "smooth the surface without shrinking it, N steps of a windowed sinc filter (20 is usual)")
        ->type_name("N");
    app.add_flag("--smooth-bound", steps.smooth_bound,
                 "with --smooth: no point moves further than half a sample along each axis of the scan");
    app.add_option("--keep", steps.keep, "reduce to this fraction of the triangles")->type_name("FRACTION");
    app.add_option("--triangles", steps.triangles, "reduce to at most N triangles")->type_name("N");
    app.add_option("--max-error", steps.max_error,
                   "reduce as far as the surface stays within MM of what it was, as measured")
        ->type_name("MM");
    app.add_flag("--verify", settings.verify, "read what was written and compare every triangle");
    app.add_flag("-q,--quiet", settings.quiet, "print errors only (and JSON, if asked for)");
    app.add_flag("-v,--verbose", settings.verbose, "say how long each stage took");

    CLI::App* info = app.add_subcommand(
        "info", "Say what is in scans: which series would be read and why, and what is wrong with them.");
    info->footer(kExitCodes);
    info->add_option("INPUT", settings.inputs, input_help)->required();
    add_scan_options(*info);
    info->add_flag("--show-patient", settings.show_patient, "print patients' names");

    CLI::App* check = app.add_subcommand(
        "check", "Say whether meshes are fit to print: closed, manifold, oriented, and what else is wrong.");
    check->footer(kExitCodes);
    check
        ->add_option("MESH", settings.inputs,
                     ".stl, .ply, .obj (also .gz), .vtp or .3mf, in mm; .glb, in metres")
        ->required();
    check->add_option("--min-wall", settings.min_wall, "look for walls thinner than MM")->type_name("MM");
    check->add_flag("--strict", settings.strict, "exit with 6 where a mesh is not sound");
    check->add_flag("--json", settings.json, "print the results as one JSON object");
    check->add_flag("-q,--quiet", settings.quiet, "print errors only (and JSON, if asked for)");

    SweepSettings sweep;
    std::string from, to;
    CLI::App* swept = app.add_subcommand(
        "sweep", "Measure the closed surfaces at many isovalues: volume, area, components and triangles.");
    swept->footer(std::string("Plateaus are stretches where the isovalue matters little: at least a fifth of "
                              "the scan's contrast\n"
                              "wide (that of the classes of 'otsu'), and the surface moves by less than half "
                              "a sample for each\n"
                              "such fifth (mm: change of volume over area).\n") +
                  kExitCodes);
    swept->add_option("INPUT", settings.inputs, input_help)->required()->expected(1);
    swept->add_option("--from", from, "first isovalue; default: the least sample")->type_name("A");
    swept->add_option("--to", to, "last isovalue; default: the largest sample")->type_name("B");
    swept->add_option("-n,--samples", sweep.samples, "isovalues, evenly from A to B; default: 100")
        ->type_name("N");
    swept->add_option("-o,--output", settings.output, "table to write: .csv or .json; else it is printed")
        ->type_name("OUT");
    swept->add_option("--plot", sweep.plot, "drawing to write")->type_name("FILE.svg");
    swept->add_option("--threads", settings.threads, "threads to use; 0: all (default)")->type_name("N");
    add_scan_options(*swept);
    swept->add_flag("-q,--quiet", settings.quiet, "print errors only (and JSON, if asked for)");
    swept->add_flag("-v,--verbose", settings.verbose, "say how long each stage took");

    // Programs of their own, which main() starts; here for the list of commands.
    CLI::App* terrain =
        app.add_subcommand("terrain", "Turn an elevation raster into a surface: marrow terrain DEM -o OUT.");
    CLI::App* view = app.add_subcommand(
        "view", "Look at a scan, find its isovalue, measure and export: marrow view INPUT.");
    for (CLI::App* other : {terrain, view}) other->allow_extras();

    try {
        app.parse(argc, argv);
        for (const CLI::App* other : {terrain, view}) {
            if (other->parsed())
                throw UsageError(fmt::format("'{0}' comes first: marrow {0} ...", other->get_name()));
        }
    } catch (const CLI::CallForHelp&) {
        out << app.help();
        return 0;
    } catch (const CLI::CallForVersion& version) {
        out << version.what() << '\n';
        return 0;
    } catch (const CLI::ParseError& error) {
        throw UsageError(fmt::format("{} (see marrow --help)", error.what()));
    }

    settings.info = info->parsed();
    settings.check = check->parsed();
    if (settings.check) {
        if (!(settings.min_wall >= 0)) throw UsageError("--min-wall takes a thickness in mm");
        return settings;
    }
    if (settings.inputs.empty()) throw UsageError("which scan? give a file or folder (see marrow --help)");
    if (!spacing.empty()) settings.spacing = parse_spacing(spacing);
    if (settings.info) return settings;
    if (settings.threads < 0) throw UsageError("--threads takes a number from 0 (all) upwards");
    if (swept->parsed()) {
        settings.sweep = check_sweep(std::move(sweep), from, to, settings.output);
        return settings;
    }

    if (settings.output.empty() && settings.picture.empty())
        throw UsageError(
            "where to? give -o OUT.stl (or .ply, .obj, .vtp, .3mf, .glb), --picture FILE.png, or both");
    for (const std::string& text : isovalues) settings.surfaces.push_back(parse_isovalue(text));
    for (const std::string& text : types) settings.surfaces.push_back(parse_type(text));
    settings.labels = labels->count() > 0;
    if (settings.surfaces.empty() && !settings.labels)
        throw UsageError("which surface? give --isovalue N, --isovalue otsu, or for CT --type bone");
    if (space != "LPS" && space != "RAS")
        throw UsageError(fmt::format("--space takes LPS or RAS, not '{}'", space));
    if (space == "RAS") settings.space = Space::RAS;
    if (!crop.empty()) parse_crop(crop, settings.space, steps);
    steps.components.cavities = !no_cavities;
    check_steps(steps);
    if (!settings.picture.empty() && settings.picture.extension() != ".png")
        throw UsageError(fmt::format("--picture writes .png, not '{}'", settings.picture.string()));
    if (!(settings.snap >= 0 && settings.snap < 0.5))
        throw UsageError(
            fmt::format("--snap takes a part of an edge, 0 <= T < 0.5, not {:g}", settings.snap));
    if (settings.labels) {
        if (!settings.surfaces.empty() || settings.open || settings.snap > 0 || !max_memory.empty() ||
            steps.median > 0 || steps.blur > 0 || steps.isotropic > 0 || steps.change_surface())
            throw UsageError(
                "--labels makes closed surfaces that meet: it goes with --relax, --only and --crop, and not "
                "with "
                "--isovalue, "
                "--type, --open, --snap, --max-memory or what else changes scan or surface");
        if (settings.relax < 0) throw UsageError("--relax takes a number from 0 upwards");
    }
    if (!max_memory.empty()) {
        settings.max_memory = parse_memory(max_memory);
        const bool plain = settings.surfaces.size() == 1 && settings.surfaces.front().isovalue;
        if (!plain || settings.output.empty() || !settings.picture.empty() || settings.verify ||
            settings.snap > 0 || steps.change_volume() || steps.change_surface())
            throw UsageError(
                "--max-memory never has the whole scan or surface: it goes with one --isovalue N and -o, and "
                "not with --type, --snap, --picture, --verify or what changes scan or surface");
    }
    if (settings.verify && settings.output.empty())
        throw UsageError("--verify reads what -o OUT writes: give -o");
    output_files(settings);  // so that a mistake shows before the work
    return settings;
}

std::vector<fs::path> output_files(const Settings& settings) {
    std::vector<std::string> names;
    for (const SurfaceRequest& surface : settings.surfaces) names.push_back(surface.name);
    // What they are, and whether there are several, is not known before the map is read.
    if (settings.labels) names = {std::string(kName)};
    return files_for(settings, names);
}

std::vector<fs::path> files_for(const Settings& settings, const std::vector<std::string>& names) {
    std::vector<fs::path> files(names.size());
    if (settings.output.empty()) return files;

    std::string pattern = settings.output.string();
    if (!settings.output.has_filename() || fs::is_directory(settings.output))
        pattern = (settings.output / "{name}.stl").string();
    const std::size_t at = pattern.find(kName);
    check_format(settings, pattern);
    if (at == pattern.npos) {
        if (files.size() > 1 && !holds_several(mesh_format(pattern)))
            throw UsageError(
                fmt::format("several surfaces do not fit in one file '{}': give a .3mf, .glb, .vtp or .obj, "
                            "a folder or a "
                            "pattern such as '{{name}}.stl'",
                            pattern));
        std::fill(files.begin(), files.end(), fs::path(pattern));
        return files;
    }
    for (std::size_t i = 0; i < files.size(); ++i) {
        std::string file = pattern;
        files[i] = file.replace(at, kName.size(), names[i]);
    }
    if (std::set<fs::path>(files.begin(), files.end()).size() < files.size())
        throw UsageError("two surfaces of the same name would be written to one file: ask for each once");
    return files;
}

ScanOptions scan_options(const Settings& settings) {
    ScanOptions options;
    if (!settings.series.empty()) options.series = settings.series;
    options.spacing = settings.spacing;
    options.resample = settings.resample;
    options.volume = settings.volume;
    options.threads = settings.threads;
    return options;
}

}  // namespace marrow
