// Lists the boxes of the models and cuts them out.
#include "models.h"

#include <algorithm>
#include <array>
#include <optional>

#include <marrow/error.h>
#include <marrow/scan_io.h>

#include "cranium.h"

namespace marrow::paper {
namespace {

namespace fs = std::filesystem;

constexpr double kBone = 226;  // HU

/// A box of samples, [lower, upper) along each axis.
struct Cut {
    const char* name;
    std::array<std::int64_t, 3> lower, upper;
    Vec3d view;
};

const std::vector<Cut> kVisibleHumanHead{
    {"Sphenoid", {194, 176, 88}, {306, 242, 136}, {0.2, -1, 0.5}},
    {"Right-temporal", {172, 196, 84}, {238, 292, 142}, {-1, -0.2, 0.2}},
    {"Right-maxilla", {196, 140, 64}, {254, 218, 114}, {-0.7, -1, 0.1}},
    {"Ethmoid", {232, 146, 100}, {280, 218, 138}, {-0.7, -1, 0.3}},
    {"Teeth", {206, 132, 22}, {306, 190, 64}, {-0.3, -1, 0.4}},
};
const std::vector<Cut> kVisibleHumanAnkle{
    {"Ankle bone", {182, 234, 84}, {257, 362, 150}, {-1, -0.4, 0.3}},
};
const std::vector<Cut> kCranium{
    {"Sphenoid", {68, 106, 18}, {188, 172, 48}, {0.2, -1, 0.5}},
    {"Right-temporal", {48, 68, 10}, {102, 152, 52}, {-1, -0.2, 0.2}},
    {"Right-maxilla", {68, 142, 8}, {132, 218, 36}, {-0.7, -1, 0.1}},
    {"Ethmoid", {102, 132, 26}, {160, 218, 54}, {-0.7, -1, 0.3}},
    {"Teeth", {90, 152, 0}, {174, 224, 18}, {-0.3, -1, 0.4}},
};

Volume cut_out(const Volume& scan, const Cut& cut) {
    if (scan.type() != SampleType::int16) throw InputError("the scan must have int16 samples");
    const auto& dims = scan.geometry().dims;
    Geometry g = scan.geometry();
    Vec3d first{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (cut.upper[axis] > dims[axis]) throw InputError(std::string(cut.name) + " is outside the scan");
        g.dims[axis] = cut.upper[axis] - cut.lower[axis];
        first[axis] = static_cast<double>(cut.lower[axis]);
    }
    g.origin = scan.geometry().physical(first);
    Volume out(g, SampleType::int16);
    std::int16_t* to = out.samples<std::int16_t>();
    for (std::int64_t z = cut.lower[2]; z < cut.upper[2]; ++z) {
        for (std::int64_t y = cut.lower[1]; y < cut.upper[1]; ++y) {
            const std::int16_t* row = scan.samples<std::int16_t>() + (z * dims[1] + y) * dims[0];
            to = std::copy(row + cut.lower[0], row + cut.upper[0], to);
        }
    }
    return out;
}

void cut_from(const Volume& scan, const std::string& source, const std::vector<Cut>& cuts,
              std::vector<Model>& models) {
    for (const Cut& cut : cuts) models.push_back({cut.name, source, cut_out(scan, cut), kBone, cut.view});
}

}  // namespace

std::vector<Model> cut_models(const fs::path& data, std::vector<std::string>& notes) {
    std::vector<Model> models;
    const auto has = [&](const char* name) { return !data.empty() && fs::exists(data / name); };
    if (has("vhf_head_ct")) {
        cut_from(read_scan(data / "vhf_head_ct"), "Visible Human Female, head CT, 1 mm", kVisibleHumanHead,
                 models);
    } else if (const std::optional<Volume> scan = bench::cranium()) {
        notes.push_back("vhf_head_ct is not available, so the models of the head are cut from Cranium");
        cut_from(*scan, "Cranium (InVesalius), head CT, 0.96 x 0.96 x 1.5 mm", kCranium, models);
    } else {
        throw IoError("no head scan; put vhf_head_ct into the data folder or install invesalius-examples");
    }
    if (has("vhf_ankle_ct")) {
        cut_from(read_scan(data / "vhf_ankle_ct"), "Visible Human Female, ankle CT, 1 mm", kVisibleHumanAnkle,
                 models);
    } else {
        notes.push_back("vhf_ankle_ct is not available, so the ankle is omitted");
    }
    return models;
}

}  // namespace marrow::paper
