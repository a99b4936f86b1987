// marrow-viewer: shows scans and the surfaces in them.
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include <QVTKOpenGLNativeWidget.h>
#include <vtkObject.h>
#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <QApplication>
#include <QSurfaceFormat>

#include <marrow/version.h>

#include "window/main_window.h"
#include "window/measure_viewer.h"
#include "window/theme.h"

namespace marrow::viewer {
namespace {

struct Arguments {
    std::string input;
    ScanOptions options;
    bool measure = false;
};

// Returns the exit code if the program is done, for instance after --help.
std::optional<int> parse(int argc, char** argv, Arguments& arguments) {
    std::vector<double> spacing;
    CLI::App app("Shows CT and MRI scans and the surfaces in them.", "marrow-viewer");
    app.set_version_flag("--version", "marrow-viewer " MARROW_VERSION);
    app.footer("For research use only. Not a medical device.");
    app.add_option("INPUT", arguments.input,
                   "DICOM folder or file; NIfTI, NRRD, MetaImage or TIFF file; folder of slices");
    app.add_option("--series", arguments.options.series, "DICOM series to read; 'marrow info' lists them")
        ->type_name("UID");
    app.add_option("--spacing", spacing, "spacing of the samples in mm, for images without it")
        ->type_name("X,Y,Z")
        ->delimiter(',')
        ->expected(3);
    app.add_flag("--resample", arguments.options.resample,
                 "interpolate unevenly spaced DICOM slices at even distances");
    app.add_option("--volume", arguments.options.volume,
                   "volume of a 4D NIfTI or MetaImage file, counted from 0")
        ->type_name("K");
    app.add_flag("--measure", arguments.measure,
                 "measure how fast the viewer opens INPUT, moves the isovalue and exports; then quit");
    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        std::cout << app.help();
        return 0;
    } catch (const CLI::CallForVersion& version) {
        std::cout << version.what() << '\n';
        return 0;
    } catch (const CLI::ParseError& error) {
        std::cerr << "marrow-viewer: " << error.what() << " (see marrow-viewer --help)\n";
        return 2;
    }
    if (!spacing.empty()) arguments.options.spacing = Vec3d{spacing[0], spacing[1], spacing[2]};
    if (arguments.measure && arguments.input.empty()) {
        std::cerr << "marrow-viewer: --measure needs an INPUT (see marrow-viewer --help)\n";
        return 2;
    }
    return {};
}

int run(int argc, char** argv, const Arguments& arguments) {
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

    MainWindow window;
    window.show();
    if (arguments.measure) return measure_viewer(window, arguments.input, arguments.options);
    if (!arguments.input.empty()) window.open(arguments.input, arguments.options);
    return QApplication::exec();
}

}  // namespace
}  // namespace marrow::viewer

int main(int argc, char** argv) {
    marrow::viewer::Arguments arguments;
    if (const std::optional<int> code = marrow::viewer::parse(argc, argv, arguments)) return *code;
    return marrow::viewer::run(argc, argv, arguments);
}
