// Composes the messages of the help menu.
#include "help.h"

#include <utility>
#include <vector>

#include <vtkVersion.h>
#include <QDialog>
#include <QDialogButtonBox>
#include <QMessageBox>
#include <QTextBrowser>
#include <QVBoxLayout>

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
    auto* dialog = new QDialog(parent);
    dialog->setAttribute(Qt::WA_DeleteOnClose);
    dialog->setObjectName("keys_dialog");
    dialog->setWindowTitle(QObject::tr("Keys and mouse"));
    const std::vector<std::pair<QString, QString>> rows{
        {"Ctrl+O, Ctrl+Shift+O", QObject::tr("open a file, a folder")},
        {"Ctrl+S, Ctrl+P, Ctrl+Shift+S", QObject::tr("export, screenshot, save the session")},
        {"Ctrl+C, Ctrl+Shift+C", QObject::tr("copy the picture, the command line")},
        {"Ctrl+Z, Ctrl+Shift+Z or Ctrl+Y", QObject::tr("undo, redo")},
        {"W, S", QObject::tr("next draw mode: surface, edges, wireframe, points; draw surfaces")},
        {"R", QObject::tr("reset all views")},
        {"1 … 6", QObject::tr("view from anterior, posterior, left, right, superior, inferior")},
        {"N, D, A, K", QObject::tr("tools: navigate, distance, angle, crop")},
        {"C, F", QObject::tr("next cut; flip the cut")},
        {"T, X, B", QObject::tr("turntable; crosshair in 3D; light theme")},
        {"Ctrl+Tab, F2", QObject::tr("select the next surface; rename the selected surface")},
        {"F11", QObject::tr("full screen")},
        {QObject::tr("Enter, Esc in a field"),
         QObject::tr("accept or restore its value; then keys work again")},
        {"Esc", QObject::tr("cancel; discard an unfinished measurement; return to navigating")},
        {QObject::tr("3D: left, middle, right button"),
         QObject::tr("rotate, pan, zoom; click to set the crosshair")},
        {QObject::tr("Slice: left, middle, right button"),
         QObject::tr("crosshair, pan, width and level of the window")},
        {QObject::tr("Slice: wheel, Ctrl+wheel"), QObject::tr("change the slice, zoom")},
        {QObject::tr("Slice: arrow keys, page keys"), QObject::tr("one slice, ten slices")},
        {QObject::tr("Double click"), QObject::tr("show only this view, or all views again")},
        {QObject::tr("Drag an end of a measurement"), QObject::tr("move it")},
        {QObject::tr("Delete in the list of measurements"), QObject::tr("remove the selected one")},
        {QObject::tr("Histogram: drag, arrow and page keys"), QObject::tr("isovalue")},
        {QObject::tr("Histogram: wheel"), QObject::tr("zoom")}};
    QString text = "<table cellpadding='5'>";
    for (const auto& [key, action] : rows)
        text += QString("<tr><td style='white-space: pre'><b>%1</b></td><td>%2</td></tr>").arg(key, action);
    auto* page = new QTextBrowser;  // scrolls on small screens
    page->setFrameShape(QFrame::NoFrame);
    page->setHtml(text + "</table>");
    auto* buttons = new QDialogButtonBox(QDialogButtonBox::Close);
    QObject::connect(buttons, &QDialogButtonBox::rejected, dialog, &QDialog::reject);
    auto* layout = new QVBoxLayout(dialog);
    layout->addWidget(page);
    layout->addWidget(buttons);
    dialog->resize(QSize(780, 720).boundedTo(parent->size() * 0.9));
    dialog->open();
}

}  // namespace marrow::viewer
