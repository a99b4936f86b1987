#include "control_bar.h"

#include <cmath>

#include <marrow/tissue_presets.h>
#include <QHBoxLayout>
#include <QLabel>
#include <QSignalBlocker>
#include <QToolButton>
#include <QVBoxLayout>

#include "model/export_formats.h"

namespace marrow::viewer {
namespace {

// Shows as many digits as the value has.
class IsovalueBox : public QDoubleSpinBox {
  public:
    QString textFromValue(double value) const override { return QString::number(value, 'g', 10); }
};

}  // namespace

ControlBar::ControlBar(Session& session, QAction* copy_command)
    : session_(session), histogram_(new HistogramBar(session)) {
    setObjectName("bottom");
    setAttribute(Qt::WA_StyledBackground);
    histogram_->setObjectName("histogram");
    auto* layout = new QVBoxLayout(this);
    layout->setContentsMargins(14, 8, 14, 8);
    layout->setSpacing(5);
    auto* top = new QHBoxLayout;
    top->setSpacing(6);
    auto* label = new QLabel(tr("Isovalue"));
    label->setProperty("role", "heading");
    top->addWidget(label);
    isovalue_ = new IsovalueBox;
    isovalue_->setObjectName("isovalue");
    isovalue_->setKeyboardTracking(false);
    isovalue_->setButtonSymbols(QAbstractSpinBox::NoButtons);
    isovalue_->setToolTip(tr("The surface is where samples reach this value"));
    isovalue_->setMinimumWidth(120);
    isovalue_->setLocale(QLocale::c());
    top->addWidget(isovalue_);
    top->addSpacing(10);
    const auto chip = [&](const QString& name, const QString& tip) {
        auto* b = new QPushButton(name);
        b->setObjectName("chip");
        b->setCheckable(true);
        b->setToolTip(tip);
        b->setAutoDefault(false);
        top->addWidget(b);
        chips_.push_back(b);
        return b;
    };
    for (const Preset& preset : kPresets) {
        const QString name = QString::fromUtf8(preset.name.data(), static_cast<int>(preset.name.size()));
        connect(chip(name, tr("%1 HU; only for CT").arg(preset.lowest)), &QPushButton::clicked, this,
                [this, name] {
                    session_.apply_preset(name);
                    follow_parameters();
                });
    }
    connect(chip("otsu", tr("Where Otsu's method parts the values in two")), &QPushButton::clicked, this,
            [this] {
                session_.seal();
                if (session_.scan() && session_.scan()->otsu) session_.set_isovalue(*session_.scan()->otsu);
                session_.seal();
                follow_parameters();
            });
    top->addStretch();
    layout->addLayout(top);
    layout->addWidget(histogram_, 1);
    auto* line = new QHBoxLayout;
    line->setSpacing(6);
    command_ = new QLineEdit;
    command_->setObjectName("command");
    command_->setReadOnly(true);
    command_->setToolTip(tr("This command writes the same bytes as Export"));
    auto* copy = new QToolButton;
    copy->setObjectName("copy_command");
    copy->setText(tr("Copy"));
    copy->setToolTip(copy_command->toolTip());
    connect(copy, &QToolButton::clicked, copy_command, &QAction::trigger);
    line->addWidget(command_, 1);
    line->addWidget(copy);
    layout->addLayout(line);

    connect(isovalue_, qOverload<double>(&QDoubleSpinBox::valueChanged), this,
            [this](double value) { session_.set_isovalue(value); });
    connect(isovalue_, &QDoubleSpinBox::editingFinished, this, [this] { session_.seal(); });
    connect(&session_, &Session::scan_changed, this, &ControlBar::follow_scan);
    connect(&session_, &Session::parameters_changed, this, &ControlBar::follow_parameters);
}

void ControlBar::follow_scan() {
    const Scan* scan = session_.scan();
    const QSignalBlocker quiet(isovalue_);
    const double step = histogram_->step();
    isovalue_->setDecimals(step >= 1 ? 2 : std::min(12, 2 - int(std::floor(std::log10(step)))));
    isovalue_->setSingleStep(step);
    isovalue_->setRange(scan->histogram.lower, scan->histogram.upper);
    isovalue_->setSuffix(scan->hounsfield ? " HU" : "");
}

void ControlBar::follow_parameters() {
    const Scan* scan = session_.scan();
    const SurfaceParameters* current = session_.current();
    if (!current) return;
    {
        const QSignalBlocker quiet(isovalue_);
        isovalue_->setValue(current->isovalue);
    }
    for (std::size_t i = 0; i < chips_.size(); ++i) {
        const bool preset = i < kPresets.size();
        chips_[i]->setEnabled(preset ? scan->hounsfield : scan->otsu.has_value());
        chips_[i]->setChecked(preset ? scan->hounsfield && current->isovalue == kPresets[i].isovalue()
                                     : scan->otsu && current->isovalue == *scan->otsu);
    }
    command_->setText(shell_line(command_arguments(*scan, session_.parameters(), *current,
                                                   file_name(*current, ".stl").toStdString(), Space::LPS)));
    command_->setCursorPosition(0);
}

}  // namespace marrow::viewer
