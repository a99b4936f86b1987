// Lays out the welcome page.
#include "welcome.h"

#include <QDir>
#include <QFileInfo>
#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>
#include <QToolButton>
#include <QVBoxLayout>

namespace marrow::viewer {

Welcome::Welcome(QAction* open_folder, QAction* open_file) {
    auto* page = new QWidget;
    page->setObjectName("welcome");
    page->setAttribute(Qt::WA_StyledBackground);
    setWidget(page);
    setWidgetResizable(true);
    auto* layout = new QVBoxLayout(page);
    layout->addStretch(3);
    const auto centred = [&](const QString& text, const char* role) {
        auto* label = new QLabel(text);
        label->setProperty("role", role);
        label->setAlignment(Qt::AlignCenter);
        layout->addWidget(label);
    };
    centred(tr("Open a scan"), "title");
    layout->addSpacing(6);
    centred(tr("Drop a DICOM folder or a NIfTI, NRRD or MetaImage file here."), "faint");
    layout->addSpacing(22);
    auto* row = new QHBoxLayout;
    row->addStretch();
    for (QAction* action : {open_folder, open_file}) {
        auto* b = new QPushButton(action->text());
        b->setToolTip(action->toolTip());
        b->setDefault(action == open_folder);
        if (action == open_folder) setFocusProxy(b);
        connect(b, &QPushButton::clicked, action, &QAction::trigger);
        row->addWidget(b);
    }
    row->addStretch();
    layout->addLayout(row);
    layout->addSpacing(24);
    recent_ = new QWidget;
    new QVBoxLayout(recent_);
    layout->addWidget(recent_, 0, Qt::AlignHCenter);
    layout->addStretch(4);
    centred(tr("For research use only. Not a medical device."), "faint");
    layout->addSpacing(8);
}

void Welcome::set_recent(const QStringList& paths) {
    for (QToolButton* button : recent_->findChildren<QToolButton*>()) {
        button->hide();
        button->deleteLater();  // not deleted now, because it may be handling a click
    }
    for (const QString& path : paths) {
        auto* b = new QToolButton;
        const QString text = QFileInfo(path).fileName() + "   " + QFileInfo(path).path();
        b->setText(QString(text).replace('&', "&&"));  // a single one would underline the next letter
        connect(b, &QToolButton::clicked, this, [this, path] { emit chosen(path); });
        recent_->layout()->addWidget(b);
    }
}

}  // namespace marrow::viewer
