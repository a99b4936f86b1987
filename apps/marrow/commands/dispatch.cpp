// Declares all commands and runs the one that the command line names.
#include "dispatch.h"

#include <fmt/format.h>

#include <marrow/tissue_presets.h>

#include "check.h"
#include "devices.h"
#include "info.h"
#include "report.h"
#include "surfaces.h"
#include "sweep.h"

namespace marrow::apps {
namespace {

std::string preset_list() {
    std::string list;
    for (const Preset& preset : kPresets)
        list += fmt::format("{}{} >= {:g}", list.empty() ? "" : ", ", preset.name, preset.lowest);
    return list;
}

constexpr const char* kUsageAndExamples =
    "marrow INPUT -o OUT --isovalue N [OPTIONS]\n"
    "       marrow COMMAND [OPTIONS] ...\n"
    "\n"
    "Examples:\n"
    "  marrow scan/ -o skull.stl --type bone --largest        the skull in a CT\n"
    "  marrow mri.nii.gz -o head.ply --isovalue otsu --smooth 20 --triangles 100000\n"
    "  marrow segmentation.nrrd --labels names.ctbl -o organs.glb";

std::string main_footer() {
    return fmt::format(
        "'marrow help COMMAND' prints the options of a command.\n"
        "Presets in Hounsfield units: {}.\n"
        "For several surfaces, repeat --isovalue or --type. OUT is then a .3mf, .glb, .vtp or .obj file, a\n"
        "folder, or a pattern with {{name}}.\n"
        "The order of the steps does not depend on the order of the options: crop, median, blur, isotropic;\n"
        "extract; components, smooth, reduce (keep, triangles, max-error); write, verify.\n"
        "To find a good isovalue, see marrow sweep --help.\n{}",
        preset_list(), kExitCodesHelp);
}

// The options of all commands, as one command line sets them.
struct AllOptions {
    SurfacesOptions surfaces;
    InfoCommandOptions info;
    CheckCommandOptions check;
    SweepCommandOptions sweep;
    DevicesCommandOptions devices;
};

ExitCode read_and_run(int argc, const char* const* argv, const Console& console,
                      const std::atomic<bool>& stop) {
    AllOptions options;
    Arguments arguments("marrow",
                        {"Turns CT and MRI scans into surfaces.", kUsageAndExamples, main_footer()});
    add_options(arguments, options.surfaces);
    Arguments& info = arguments.add_command(
        "info",
        {"Say what is in scans: which series would be read and why, what is wrong with them, the range "
         "of the values and the bounds.",
         "marrow info [OPTIONS] INPUT...", kExitCodesHelp});
    add_options(info, options.info);
    Arguments& check = arguments.add_command(
        "check",
        {"Say whether meshes are fit to print: closed, manifold, oriented, and free of other faults.",
         "marrow check [OPTIONS] MESH...", kExitCodesHelp});
    add_options(check, options.check);
    Arguments& sweep = arguments.add_command(
        "sweep", {"Measure the closed surfaces at many isovalues: volume, area, components and triangles.",
                  "marrow sweep [OPTIONS] INPUT", std::string(kSweepHelp) + kExitCodesHelp});
    add_options(sweep, options.sweep);
    Arguments& devices =
        arguments.add_command("devices", {"List the GPUs and other devices of Vulkan that --device can name.",
                                          "marrow devices [OPTIONS]", kExitCodesHelp});
    add_options(devices, options.devices);
    arguments.add_program("terrain", "Turn an elevation raster into a surface: marrow terrain DEM -o OUT.");
    arguments.add_program("view",
                          "Look at a scan, find its isovalue, measure and export: marrow view INPUT.");

    if (!arguments.parse(argc, argv, console.out)) return kOk;
    if (info.is_chosen()) return run(options.info, console, stop);
    if (check.is_chosen()) return run(options.check, console, stop);
    if (sweep.is_chosen())
        run(options.sweep, console, stop);
    else if (devices.is_chosen())
        run(options.devices, console);
    else
        run(arguments, options.surfaces, console, stop);
    return kOk;
}

}  // namespace

int run_marrow(int argc, const char* const* argv, const Console& console, const std::atomic<bool>& stop) {
    return exit_code_of(
        console, [&] { return read_and_run(argc, argv, console, stop); },
        error_printer(argc, argv, console.out));
}

}  // namespace marrow::apps
