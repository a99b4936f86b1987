// Sets the style, font, palette, style sheet and icon.
#include "theme.h"

#include <QFile>
#include <QFont>
#include <QFontDatabase>
#include <QIcon>
#include <QPalette>
#include <QStyleFactory>

// The macro must be outside of namespaces. Without it, the linker drops the resources of a static library.
static void load_resources() {
    Q_INIT_RESOURCE(viewer);
}

namespace marrow::viewer {
namespace {

QPalette dark_palette() {
    QPalette palette;
    const QColor window(27, 30, 35), base(20, 22, 26), text(226, 230, 235), faint(132, 141, 151);
    palette.setColor(QPalette::Window, window);
    palette.setColor(QPalette::WindowText, text);
    palette.setColor(QPalette::Base, base);
    palette.setColor(QPalette::AlternateBase, window);
    palette.setColor(QPalette::Text, text);
    palette.setColor(QPalette::Button, QColor(43, 47, 54));
    palette.setColor(QPalette::ButtonText, text);
    palette.setColor(QPalette::ToolTipBase, QColor(50, 55, 63));
    palette.setColor(QPalette::ToolTipText, text);
    palette.setColor(QPalette::PlaceholderText, faint);
    palette.setColor(QPalette::Highlight, QColor(52, 111, 184));
    palette.setColor(QPalette::HighlightedText, Qt::white);
    palette.setColor(QPalette::Link, QColor(107, 172, 245));
    for (const auto role : {QPalette::WindowText, QPalette::Text, QPalette::ButtonText})
        palette.setColor(QPalette::Disabled, role, QColor(92, 99, 108));
    return palette;
}

}  // namespace

void apply_theme(QApplication& application) {
    load_resources();
    application.setStyle(QStyleFactory::create("Fusion"));
    QFont font = application.font();
    for (const char* family : {"Inter", "Noto Sans", "Ubuntu", "Cantarell"}) {
        if (!QFontDatabase().hasFamily(family)) continue;
        font.setFamily(family);
        break;
    }
    font.setPixelSize(13);
    application.setFont(font);

    application.setPalette(dark_palette());

    QFile style(":/theme.qss");
    style.open(QIODevice::ReadOnly);
    application.setStyleSheet(QString::fromUtf8(style.readAll()));
    QApplication::setWindowIcon(QIcon(":/marrow-viewer.png"));
}

}  // namespace marrow::viewer
