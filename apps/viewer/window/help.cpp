// Composes the messages of the help menu.
#include "help.h"

#include <utility>
#include <vector>

#include <vtkVersion.h>
#include <QMessageBox>

#include <marrow/version.h>

namespace marrow::viewer {

void show_about(QWidget* parent) {
    auto* box = new QMessageBox(parent);
    box->setAttribute(Qt::WA_DeleteOnClose);
    box->setObjectName("about_box");
    box->setWindowTitle(QObject::tr("About Marrow Viewer"));
    box->setText(QObject::tr("<h3>Marrow Viewer %1</h3>").arg(MARROW_VERSION));
    box->setInformativeText(
        QObject::tr(
            "<p>Extracts surfaces from CT and MRI scans with marching cubes and histogram pyramids.</p>"
            "<p><b>For research use only.</b> Not a medical device. Not for diagnosis or treatment.</p>"
            "<p>Apache License 2.0. Uses Qt %1 and VTK %2.</p>")
            .arg(qVersion(), vtkVersion::GetVTKVersion()));
    box->open();
}

void show_keys(QWidget* parent) {
    auto* box = new QMessageBox(parent);
    box->setAttribute(Qt::WA_DeleteOnClose);
    box->setWindowTitle(QObject::tr("Keys and mouse"));
    const std::vector<std::pair<QString, QString>> rows{
        {"W", QObject::tr("next draw mode: surface, edges, wireframe, points")},
        {"S", QObject::tr("draw surfaces")},
        {"R", QObject::tr("reset all views")},
        {"1 … 6", QObject::tr("view from anterior, posterior, left, right, superior, inferior")},
        {"N  D  A  K", QObject::tr("tools: navigate, distance, angle, crop")},
        {"C  F", QObject::tr("next cut; flip the cut")},
        {"T  X  B", QObject::tr("turntable; crosshair in 3D; light background")},
        {"F2", QObject::tr("rename the selected surface")},
        {"Enter, Esc", QObject::tr("in a field: accept or restore its value; then keys work again")},
        {"Esc", QObject::tr("cancel")},
        {QObject::tr("3D: left, middle, right button"),
         QObject::tr("rotate, pan, zoom; click to set the crosshair")},
        {QObject::tr("Slice: left, middle, right button"),
         QObject::tr("crosshair, pan, width and level of the window")},
        {QObject::tr("Double click"), QObject::tr("show only this view, or all views again")},
        {QObject::tr("Drag an end of a measurement"), QObject::tr("move it")},
        {QObject::tr("Slice: wheel, Ctrl+wheel"), QObject::tr("change the slice, zoom")},
        {QObject::tr("Histogram: drag, arrow keys, page keys"), QObject::tr("isovalue")}};
    QString text = "<table cellpadding='4'>";
    for (const auto& [key, action] : rows)
        text += QString("<tr><td><b>%1</b></td><td>%2</td></tr>").arg(key, action);
    box->setText(text + "</table>");
    box->open();
}

}  // namespace marrow::viewer
