// Lays out the side panel and keeps it up to date with the session.
#include "side_panel.h"

#include <algorithm>
#include <utility>

#include <QAction>
#include <QColorDialog>
#include <QGridLayout>
#include <QMouseEvent>
#include <QPainter>
#include <QPainterPath>
#include <QSignalBlocker>
#include <QStyle>

#include <marrow/tissue_presets.h>

#include "crop_section.h"
#include "field_steps.h"
#include "model/number_text.h"

namespace marrow::viewer {
namespace {

QIcon swatch(const QColor& colour) {
    QPixmap pixmap(32, 32);
    pixmap.fill(Qt::transparent);
    QPainter painter(&pixmap);
    painter.setRenderHint(QPainter::Antialiasing);
    painter.setBrush(colour);
    painter.setPen(QPen(QColor(128, 128, 128, 140), 2));
    painter.drawRoundedRect(QRectF(3, 3, 26, 26), 7, 7);
    return pixmap;
}

// An open or a closed eye.
QIcon eye(bool open, const QPalette& palette) {
    const QColor colour = palette.color(open ? QPalette::Active : QPalette::Disabled, QPalette::Text);
    QPixmap pixmap(36, 36);
    pixmap.fill(Qt::transparent);
    QPainter painter(&pixmap);
    painter.setRenderHint(QPainter::Antialiasing);
    painter.setPen(QPen(colour, 2.6));
    QPainterPath lids;
    lids.moveTo(4, 18);
    lids.quadTo(18, 3, 32, 18);
    lids.quadTo(18, 33, 4, 18);
    painter.drawPath(lids);
    if (open) {
        painter.setBrush(colour);
        painter.drawEllipse(QPointF(18, 18), 4, 4);
    } else {
        painter.drawLine(7, 29, 29, 7);
    }
    return pixmap;
}

QLabel* heading(const QString& text) {
    auto* label = new QLabel(text);
    label->setProperty("role", "heading");
    return label;
}

// Groups digits by narrow spaces: 12 345 678.
QString grouped(std::int64_t n) {
    QString text = QString::number(n);
    for (int at = text.size() - 3; at > 0; at -= 3) text.insert(at, QChar(0x2009));
    return text;
}

}  // namespace

SurfaceRow::SurfaceRow(Session& session, int id, QWidget* parent)
    : QFrame(parent), session_(session), id_(id) {
    setObjectName("surface_row");
    auto* layout = new QHBoxLayout(this);
    layout->setContentsMargins(6, 4, 6, 4);
    layout->setSpacing(4);
    const auto button = [&](const QString& name, const QString& tip) {
        auto* b = new QToolButton;
        b->setObjectName(name);
        b->setAutoRaise(true);
        b->setToolTip(tip);
        b->setIconSize({18, 18});
        layout->addWidget(b);
        return b;
    };
    eye_ = button("eye", tr("Show or hide this surface"));
    colour_ = button("colour", tr("Colour"));
    name_ = new QLineEdit;
    name_->setObjectName("surface_name");
    setToolTip(tr("Double-click or F2 changes the name of the surface and of its exported file"));
    name_->setFrame(false);
    name_->setReadOnly(true);
    layout->addWidget(name_, 1);
    isovalue_ = new QLabel;
    isovalue_->setProperty("role", "faint");
    layout->addWidget(isovalue_);
    remove_ = button("remove", tr("Remove this surface"));
    remove_->setText("×");

    connect(eye_, &QToolButton::clicked, this, [this] {
        session_.change(tr("visibility"), {}, [&](Parameters& p) {
            if (auto* surface = p.find(id_)) surface->visible = !surface->visible;
        });
    });
    connect(colour_, &QToolButton::clicked, this, &SurfaceRow::choose_colour);
    connect(name_, &QLineEdit::editingFinished, this, &SurfaceRow::end_rename);
    connect(remove_, &QToolButton::clicked, this, [this] { session_.remove_surface(id_); });
    end_rename();
}

void SurfaceRow::rename() {
    name_->setReadOnly(false);
    name_->setFocusPolicy(Qt::StrongFocus);
    name_->setAttribute(Qt::WA_TransparentForMouseEvents, false);
    name_->setFocus();
    name_->selectAll();
}

// Until the next rename(), clicks on the name belong to the row.
void SurfaceRow::end_rename() {
    const SurfaceParameters* before = session_.parameters().find(id_);
    const QString name = name_->text().simplified();
    if (!name_->isReadOnly() && before && name != surface_name(*session_.scan(), *before))
        session_.change(tr("name"), {}, [&](Parameters& p) { p.find(id_)->name = name; });
    name_->setReadOnly(true);
    name_->setFocusPolicy(Qt::NoFocus);
    name_->setAttribute(Qt::WA_TransparentForMouseEvents);
    name_->deselect();
    follow();
}

void SurfaceRow::follow() {
    const SurfaceParameters* surface = session_.parameters().find(id_);
    if (!surface) return;
    eye_->setIcon(eye(surface->visible, palette()));
    colour_->setIcon(swatch(surface->colour));
    if (name_->isReadOnly()) name_->setText(surface_name(*session_.scan(), *surface));
    isovalue_->setText(QString::number(surface->isovalue, 'g', 6));
    remove_->setVisible(session_.parameters().surfaces.size() > 1);
    const bool current = session_.parameters().current == id_;
    if (property("current").toBool() != current) {
        setProperty("current", current);
        style()->unpolish(this);
        style()->polish(this);
    }
}

void SurfaceRow::mousePressEvent(QMouseEvent* event) {
    session_.select_surface(id_);
    QFrame::mousePressEvent(event);
}

void SurfaceRow::mouseDoubleClickEvent(QMouseEvent*) {
    rename();
}

void SurfaceRow::changeEvent(QEvent* event) {
    if (event->type() == QEvent::PaletteChange) follow();  // the icons
    QFrame::changeEvent(event);
}

void SurfaceRow::choose_colour() {
    const SurfaceParameters* surface = session_.parameters().find(id_);
    if (!surface) return;
    auto* dialog = new QColorDialog(surface->colour, window());
    dialog->setAttribute(Qt::WA_DeleteOnClose);
    dialog->setWindowTitle(tr("Colour of %1").arg(surface_name(*session_.scan(), *surface)));
    connect(dialog, &QColorDialog::colorSelected, &session_,
            [&session = session_, id = id_](const QColor& colour) {
                session.change(tr("colour"), {}, [&](Parameters& p) {
                    if (auto* changed = p.find(id)) changed->colour = colour;
                });
            });
    dialog->open();
}

SidePanel::SidePanel(Session& session, Surfaces& surfaces, QAction* whole_scan)
    : session_(session), surfaces_(surfaces) {
    setObjectName("panel");
    setMinimumWidth(230);
    auto* layout = new QVBoxLayout(this);
    layout->setContentsMargins(14, 12, 14, 12);
    layout->setSpacing(8);
    add_surfaces(layout);
    add_opacity(layout);
    add_colouring(layout);
    add_options(layout);
    layout->addSpacing(10);
    add_measures(layout);
    layout->addSpacing(10);
    add_crop(layout, whole_scan);
    layout->addSpacing(10);
    add_measurements(layout);

    connect(&session_, &Session::parameters_changed, this, &SidePanel::follow_parameters);
    connect(&session_, &Session::scan_changed, this, &SidePanel::follow_numbers);
    connect(&surfaces_, &Surfaces::shape_changed, this, &SidePanel::follow_numbers);
    connect(&surfaces_, &Surfaces::measured, this, &SidePanel::follow_numbers);
    connect(&surfaces_, &Surfaces::failed, this, &SidePanel::follow_numbers);
    follow_parameters();
}

void SidePanel::rename_current_surface() {
    for (SurfaceRow* row : row_list_) {
        if (row->id() == session_.parameters().current) row->rename();
    }
}

void SidePanel::add_surfaces(QVBoxLayout* layout) {
    auto* top = new QHBoxLayout;
    top->addWidget(heading(tr("Surfaces")));
    top->addStretch();
    auto* add = new QToolButton;
    add->setObjectName("add_surface");
    add->setText(tr("+ Add"));
    add->setToolTip(tr("Add another surface, such as translucent skin around bone"));
    add->setPopupMode(QToolButton::InstantPopup);
    add_menu_ = new QMenu(add);
    add->setMenu(add_menu_);
    connect(add_menu_, &QMenu::aboutToShow, this, &SidePanel::fill_add_menu);
    top->addWidget(add);
    layout->addLayout(top);
    rows_ = new QVBoxLayout;
    rows_->setSpacing(4);
    layout->addLayout(rows_);
}

void SidePanel::fill_add_menu() {
    add_menu_->clear();
    const Scan* scan = session_.scan();
    if (!scan) return;
    if (session_.parameters().surfaces.size() >= Parameters::kMostSurfaces) {
        add_menu_->addAction(tr("A session has at most %1 surfaces").arg(Parameters::kMostSurfaces))
            ->setEnabled(false);
        return;
    }
    if (scan->hounsfield) {
        for (const Preset& preset : kPresets) {
            const QString name = QString::fromUtf8(preset.name.data(), static_cast<int>(preset.name.size()));
            add_menu_->addAction(
                QString("%1   %2 HU").arg(name).arg(preset.isovalue()), this, [this, preset] {
                    // A surface that encloses another one must be translucent.
                    bool outside = false;
                    for (const SurfaceParameters& s : session_.parameters().surfaces)
                        outside = outside || (s.visible && s.isovalue > preset.isovalue());
                    session_.add_surface(
                        {}, preset.isovalue(),
                        QColor::fromRgbF(preset.colour[0], preset.colour[1], preset.colour[2]),
                        outside ? 0.25 : 1);
                });
        }
        add_menu_->addSeparator();
    }
    if (scan->otsu)
        add_menu_->addAction(tr("otsu   %1").arg(*scan->otsu, 0, 'g', 6), this,
                             [this, value = *scan->otsu] { session_.add_surface({}, value, {}, 1); });
    if (const SurfaceParameters* current = session_.current())
        add_menu_->addAction(tr("Current isovalue   %1").arg(current->isovalue, 0, 'g', 6), this, [this] {
            if (const SurfaceParameters* c = session_.current()) session_.add_surface({}, c->isovalue, {}, 1);
        });
}

void SidePanel::add_opacity(QVBoxLayout* layout) {
    auto* row = new QHBoxLayout;
    auto* label = new QLabel(tr("Opacity"));
    label->setProperty("role", "faint");
    row->addWidget(label);
    opacity_ = new QSlider(Qt::Horizontal);
    opacity_->setObjectName("opacity");
    opacity_->setRange(0, 100);
    opacity_->setToolTip(tr("Opacity of the selected surface"));
    row->addWidget(opacity_, 1);
    layout->addLayout(row);
    new FieldSteps(opacity_, session_);
    connect(opacity_, &QSlider::valueChanged, this, [this](int percent) {
        session_.change(tr("opacity"), QString("opacity %1").arg(session_.parameters().current),
                        [&](Parameters& p) {
                            if (auto* surface = p.find(p.current)) surface->opacity = percent / 100.0;
                        });
    });
}

void SidePanel::add_colouring(QVBoxLayout* layout) {
    auto* row = new QHBoxLayout;
    auto* label = new QLabel(tr("Colour by"));
    label->setProperty("role", "faint");
    row->addWidget(label);
    colouring_ = new QComboBox;
    colouring_->setObjectName("colouring");
    colouring_->setProperty("section", QString("panel"));
    colouring_->addItems({tr("Surface"), tr("Shift with isovalue"), tr("Shift by noise")});
    const QString tip =
        tr("Colour all surfaces by how far they can be trusted: how far they move if the isovalue "
           "changes, or by the noise of the scan");
    label->setToolTip(tip);
    colouring_->setToolTip(tip);
    row->addWidget(colouring_, 1);
    layout->addLayout(row);
    connect(colouring_, qOverload<int>(&QComboBox::activated), this, [this](int chosen) {
        session_.change(tr("colouring"), {}, [&](Parameters& p) { p.colouring = Colouring(chosen); });
    });
}

void SidePanel::add_options(QVBoxLayout* layout) {
    largest_ = new QCheckBox(tr("Largest component only"));
    largest_->setObjectName("largest");
    largest_->setToolTip(tr("Remove smaller components, such as the table and noise"));
    open_ = new QCheckBox(tr("Open at the border of the scan"));
    open_->setObjectName("open");
    open_->setToolTip(tr("Leave surfaces open where the scan ends. Closed surfaces can be printed."));
    topology_ = new QCheckBox(tr("Exact topology"));
    topology_->setObjectName("topology");
    topology_->setToolTip(
        tr("Give surfaces exactly the pieces and holes of the interpolated samples: thin walls stay whole"));
    layout->addWidget(largest_);
    layout->addWidget(open_);
    layout->addWidget(topology_);
    add_refinement(layout);
    connect(largest_, &QCheckBox::clicked, this, [this](bool on) {
        session_.change(tr("largest component"), {}, [&](Parameters& p) { p.largest = on; });
    });
    connect(open_, &QCheckBox::clicked, this,
            [this](bool on) { session_.change(tr("open border"), {}, [&](Parameters& p) { p.open = on; }); });
    connect(topology_, &QCheckBox::clicked, this, [this](bool on) {
        session_.change(tr("exact topology"), {}, [&](Parameters& p) { p.topology = on; });
    });
}

void SidePanel::add_refinement(QVBoxLayout* layout) {
    auto* grid = new QGridLayout;
    grid->setVerticalSpacing(5);
    grid->setColumnStretch(1, 1);
    const auto add = [&](const char* object_name, const QString& text, int least, int most,
                         const QString& tip, int Parameters::*number) {
        auto* label = new QLabel(text);
        label->setProperty("role", "faint");
        auto* box = new QSpinBox;
        box->setObjectName(object_name);
        box->setRange(least, most);
        box->setKeyboardTracking(false);
        box->setButtonSymbols(QAbstractSpinBox::NoButtons);
        box->setProperty("section", QString("panel"));
        box->setToolTip(tip);
        label->setToolTip(tip);
        connect(box, qOverload<int>(&QSpinBox::valueChanged), this,
                [this, object_name, text, number](int value) {
                    session_.change(text.toLower(), object_name, [&](Parameters& p) { p.*number = value; });
                });
        new FieldSteps(box, session_);
        grid->addWidget(label, grid->rowCount(), 0);
        grid->addWidget(box, grid->rowCount() - 1, 1);
        return box;
    };
    components_ =
        add("components", tr("Components"), 0, Parameters::kMostComponents,
            tr("Keep this many components, those with the most triangles"), &Parameters::components);
    components_->setSpecialValueText(tr("all"));
    smooth_ = add("smooth", tr("Smoothing"), 0, Parameters::kMostSmoothing,
                  tr("Iterations of a filter that smooths and shrinks only thin parts; 20 is usual"),
                  &Parameters::smooth);
    smooth_->setSpecialValueText(tr("none"));
    keep_ = add("keep", tr("Keep triangles"), 1, 100,
                tr("Reduce surfaces to this part of their triangles, without changing their topology"),
                &Parameters::keep);
    keep_->setSuffix(" %");
    layout->addLayout(grid);
}

void SidePanel::add_measures(QVBoxLayout* layout) {
    auto* top = new QHBoxLayout;
    top->addWidget(heading(tr("Measures")));
    top->addStretch();
    closedness_ = new QLabel;
    closedness_->setObjectName("closedness");
    closedness_->setToolTip(
        tr("Closed: every edge has two triangles. The surface encloses a volume and can be "
           "printed. Smoothed and reduced surfaces are also searched for triangles that intersect."));
    top->addWidget(closedness_);
    layout->addLayout(top);
    auto* grid = new QGridLayout;
    grid->setVerticalSpacing(5);
    grid->setColumnStretch(1, 1);
    const std::array<QString, 6> names{tr("Volume"), tr("Area"),      tr("Components"),
                                       tr("Points"), tr("Triangles"), tr("Extraction")};
    for (int i = 0; i < 6; ++i) {
        auto* name = new QLabel(names[static_cast<std::size_t>(i)]);
        name->setProperty("role", "faint");
        auto* value = new QLabel("–");
        value->setObjectName("number_" + QString::number(i));
        value->setAlignment(Qt::AlignRight);
        value->setTextInteractionFlags(Qt::TextSelectableByMouse);
        grid->addWidget(name, i, 0);
        grid->addWidget(value, i, 1);
        numbers_[static_cast<std::size_t>(i)] = value;
    }
    layout->addLayout(grid);
}

void SidePanel::add_crop(QVBoxLayout* layout, QAction* whole_scan) {
    auto* top = new QHBoxLayout;
    top->addWidget(heading(tr("Crop")));
    top->addStretch();
    auto* reset = new QToolButton;
    reset->setDefaultAction(whole_scan);
    top->addWidget(reset);
    layout->addLayout(top);
    layout->addWidget(new CropSection(session_));
}

void SidePanel::add_measurements(QVBoxLayout* layout) {
    layout->addWidget(heading(tr("Measurements")));
    measurements_ = new QListWidget;
    measurements_->setObjectName("measurements");
    measurements_->setToolTip(tr("Press Delete to remove the selected measurement"));
    layout->addWidget(measurements_, 1);
    no_measurements_ =
        new QLabel(tr("Press D for a distance or A for an angle, then click on a surface or a slice."));
    no_measurements_->setWordWrap(true);
    no_measurements_->setProperty("role", "faint");
    layout->addWidget(no_measurements_);
    layout->addStretch();
    auto* remove = new QAction(measurements_);
    remove->setShortcut(Qt::Key_Delete);
    remove->setShortcutContext(Qt::WidgetShortcut);
    measurements_->addAction(remove);
    connect(remove, &QAction::triggered, this, [this] {
        const int row = measurements_->currentRow();
        session_.change(tr("remove measurement"), {}, [&](Parameters& p) {
            if (row >= 0 && row < static_cast<int>(p.measurements.size()))
                p.measurements.erase(p.measurements.begin() + row);
        });
    });
}

void SidePanel::follow_parameters() {
    const Parameters& p = session_.parameters();
    setEnabled(session_.scan() != nullptr);
    follow_rows();
    if (const SurfaceParameters* current = session_.current()) {
        const QSignalBlocker quiet(opacity_);
        opacity_->setValue(qRound(current->opacity * 100));
    }
    largest_->setChecked(p.largest);
    open_->setChecked(p.open);
    topology_->setChecked(p.topology);
    colouring_->setCurrentIndex(static_cast<int>(p.colouring));
    for (const auto& [box, value] :
         {std::pair{components_, p.components}, {smooth_, p.smooth}, {keep_, p.keep}}) {
        const QSignalBlocker quiet(box);
        box->setValue(value);
    }
    components_->setEnabled(!p.largest);
    follow_measurements();
    follow_numbers();
}

void SidePanel::follow_rows() {
    const std::vector<SurfaceParameters>& surfaces = session_.parameters().surfaces;
    const bool same = std::equal(row_list_.begin(), row_list_.end(), surfaces.begin(), surfaces.end(),
                                 [](const SurfaceRow* row, const auto& s) { return row->id() == s.id; });
    if (!same) {
        // A row stays as long as its surface does, because its name may be being edited. To end that would
        // change the session while it changes.
        std::vector<SurfaceRow*> before = std::exchange(row_list_, {});
        for (const SurfaceParameters& surface : surfaces) {
            const auto row = std::find_if(before.begin(), before.end(),
                                          [&](const SurfaceRow* r) { return r->id() == surface.id; });
            if (row != before.end()) {
                row_list_.push_back(*row);
                before.erase(row);
            } else {
                row_list_.push_back(new SurfaceRow(session_, surface.id));
            }
            rows_->insertWidget(static_cast<int>(row_list_.size()) - 1, row_list_.back());
        }
        for (SurfaceRow* row : before) {
            row->hide();
            row->deleteLater();  // not deleted now, because it may be handling a click
        }
    }
    for (SurfaceRow* row : row_list_) row->follow();
}

void SidePanel::follow_measurements() {
    const std::vector<Measurement>& measurements = session_.parameters().measurements;
    const int row = measurements_->currentRow();
    measurements_->clear();
    for (const Measurement& m : measurements)
        measurements_->addItem((m.points.size() == 2 ? tr("Distance   ") : tr("Angle   ")) + m.text());
    measurements_->setCurrentRow(std::min(row, measurements_->count() - 1));
    measurements_->setVisible(!measurements.empty());
    no_measurements_->setVisible(measurements.empty());
}

void SidePanel::follow_numbers() {
    const SurfaceParameters* current = session_.current();
    const std::shared_ptr<const Shape> shape = current ? surfaces_.shape(current->id) : nullptr;
    const bool failed = current && !surfaces_.failure(current->id).isEmpty();
    if (!shape || (failed && !shape->measures)) {
        for (QLabel* label : numbers_) label->setText("–");
        closedness_->clear();
        return;
    }
    // The numbers of a preview are approximate.
    const QString about = shape->level > 0 ? "≈ " : "";
    numbers_[3]->setText(about + grouped(static_cast<std::int64_t>(shape->mesh->points.size())));
    numbers_[4]->setText(about + grouped(static_cast<std::int64_t>(shape->mesh->triangles.size())));
    numbers_[5]->setText(
        QString("%1%2 ms").arg(about).arg(shape->milliseconds, 0, 'f', shape->milliseconds < 10 ? 1 : 0));
    if (shape->measures) {
        show_measures(*shape->measures, about);
        show_validity(*shape, failed);
        measured_ = MeasuredSurface{current->id, *shape->measures};
    } else if (measured_ && measured_->id == current->id) {
        show_measures(measured_->measures, "≈ ");  // of the shape before
    } else {
        for (std::size_t i = 0; i < 3; ++i) numbers_[i]->setText("–");
        closedness_->clear();
    }
}

void SidePanel::show_measures(const MeshMeasures& m, const QString& about) {
    const bool closed = m.boundary_edges == 0 && m.nonmanifold_edges == 0 && m.triangles > 0;
    numbers_[0]->setText(closed ? about + decimal_text(m.volume / 1000, 1) + " mL" : tr("not closed"));
    numbers_[1]->setText(about + decimal_text(m.area / 100, 1) + " cm²");
    numbers_[2]->setText(about + grouped(m.components));
}

// Isosurfaces do not intersect themselves, but smoothing and reduction may have made them do so.
void SidePanel::show_validity(const Shape& shape, bool failed) {
    const Parameters& p = session_.parameters();
    const MeshMeasures& m = *shape.measures;
    const bool checked = shape.level > 0 || (p.smooth == 0 && p.keep == 100) || shape.self_intersections;
    const auto light = [&](const char* colour, const QString& text) {
        closedness_->setText(QString("<span style='color:%1'>●</span> %2").arg(colour, text));
    };
    if (m.triangles == 0)
        light("#8b949e", tr("empty"));
    else if (m.boundary_edges > 0 || m.nonmanifold_edges > 0)
        light("#f0883e", tr("open"));
    else if (!checked)
        light("#8b949e", failed ? tr("not checked") : tr("checking…"));
    else if (shape.self_intersections.value_or(0) > 0)
        light("#f0883e", tr("%1 self-intersections").arg(*shape.self_intersections));
    else
        light("#4cc27a", tr("closed"));
}

}  // namespace marrow::viewer
