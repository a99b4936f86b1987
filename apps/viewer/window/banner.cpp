// Styles and positions the banner.
#include "banner.h"

#include <array>

#include <QHBoxLayout>
#include <QStyle>
#include <QToolButton>
#include <QVariant>

namespace marrow::viewer {

Banner::Banner(QWidget* window, QWidget* area) : QFrame(window), window_(window), area_(area) {
    setObjectName("banner");
    auto* layout = new QHBoxLayout(this);
    layout->setContentsMargins(14, 8, 8, 8);
    text_ = new QLabel;
    text_->setObjectName("banner_text");
    text_->setTextFormat(Qt::PlainText);
    text_->setWordWrap(true);
    text_->setTextInteractionFlags(Qt::TextSelectableByMouse);
    layout->addWidget(text_, 1);
    auto* close = new QToolButton;
    close->setText("×");
    close->setToolTip(tr("Dismiss"));
    layout->addWidget(close, 0, Qt::AlignTop);
    connect(close, &QToolButton::clicked, this, &QWidget::hide);
    timer_.setSingleShot(true);
    connect(&timer_, &QTimer::timeout, this, &QWidget::hide);
    hide();
}

void Banner::show_message(const QString& message, Severity severity) {
    text_->setText(message);
    severity_ = severity;
    constexpr std::array kKinds{"note", "information", "error"};
    setProperty("kind", QString(kKinds[static_cast<std::size_t>(severity)]));
    for (QWidget* styled : {static_cast<QWidget*>(this), static_cast<QWidget*>(text_)}) {
        style()->unpolish(styled);
        style()->polish(styled);
    }
    show();
    raise();
    reposition();
    severity == Severity::error ? timer_.stop() : timer_.start(severity == Severity::note ? 6000 : 15000);
}

void Banner::hide_unless_note() {
    if (severity_ != Severity::note) hide();
}

void Banner::reposition() {
    if (isHidden()) return;
    const int banner_width = std::min(760, window_->width() - 80);
    layout()->activate();
    setFixedSize(banner_width, layout()->heightForWidth(banner_width));
    const QPoint corner = area_->mapTo(window_, QPoint(0, 0));
    move((window_->width() - banner_width) / 2, corner.y() + 12);
}

}  // namespace marrow::viewer
