#include <iostream>

#include <QVTKOpenGLNativeWidget.h>
#include <vtkObject.h>
#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <QApplication>
#include <QSurfaceFormat>

#include <marrow/version.h>

#include "window/main_window.h"
#include "window/measure_run.h"
#include "window/theme.h"

int main(int argc, char** argv) {
    using namespace marrow;

    std::string input;
    ScanOptions options;
    std::vector<double> spacing;
    CLI::App arguments("Shows scans and the surfaces in them.", "marrow-viewer");
    arguments.set_version_flag("--version", "marrow-viewer " MARROW_VERSION);
    arguments.footer("For research use only; not a medical device.");
    arguments.add_option("INPUT", input,
                         "DICOM folder or file; NIfTI, NRRD, MetaImage or TIFF file; folder of slices");
    arguments.add_option("--series", options.series, "DICOM series to read, as 'marrow info' lists it")
        ->type_name("UID");
    arguments.add_option("--spacing", spacing, "mm between samples, for images that do not say")
        ->type_name("X,Y,Z")
        ->delimiter(',')
        ->expected(3);
    arguments.add_flag("--resample", options.resample,
                       "make uneven DICOM slices even, by linear interpolation");
    arguments
        .add_option("--volume", options.volume, "volume of a 4D NIfTI or MetaImage file, counted from 0")
        ->type_name("K");
    bool measure = false;
    arguments.add_flag(
        "--measure", measure,
        "open INPUT, move the isovalue, export, print the times that a person waits, and quit");
    try {
        arguments.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        std::cout << arguments.help();
        return 0;
    } catch (const CLI::CallForVersion& version) {
        std::cout << version.what() << '\n';
        return 0;
    } catch (const CLI::ParseError& error) {
        std::cerr << "marrow-viewer: " << error.what() << " (see marrow-viewer --help)\n";
        return 2;
    }
    if (!spacing.empty()) options.spacing = Vec3d{spacing[0], spacing[1], spacing[2]};

    QSurfaceFormat format = QVTKOpenGLNativeWidget::defaultFormat();
    format.setSamples(0);  // edges are smoothed by VTK
    QSurfaceFormat::setDefaultFormat(format);
    QApplication::setAttribute(Qt::AA_EnableHighDpiScaling);
    QApplication::setAttribute(Qt::AA_UseHighDpiPixmaps);
    vtkObject::GlobalWarningDisplayOff();
    QApplication application(argc, argv);
    QApplication::setOrganizationName("marrow");
    QApplication::setApplicationName("marrow-viewer");
    QApplication::setApplicationVersion(MARROW_VERSION);
    viewer::apply_theme(application);

    viewer::MainWindow window;
    window.show();
    if (measure) {
        if (input.empty()) {
            std::cerr << "marrow-viewer: which scan shall be measured? (see marrow-viewer --help)\n";
            return 2;
        }
        return viewer::measure_viewer(window, input, options);
    }
    if (!input.empty()) window.open(input, options);
    return QApplication::exec();
}
