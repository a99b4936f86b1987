/// Marrow: from scans to surfaces. Includes everything.
#pragma once

#include <marrow/atomic_file.h>
#include <marrow/check.h>
#include <marrow/error.h>
#include <marrow/filter.h>
#include <marrow/histo_pyramid.h>
#include <marrow/histogram.h>
#include <marrow/isosurface.h>
#include <marrow/label_table.h>
#include <marrow/labels.h>
#include <marrow/measure.h>
#include <marrow/mesh.h>
#include <marrow/mesh_io.h>
#include <marrow/progress.h>
#include <marrow/refine.h>
#include <marrow/scan_io.h>
#include <marrow/slabs.h>
#include <marrow/sweep.h>
#include <marrow/vector.h>
#include <marrow/volume.h>
