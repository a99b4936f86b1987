// Sets the style, font, palette, style sheet and icon.
#include "theme.h"

#include <algorithm>

#include <QFile>
#include <QFont>
#include <QFontDatabase>
#include <QIcon>
#include <QPalette>
#include <QRegularExpression>
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

// The light theme is the dark one with the lightness of each colour mirrored.
QColor mirrored(const QColor& colour) {
    qreal hue = 0, saturation = 0, lightness = 0;
    colour.getHslF(&hue, &saturation, &lightness);
    return QColor::fromHslF(std::max(hue, 0.0), saturation, 1 - lightness);
}

QString mirrored(QString style) {
    static const QRegularExpression kColour("#[0-9a-f]{6}\\b");
    for (QRegularExpressionMatch match = kColour.match(style); match.hasMatch();
         match = kColour.match(style, match.capturedEnd()))
        style.replace(match.capturedStart(), match.capturedLength(),
                      mirrored(QColor(match.captured())).name());
    return style;
}

QPalette mirrored(QPalette palette) {
    for (const auto group : {QPalette::Active, QPalette::Inactive, QPalette::Disabled}) {
        for (int role = 0; role < QPalette::NColorRoles; ++role) {
            if (role == QPalette::Highlight || role == QPalette::HighlightedText) continue;
            const auto r = static_cast<QPalette::ColorRole>(role);
            palette.setColor(group, r, mirrored(palette.color(group, r)));
        }
    }
    return palette;
}

}  // namespace

void apply_theme(QApplication& application, bool light) {
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

    application.setPalette(light ? mirrored(dark_palette()) : dark_palette());

    QFile style(":/theme.qss");
    style.open(QIODevice::ReadOnly);
    const QString dark = QString::fromUtf8(style.readAll());
    application.setStyleSheet(light ? mirrored(dark) : dark);
    QApplication::setWindowIcon(QIcon(":/marrow-viewer.png"));
}

}  // namespace marrow::viewer
