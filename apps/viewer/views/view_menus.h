/// Menus that choose which views are shown, and how thick the slices are.
#pragma once

#include <QMenu>

#include "view_layout.h"

namespace marrow::viewer {

/// Both layouts, and each view alone. The menu belongs to `parent`.
QMenu* make_layout_menu(ViewLayout& views, QWidget* parent);

/// One slice, or the maximum or mean of a slab, and the slab's thickness. The menu belongs to `parent`.
QMenu* make_slab_menu(ViewLayout& views, QWidget* parent);

}  // namespace marrow::viewer
