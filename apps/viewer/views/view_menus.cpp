// Fills the menus and ticks the current choices.
#include "view_menus.h"

#include <QActionGroup>

namespace marrow::viewer {
namespace {

// Adds a choice that is ticked while `current` holds.
void add_choice(QMenu* menu, ViewLayout& views, const QString& text, std::function<bool()> current,
                std::function<void()> choose) {
    QAction* action = menu->addAction(text);
    action->setCheckable(true);
    const auto follow = [action, current] { action->setChecked(current()); };
    QObject::connect(action, &QAction::triggered, menu, [choose, follow] {
        choose();
        follow();
    });
    QObject::connect(&views, &ViewLayout::changed, action, follow);
    follow();
}

}  // namespace

QMenu* make_layout_menu(ViewLayout& views, QWidget* parent) {
    auto* menu = new QMenu(QObject::tr("Layout"), parent);
    menu->setObjectName("layout");
    for (const auto& [text, layout] : {std::pair{QObject::tr("3D and slices"), Layout::column},
                                       {QObject::tr("Four views"), Layout::square}})
        add_choice(
            menu, views, text,
            [&views, layout = layout] { return !views.alone() && views.layout_choice() == layout; },
            [&views, layout = layout] { views.set_layout_choice(layout); });
    menu->addSeparator();
    for (const auto& [text, view] :
         {std::pair<QString, QWidget*>{QObject::tr("Only 3D"), views.surface_view()},
          {QObject::tr("Only axial"), views.slice_view(Plane::axial)},
          {QObject::tr("Only coronal"), views.slice_view(Plane::coronal)},
          {QObject::tr("Only sagittal"), views.slice_view(Plane::sagittal)}})
        add_choice(
            menu, views, text, [&views, view = view] { return views.alone() == view; },
            [&views, view = view] { views.show_alone(view); });
    return menu;
}

QMenu* make_slab_menu(ViewLayout& views, QWidget* parent) {
    auto* menu = new QMenu(QObject::tr("Slice thickness"), parent);
    menu->setObjectName("slab");
    add_choice(
        menu, views, QObject::tr("One slice"), [&views] { return views.slab().thickness == 0; },
        [&views] { views.set_slab({}); });
    for (const auto& [text, mode] : {std::pair{QObject::tr("Maximum (MIP) of %1 mm"), Slab::Mode::maximum},
                                     {QObject::tr("Mean of %1 mm"), Slab::Mode::mean}}) {
        menu->addSeparator();
        for (const double thickness : {5.0, 10.0, 20.0, 40.0}) {
            const Slab slab{mode, thickness};
            add_choice(
                menu, views, text.arg(thickness), [&views, slab] { return views.slab() == slab; },
                [&views, slab] { views.set_slab(slab); });
        }
    }
    return menu;
}

}  // namespace marrow::viewer
