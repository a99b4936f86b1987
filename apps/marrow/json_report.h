/// The results of all commands as JSON. Only json_report.cpp includes nlohmann-json, whose headers compile
/// slowly.
///
/// The keys are a contract: add to them, but never rename or remove one.
#pragma once

#include <string>
#include <vector>

#include <marrow/isovalue_sweep.h>

#include "results.h"

namespace marrow::apps {

/// One object. The numbers of a single surface are its members; those of several form the array `surfaces`.
/// Bounds are in `space`, as written. Surfaces that were not measured have null for their measures.
std::string surfaces_json(const SurfaceResults& results, Space space);

/// One object for one input; for several, one with an array `inputs`. Failures have `error` and `exit_code`,
/// and so has the whole.
std::string findings_json(const std::vector<Finding>& findings, bool show_patient);

/// One object for one file; for several, one with an array `meshes`; failures as above. The numbers of a file
/// are sums over its objects; if there are several, the array `objects` has those of each. With
/// `min_wall` > 0, thin walls are included.
std::string checks_json(const std::vector<CheckedFile>& files, double min_wall);

/// One object with the arrays `sweep` and `plateaus`.
std::string sweep_json(const std::vector<SweepSample>& sweep, const std::vector<Plateau>& plateaus);

/// One object with an array `devices`.
std::string devices_json(const DeviceList& list);

/// One object with an array `levels`, which must be measured.
std::string terrain_json(const TerrainResults& results);

/// One object with the message and the exit code of an error.
std::string error_json(const std::string& message, int exit_code);

}  // namespace marrow::apps
