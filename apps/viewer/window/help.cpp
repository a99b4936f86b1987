#include <marrow/version.h>

#include "help.h"

#include <QMessageBox>

namespace marrow::viewer {

void show_about(QWidget* parent) {
    auto* box = new QMessageBox(parent);
    box->setAttribute(Qt::WA_DeleteOnClose);
    box->setObjectName("about_box");
    box->setWindowTitle(QObject::tr("About Marrow Viewer"));
    box->setText(QObject::tr("<h3>Marrow Viewer %1</h3>").arg(MARROW_VERSION));
    box->setInformativeText(
        QObject::tr(
            "<p>From CT and MRI scans to surfaces, by marching cubes over a histogram pyramid.</p>"
            "<p><b>For research use only.</b> Not a medical device; not for diagnosis or treatment.</p>"
            "<p>Apache License 2.0. Uses Qt %1 and VTK 9.1.</p>")
            .arg(qVersion()));
    box->open();
}

void show_keys(QWidget* parent) {
    auto* box = new QMessageBox(parent);
    box->setAttribute(Qt::WA_DeleteOnClose);
    box->setWindowTitle(QObject::tr("Keys and mouse"));
    const std::vector<std::pair<QString, QString>> rows{
        {"W", QObject::tr("surface, edges, wireframe, points")},
        {"S", QObject::tr("surface")},
        {"R", QObject::tr("reset the views")},
        {"1 … 6", QObject::tr("from anterior, posterior, left, right, superior, inferior")},
        {"N  D  A  K", QObject::tr("navigate, distance, angle, crop")},
        {"C  F", QObject::tr("next cut; its other side")},
        {"T  X  B", QObject::tr("turntable; crosshair in 3D; background")},
        {"Esc", QObject::tr("cancel")},
        {QObject::tr("3D: left, middle, right"),
         QObject::tr("rotate, pan, zoom; a click sets the crosshair")},
        {QObject::tr("Slice: left, middle, right"), QObject::tr("crosshair, pan, window")},
        {QObject::tr("Slice: wheel, Ctrl+wheel"), QObject::tr("through the slices, zoom")},
        {QObject::tr("Histogram: drag, arrows, pages"), QObject::tr("isovalue")}};
    QString text = "<table cellpadding='4'>";
    for (const auto& [key, what] : rows)
        text += QString("<tr><td><b>%1</b></td><td>%2</td></tr>").arg(key, what);
    box->setText(text + "</table>");
    box->open();
}

}  // namespace marrow::viewer
