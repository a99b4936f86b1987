// Connects the fields of the crop box with the session.
#include "crop_section.h"

#include <QGridLayout>
#include <QSignalBlocker>
#include <QVariant>

#include "field_steps.h"
#include "model/number_text.h"
#include "views/slice_geometry.h"

namespace marrow::viewer {

CropSection::CropSection(Session& session) : session_(session) {
    auto* grid = new QGridLayout(this);
    grid->setContentsMargins(0, 0, 0, 0);
    grid->setSpacing(5);
    grid->setColumnStretch(1, 1);
    grid->setColumnStretch(2, 1);
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        names_[a] = new QLabel;
        names_[a]->setProperty("role", "faint");
        grid->addWidget(names_[a], axis, 0);
        for (const bool upper : {false, true}) {
            auto* box = new QSpinBox;
            box->setObjectName(QString("crop_%1%2").arg(QChar('x' + axis)).arg(upper ? 1 : 0));
            box->setProperty("section", QString("crop"));
            box->setKeyboardTracking(false);
            box->setButtonSymbols(QAbstractSpinBox::NoButtons);
            box->setToolTip(upper ? tr("Last sample of the crop box on this axis")
                                  : tr("First sample of the crop box on this axis"));
            connect(box, qOverload<int>(&QSpinBox::valueChanged), this, [this, a, upper](int sample) {
                session_.move_crop_side({a, upper}, sample);
                follow_parameters();  // the session may have limited the move
            });
            new FieldSteps(box, session_);
            grid->addWidget(box, axis, upper ? 2 : 1);
            numbers_[a][upper] = box;
        }
    }
    size_ = new QLabel;
    size_->setObjectName("crop_size");
    size_->setProperty("role", "faint");
    grid->addWidget(size_, 3, 0, 1, 3);
    connect(&session_, &Session::scan_changed, this, &CropSection::follow_scan);
    connect(&session_, &Session::parameters_changed, this, &CropSection::follow_parameters);
}

// Labels each axis with its direction in the patient, such as R–L.
void CropSection::follow_scan() {
    const Geometry& geometry = session_.scan()->volume.geometry();
    const SliceGeometry axial = slice_geometry(geometry, Plane::axial);
    const SliceGeometry coronal = slice_geometry(geometry, Plane::coronal);
    const auto name = [&](int axis, const QString& from, const QString& to, bool flipped) {
        names_[static_cast<std::size_t>(axis)]->setText(
            QString("%1  %2–%3").arg(QChar('x' + axis)).arg(flipped ? to : from, flipped ? from : to));
    };
    name(axial.across, axial.left, axial.right, axial.across_flipped);
    name(axial.down, axial.top, axial.bottom, axial.down_flipped);
    name(coronal.down, coronal.top, coronal.bottom, coronal.down_flipped);
    for (std::size_t a = 0; a < 3; ++a) {
        for (QSpinBox* box : numbers_[a]) {
            const QSignalBlocker quiet(box);
            box->setRange(0, static_cast<int>(geometry.dims[a] - 1));
        }
    }
}

void CropSection::follow_parameters() {
    const Scan* scan = session_.scan();
    if (!scan) return;
    const SampleBox box = session_.crop();
    QString size;
    for (std::size_t a = 0; a < 3; ++a) {
        for (const bool upper : {false, true}) {
            const QSignalBlocker quiet(numbers_[a][upper]);
            numbers_[a][upper]->setValue(static_cast<int>((upper ? box.last : box.first)[a]));
        }
        const double side =
            static_cast<double>(box.last[a] - box.first[a]) * scan->volume.geometry().spacing[a];
        size += (a > 0 ? " × " : "") + decimal_text(side, 1);
    }
    size_->setText(size + " mm");
    size_->setVisible(session_.parameters().crop.has_value());
}

}  // namespace marrow::viewer
