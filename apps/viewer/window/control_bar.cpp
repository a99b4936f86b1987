// Lays out the control bar and keeps it up to date with the session.
#include "control_bar.h"

#include <cmath>

#include <QHBoxLayout>
#include <QLabel>
#include <QRegularExpression>
#include <QSignalBlocker>
#include <QToolButton>
#include <QVBoxLayout>

#include <marrow/tissue_presets.h>

#include "field_steps.h"
#include "model/export_formats.h"

namespace marrow::viewer {
namespace {

// Shows only as many digits as the value needs, and an exponent where that is shorter.
class IsovalueBox : public QDoubleSpinBox {
  public:
    QString textFromValue(double value) const override { return QString::number(value, 'g', 10); }
    double valueFromText(const QString& text) const override { return without_unit(text).toDouble(); }

    QValidator::State validate(QString& text, int&) const override {
        const QString number = without_unit(text);
        bool complete = false;
        const double value = number.toDouble(&complete);
        if (complete && value >= minimum() && value <= maximum()) return QValidator::Acceptable;
        static const QRegularExpression beginning(
            QRegularExpression::anchoredPattern(R"([-+]?\d*\.?\d*([eE][-+]?\d*)?)"));
        return beginning.match(number).hasMatch() ? QValidator::Intermediate : QValidator::Invalid;
    }

  private:
    QString without_unit(const QString& text) const {
        return (text.endsWith(suffix()) ? text.chopped(suffix().size()) : text).trimmed();
    }
};

}  // namespace

ControlBar::ControlBar(Session& session, QAction* copy)
    : session_(session), histogram_(new HistogramBar(session)) {
    setObjectName("bottom");
    setAttribute(Qt::WA_StyledBackground);
    histogram_->setObjectName("histogram");
    auto* layout = new QVBoxLayout(this);
    layout->setContentsMargins(14, 8, 14, 8);
    layout->setSpacing(5);
    layout->addLayout(make_isovalue_row());
    layout->addWidget(histogram_, 1);
    layout->addLayout(make_command_row(copy));

    connect(isovalue_, qOverload<double>(&QDoubleSpinBox::valueChanged), this,
            [this](double value) { session_.set_isovalue(value); });
    new FieldSteps(isovalue_, session_);
    connect(&session_, &Session::scan_changed, this, &ControlBar::follow_scan);
    connect(&session_, &Session::parameters_changed, this, &ControlBar::follow_parameters);
}

QLayout* ControlBar::make_isovalue_row() {
    auto* row = new QHBoxLayout;
    row->setSpacing(6);
    auto* label = new QLabel(tr("Isovalue"));
    label->setProperty("role", "heading");
    row->addWidget(label);
    isovalue_ = new IsovalueBox;
    isovalue_->setObjectName("isovalue");
    isovalue_->setKeyboardTracking(false);
    isovalue_->setButtonSymbols(QAbstractSpinBox::NoButtons);
    isovalue_->setToolTip(tr("The surface encloses samples at or above this value"));
    isovalue_->setMinimumWidth(120);
    isovalue_->setLocale(QLocale::c());
    row->addWidget(isovalue_);
    row->addSpacing(10);
    for (const Preset& preset : kPresets) {
        const QString name = QString::fromUtf8(preset.name.data(), static_cast<int>(preset.name.size()));
        QPushButton* chip = add_chip(row, name,
                                     tr("%1 HU: encloses samples of at least %2 HU. For CT only.")
                                         .arg(preset.isovalue())
                                         .arg(preset.lowest));
        connect(chip, &QPushButton::clicked, this, [this, name] {
            session_.apply_preset(name);
            follow_parameters();
        });
    }
    connect(add_chip(row, "otsu", tr("Isovalue from Otsu's method")), &QPushButton::clicked, this,
            &ControlBar::use_otsu);
    row->addStretch();
    return row;
}

QPushButton* ControlBar::add_chip(QBoxLayout* row, const QString& name, const QString& tip) {
    auto* chip = new QPushButton(name);
    chip->setObjectName("chip");
    chip->setCheckable(true);
    chip->setToolTip(tip);
    chip->setAutoDefault(false);
    row->addWidget(chip);
    chips_.push_back(chip);
    return chip;
}

void ControlBar::use_otsu() {
    session_.end_step();
    if (session_.scan() && session_.scan()->otsu) session_.set_isovalue(*session_.scan()->otsu);
    session_.end_step();
    follow_parameters();
}

QLayout* ControlBar::make_command_row(QAction* copy) {
    auto* row = new QHBoxLayout;
    row->setSpacing(6);
    command_ = new QLineEdit;
    command_->setObjectName("command");
    command_->setReadOnly(true);
    command_->setToolTip(tr("This command writes the same file as Export"));
    auto* button = new QToolButton;
    button->setObjectName("copy_command");
    button->setText(tr("Copy"));
    button->setToolTip(copy->toolTip());
    connect(button, &QToolButton::clicked, copy, &QAction::trigger);
    row->addWidget(command_, 1);
    row->addWidget(button);
    return row;
}

void ControlBar::follow_scan() {
    const Scan* scan = session_.scan();
    const QSignalBlocker quiet(isovalue_);
    const double step = histogram_->step();
    // As exact as the histogram shows it, because the field takes over its text when it is left.
    isovalue_->setDecimals(std::clamp(6 - int(std::floor(std::log10(step))), 6, 15));
    isovalue_->setSingleStep(step);
    isovalue_->setSuffix(scan->hounsfield ? " HU" : "");
}

void ControlBar::follow_parameters() {
    const Scan* scan = session_.scan();
    const SurfaceParameters* current = session_.current();
    if (!current) return;
    {
        const QSignalBlocker quiet(isovalue_);
        // A preset may be beyond all samples.
        isovalue_->setRange(std::min(scan->histogram.lower, current->isovalue),
                            std::max(scan->histogram.upper, current->isovalue));
        isovalue_->setValue(current->isovalue);
    }
    for (std::size_t i = 0; i < chips_.size(); ++i) {
        const bool preset = i < kPresets.size();
        chips_[i]->setEnabled(preset ? scan->hounsfield : scan->otsu.has_value());
        chips_[i]->setChecked(preset ? scan->hounsfield && current->isovalue == kPresets[i].isovalue()
                                     : scan->otsu && current->isovalue == *scan->otsu);
    }
    command_->setText(
        shell_line(command_arguments(*scan, session_.parameters(), *current,
                                     file_name(*scan, *current, ".stl").toStdString(), Space::LPS)));
    command_->setCursorPosition(0);
}

}  // namespace marrow::viewer
