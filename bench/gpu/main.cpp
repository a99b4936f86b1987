// marrow-bench-gpu: times the extraction on a device, kernel by kernel, beside a kernel that copies memory
// and the CPU. Prints JSON; docs/gpu.md explains it.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <exception>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include <marrow/error.h>
#include <marrow/gpu.h>
#include <marrow/isosurface.h>

#include "gpu/copy_kernel.h"
#include "gpu/device_extraction.h"
#include "gpu/kernel_times.h"
#include "timing.h"
#include "volumes.h"

namespace marrow::bench {
namespace {

using gpu::internal::DeviceExtraction;
using gpu::internal::Report;
using Clock = std::chrono::steady_clock;

struct Settings {
    std::size_t device = 0;
    int rounds = 9;
    std::vector<std::string> volumes;
};

template <class F>
double milliseconds(const F& work) {
    const auto start = Clock::now();
    work();
    return milliseconds_since(start);
}

template <class T>
bool same_bytes(const Buffer<T>& a, const Buffer<T>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

// The wall times of rounds.
struct Times {
    std::vector<double> full, next, download, cpu_full, cpu_next;
};

// Bytes that an extraction cannot do without: the samples of the blocks that the surface crosses, the inside
// bits once written and once read, and the output.
double least_bytes(const DeviceExtraction& extraction, const Volume& volume, const Report& report) {
    const double block = 32 * 8 * static_cast<double>(sample_size(volume.type()));
    return block * report.status.mixed + 2 * 4 * static_cast<double>(extraction.samples().bit_words()) +
           24.0 * report.points + 12.0 * report.triangles;
}

// The median milliseconds of each kernel.
nlohmann::json kernel_medians(const std::vector<std::map<std::string, double>>& rounds) {
    std::map<std::string, std::vector<double>> values;
    for (const auto& round : rounds) {
        for (const auto& [name, value] : round) values[name].push_back(value);
    }
    auto json = nlohmann::json::object();
    for (const auto& [name, all] : values) json[name] = median(all);
    return json;
}

nlohmann::json measure(const Case& c, const Settings& settings, double copy_bytes_per_second) {
    const auto device = gpu::internal::open_device(settings.device);
    const double next_isovalue = 1.01 * c.isovalue, far = 1e30;
    { DeviceExtraction(device, c.volume, {}).extract(c.isovalue, true); }  // compiles the kernels
    const auto start = Clock::now();
    DeviceExtraction extraction(device, c.volume, {});
    const double upload = milliseconds_since(start);
    IsosurfaceExtractor cpu(c.volume);
    Mesh mesh, cpu_mesh;
    Report full_report, next_report;
    Times times;
    bool same = true;
    for (int round = -1; round < settings.rounds; ++round) {
        extraction.extract(far, true);
        const double full = milliseconds([&] { full_report = extraction.extract(c.isovalue, true); });
        const double next = milliseconds([&] { next_report = extraction.extract(next_isovalue, false); });
        const double download = milliseconds([&] { extraction.download(next_report, mesh); });
        cpu.extract(far, cpu_mesh);
        const double cpu_full = milliseconds([&] { cpu.extract(c.isovalue, cpu_mesh); });
        const double cpu_next = milliseconds([&] { cpu.extract(next_isovalue, cpu_mesh); });
        same = same && same_bytes(mesh.points, cpu_mesh.points) &&
               same_bytes(mesh.normals, cpu_mesh.normals) && same_bytes(mesh.triangles, cpu_mesh.triangles);
        if (round < 0) continue;  // the first round makes room for the output
        times.full.push_back(full);
        times.next.push_back(next);
        times.download.push_back(download);
        times.cpu_full.push_back(cpu_full);
        times.cpu_next.push_back(cpu_next);
    }
    std::vector<std::map<std::string, double>> full_kernels, next_kernels;
    {
        KernelTimes kernels(device, {static_cast<std::int32_t>(c.volume.type()), VK_FALSE, VK_TRUE});
        for (int round = 0; round < settings.rounds; ++round) {
            extraction.extract(far, true);
            kernels.take();
            extraction.extract(c.isovalue, true);
            full_kernels.push_back(kernels.take());
            extraction.extract(next_isovalue, true);
            next_kernels.push_back(kernels.take());
        }
    }
    const auto stage = [&](double ms, const Report& report, double cpu_ms, const auto& kernels) {
        const double bytes = least_bytes(extraction, c.volume, report);
        nlohmann::json json{{"ms", ms},
                            {"cpu_ms", cpu_ms},
                            {"points", report.points},
                            {"triangles", report.triangles},
                            {"blocks_read", report.status.mixed},
                            {"blocks_listed", report.status.listed},
                            {"least_bytes", bytes},
                            {"kernels_ms", kernel_medians(kernels)}};
        if (copy_bytes_per_second > 0)
            json["share_of_copy_bandwidth"] = bytes / (1e-3 * ms) / copy_bytes_per_second;
        return json;
    };
    const double output_bytes = 24.0 * next_report.points + 12.0 * next_report.triangles;
    const auto gigabytes_per_second = [](double bytes, double ms) { return 1e-6 * bytes / ms; };
    return {
        {"volume", c.name},
        {"samples", c.volume.geometry().sample_count()},
        {"bytes", c.volume.bytes()},
        {"blocks", extraction.samples().blocks()},
        {"same_bytes_as_cpu", same},
        {"upload",
         {{"ms", upload}, {"gb_per_s", gigabytes_per_second(static_cast<double>(c.volume.bytes()), upload)}}},
        {"download",
         {{"ms", median(times.download)},
          {"gb_per_s", gigabytes_per_second(output_bytes, median(times.download))}}},
        {"extraction", stage(median(times.full), full_report, median(times.cpu_full), full_kernels)},
        {"next_isovalue", stage(median(times.next), next_report, median(times.cpu_next), next_kernels)}};
}

int run(const Settings& settings) {
    const std::vector<gpu::Device> devices = gpu::devices();
    if (settings.device >= devices.size())
        throw InputError("there is no device " + std::to_string(settings.device) + "; there are " +
                         std::to_string(devices.size()));
    const gpu::Device& device = devices[settings.device];
    const bool software = device.kind == gpu::DeviceKind::software;
    std::vector<std::string> names = settings.volumes;
    if (names.empty())
        names = software
                    ? std::vector<std::string>{"phantom-96"}
                    : std::vector<std::string>{"phantom-512", "waves-512-32", "gyroid-512", "gyroid-1024"};
    const double copy = copy_bandwidth(gpu::internal::open_device(settings.device), software);
    nlohmann::json json{{"device", device.name},
                        {"software", software},
                        {"copy_gb_per_s", 1e-9 * copy},
                        {"volumes", nlohmann::json::array()}};
    for (const std::string& name : names) {
        const std::optional<Case> c = named_volume(name);
        if (!c) throw InputError("the volume '" + name + "' is not available");
        json["volumes"].push_back(measure(*c, settings, copy));
    }
    std::puts(json.dump(2).c_str());
    const bool same = std::all_of(json["volumes"].begin(), json["volumes"].end(), [](const auto& volume) {
        return volume["same_bytes_as_cpu"].template get<bool>();
    });
    return same ? 0 : 1;
}

}  // namespace
}  // namespace marrow::bench

int main(int argc, char** argv) try {
    marrow::bench::Settings settings;
    CLI::App app("Times the extraction on a device of marrow::gpu");
    app.add_option("--device", settings.device, "Number of the device");
    app.add_option("--volumes", settings.volumes, "phantom-N, gyroid-N, waves-N-PERIOD, cranium, vhf-head")
        ->delimiter(',');
    app.add_option("--rounds", settings.rounds, "Rounds, whose medians are printed")
        ->check(CLI::PositiveNumber);
    CLI11_PARSE(app, argc, argv);
    return marrow::bench::run(settings);
} catch (const std::exception& error) {
    std::fprintf(stderr, "marrow-bench-gpu: %s\n", error.what());
    return 1;
}
