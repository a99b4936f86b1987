/// Includes all of Marrow, from scans to surfaces, but gpu.h and terrain.h, which belong to libraries of
/// their own.
#pragma once

#include <marrow/atomic_file.h>
#include <marrow/buffer.h>
#include <marrow/components.h>
#include <marrow/error.h>
#include <marrow/export.h>
#include <marrow/histo_pyramid.h>
#include <marrow/histogram.h>
#include <marrow/isosurface.h>
#include <marrow/isovalue_sweep.h>
#include <marrow/label_parts.h>
#include <marrow/label_table.h>
#include <marrow/labels.h>
#include <marrow/measure.h>
#include <marrow/mesh.h>
#include <marrow/mesh_check.h>
#include <marrow/mesh_io.h>
#include <marrow/normals.h>
#include <marrow/parts.h>
#include <marrow/printable.h>
#include <marrow/progress.h>
#include <marrow/scan_io.h>
#include <marrow/simplify.h>
#include <marrow/smooth.h>
#include <marrow/streaming.h>
#include <marrow/thin_walls.h>
#include <marrow/tissue_presets.h>
#include <marrow/trust.h>
#include <marrow/trust_arrays.h>
#include <marrow/vector.h>
#include <marrow/version.h>
#include <marrow/volume.h>
#include <marrow/volume_filters.h>
