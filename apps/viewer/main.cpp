// marrow-viewer: shows scans and the surfaces in them.
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include <QVTKOpenGLNativeWidget.h>
#include <vtkObject.h>
#include <QApplication>
#include <QSurfaceFormat>

#include <marrow/error.h>
#include <marrow/gpu.h>
#include <marrow/version.h>

#include "shared/console.h"
#include "shared/device_argument.h"
#include "shared/display.h"
#include "shared/scan_arguments.h"
#include "window/main_window.h"
#include "window/measure_viewer.h"
#include "window/theme.h"

namespace marrow::viewer {
namespace {

struct ViewerOptions {
    apps::ScanInput scan;
    bool measure = false;
    std::string device = "auto";
};

void add_options(apps::Arguments& arguments, ViewerOptions& options) {
    apps::add_scan_input(arguments, options.scan);
    arguments.add_flag("--measure", options.measure,
                       "Measure how fast the viewer opens INPUT, moves the isovalue and exports; then quit.");
    apps::add_device_option(arguments, options.device);
    apps::add_scan_options(arguments, options.scan.options);
}

// Whether Qt draws to an X display, as far as the environment says.
bool uses_x_display() {
    if (qEnvironmentVariableIsSet("QT_QPA_PLATFORM")) return qgetenv("QT_QPA_PLATFORM").startsWith("xcb");
    return !qEnvironmentVariableIsSet("WAYLAND_DISPLAY");
}

void check(const ViewerOptions& options) {
    const auto& [input, scan] = options.scan;
    const bool reads_otherwise = scan.series || scan.spacing || scan.resample || scan.volume || scan.level;
    if (options.measure && input.empty())
        throw apps::UsageError("--measure needs an INPUT (see marrow view --help)");
    if (reads_otherwise && input.empty())
        throw apps::UsageError("the options for reading a scan need an INPUT (see marrow view --help)");
    if (reads_otherwise && is_session_file(input))
        throw apps::UsageError("'" + input.string() +
                               "': a session has its own options for reading its scan: leave out --series, "
                               "--spacing, --resample, --volume and --level");
    if (!input.empty() && !std::filesystem::exists(input))
        throw IoError("'" + input.string() + "': there is no such file or folder");
}

void check_display() {
    if (uses_x_display()) apps::require_display("the viewer", "start it on a desktop, or set DISPLAY to one");
}

int run(int argc, char** argv, const ViewerOptions& options, std::optional<std::size_t> device) {
    QSurfaceFormat format = QVTKOpenGLNativeWidget::defaultFormat();
    format.setSamples(0);  // VTK smooths edges itself
    QSurfaceFormat::setDefaultFormat(format);
    QApplication::setAttribute(Qt::AA_EnableHighDpiScaling);
    QApplication::setAttribute(Qt::AA_UseHighDpiPixmaps);
    vtkObject::GlobalWarningDisplayOff();
    QApplication application(argc, argv);
    QApplication::setOrganizationName("marrow");
    QApplication::setApplicationName("marrow-viewer");
    QApplication::setApplicationVersion(MARROW_VERSION);
    QGuiApplication::setDesktopFileName("marrow-viewer");
    apply_theme(application);

    MainWindow window(device);
    window.show();
    const auto& [input, scan_options] = options.scan;
    if (options.measure) return measure_viewer(window, input.string(), scan_options);
    if (!input.empty()) window.open(input, scan_options);
    return QApplication::exec();
}

}  // namespace
}  // namespace marrow::viewer

int main(int argc, char** argv) {
    using namespace marrow;
    const apps::Console console = apps::standard_console();
    viewer::ViewerOptions options;
    std::optional<std::size_t> device;
    bool open = false;
    const int code = apps::exit_code_of(console, [&] {
        apps::Arguments arguments(
            "marrow view", {"Shows CT and MRI scans and the surfaces in them.",
                            "marrow view [INPUT] [OPTIONS]", "For research use only; not a medical device."});
        viewer::add_options(arguments, options);
        open = arguments.parse(argc, argv, console.out);
        if (open) {
            viewer::check(options);
            device = gpu::choose_device(options.device);
            viewer::check_display();
        }
        return apps::kOk;
    });
    return open && code == apps::kOk ? viewer::run(argc, argv, options, device) : code;
}
