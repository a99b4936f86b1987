// Lists the devices, and says which can be used.
#include "devices.h"

#include <algorithm>
#include <ostream>
#include <string>

#include <fmt/format.h>

#include "json_report.h"
#include "results.h"

namespace marrow::apps {
namespace {

DeviceList find_devices() {
    DeviceList list{gpu::devices(), gpu::unusable_devices(), gpu::choose_device("auto"), {}};
    if (list.usable.empty() && list.unusable.empty()) list.why_none = gpu::why_no_devices();
    return list;
}

// What --device auto and gpu do, for people.
std::string automatic_text(const DeviceList& list) {
    if (list.automatic) return fmt::format("--device gpu and auto use device {}.\n", *list.automatic);
    if (list.usable.empty()) return "--device auto uses the CPU.\n";
    return "--device auto uses the CPU; a software device is used only if its number or name is given.\n";
}

void print(std::ostream& out, const DeviceList& list) {
    if (!list.why_none.empty()) {
        out << fmt::format("no devices: {}\n", list.why_none);
        return;
    }
    std::size_t width = 4;
    for (const gpu::Device& device : list.usable) width = std::max(width, device.name.size());
    for (const gpu::UnusableDevice& unusable : list.unusable)
        width = std::max(width, unusable.device.name.size());
    const auto print_row = [&](const std::string& number, const gpu::Device& device,
                               const std::string& note) {
        constexpr double kGibibyte = 1024.0 * 1024 * 1024;
        out << fmt::format("{:<8}{:<{}}  {:<10}  {:>6.1f} GiB  {}\n", number, device.name, width,
                           gpu::device_kind_name(device.kind), static_cast<double>(device.memory) / kGibibyte,
                           note);
    };
    out << fmt::format("{:<8}{:<{}}  {:<10}  {:>10}  {}\n", "device", "name", width, "kind", "memory",
                       "driver");
    for (std::size_t n = 0; n < list.usable.size(); ++n)
        print_row(std::to_string(n), list.usable[n], list.usable[n].driver);
    for (const gpu::UnusableDevice& unusable : list.unusable)
        print_row("-", unusable.device, "cannot be used: " + unusable.reason);
    out << automatic_text(list);
}

}  // namespace

void add_options(Arguments& arguments, DevicesCommandOptions& options) {
    add_json_option(arguments, options.reporting);
}

void run(const DevicesCommandOptions& options, const Console& console) {
    const DeviceList list = find_devices();
    if (options.reporting.json)
        console.out << devices_json(list);
    else
        print(console.out, list);
}

}  // namespace marrow::apps
