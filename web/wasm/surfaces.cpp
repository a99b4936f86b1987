// Extracts isosurfaces and the surfaces of labels.
#include <map>
#include <memory>
#include <set>

#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/label_table.h>
#include <marrow/labels.h>
#include <marrow/measure.h>

#include "json.h"

namespace marrow::web {
namespace {

std::map<int, std::unique_ptr<IsosurfaceExtractor>> extractors;
int last_extractor = 0;

}  // namespace

// Reports take time, and only a request to stop needs them.
Json create_extractor(const Json& request) {
    const IsosurfaceOptions options{
        .normals = request.at("normals").get<bool>(),
        .closed = request.at("closed").get<bool>(),
        .snap = request.at("snap").get<double>(),
        .topology = request.at("topology").get<bool>(),
        .progress = request.at("stoppable").get<bool>() ? progress() : Progress()};
    extractors[++last_extractor] = std::make_unique<IsosurfaceExtractor>(cropped_scan(request), options);
    return {{"extractor", last_extractor}};
}

// The mesh belongs to the extractor, until its next one.
Json extract(const Json& request) {
    const auto extractor = extractors.find(request.at("extractor").get<int>());
    if (extractor == extractors.end()) throw InputError("the extractor is disposed of: create another");
    return describe(
        extractor->second->extract(request.at("isovalue").get<double>(), request.at("level").get<int>()));
}

Json drop_extractor(const Json& request) {
    extractors.erase(request.at("extractor").get<int>());
    return Json::object();
}

Json labels(const Json& request) {
    const VolumeView map = cropped_scan(request);
    const auto only = member<std::set<std::int64_t>>(request, "only");
    const std::map<std::int64_t, std::int64_t> samples = count_labels(map);
    Json out = Json::array();
    for (LabelSurface& surface :
         extract_labels(map, {.relax = request.at("relax").get<int>(), .progress = progress()})) {
        if (only && !only->contains(surface.label)) continue;
        const LabelEntry entry = label_entry(scan_info().series.labels, surface.label);
        Json one{{"label", surface.label},
                 {"name", entry.name},
                 {"colour", *entry.colour},
                 {"samples", samples.at(surface.label)},
                 {"volume", marrow::measure(surface.mesh).volume},
                 {"heldBack", surface.held_back_points}};
        one.update(keep_mesh(std::move(surface.mesh)));
        out.push_back(std::move(one));
    }
    return out;
}

}  // namespace marrow::web
