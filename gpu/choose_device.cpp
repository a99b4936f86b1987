// Finds the device of a number, of a name, or for any work.
#include "choose_device.h"

#include <algorithm>
#include <cctype>
#include <charconv>

namespace marrow::gpu {

namespace internal {

namespace {

std::string lower_case(std::string_view text) {
    std::string result(text);
    for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return result;
}

bool is_cpu(std::string_view choice) {
    return lower_case(choice) == "cpu";
}

// "0 (NVIDIA A2), 1 (llvmpipe)".
std::string list(const Choices& choices, const std::vector<std::size_t>& numbers) {
    std::string text;
    for (const std::size_t n : numbers)
        text += (text.empty() ? "" : ", ") + std::to_string(n) + " (" + choices.usable[n].name + ')';
    return text;
}

// Why the first of the devices that cannot be used cannot.
std::string first_unusable(const Choices& choices) {
    return choices.unusable.front().device.name + " cannot be used, as " + choices.unusable.front().reason;
}

// What there is instead of what was asked for.
std::string what_there_is(const Choices& choices) {
    std::vector<std::size_t> all(choices.usable.size());
    for (std::size_t n = 0; n < all.size(); ++n) all[n] = n;
    if (!all.empty()) return "there is " + list(choices, all);
    if (choices.unusable.empty()) return choices.why_none;
    return first_unusable(choices);
}

std::optional<std::size_t> best_gpu(const Choices& choices) {
    const auto& usable = choices.usable;
    const auto best = std::min_element(usable.begin(), usable.end(),
                                       [](const Device& a, const Device& b) { return a.kind < b.kind; });
    if (best == usable.end() || best->kind == DeviceKind::software) return {};
    return static_cast<std::size_t>(best - usable.begin());
}

std::size_t demanded_gpu(const Choices& choices) {
    if (const auto gpu = best_gpu(choices)) return *gpu;
    if (choices.usable.empty()) throw DeviceError("there is no GPU: " + what_there_is(choices));
    const std::string why = choices.unusable.empty() ? "" : "; " + first_unusable(choices);
    throw DeviceError("there is no GPU: device 0 (" + choices.usable.front().name +
                      ") is emulated by the CPU, so it is used only if its number or name is given" + why);
}

// The devices that `choice` may mean: that of this number, or those that have this name, or else those that
// have it in their names. Digits alone are a number, never part of a name.
std::vector<std::size_t> find(const Choices& choices, std::string_view choice) {
    if (choice.empty()) return {};
    std::size_t number = 0;
    const char* const end = choice.data() + choice.size();
    const auto [rest, error] = std::from_chars(choice.data(), end, number);
    if (rest == end) {
        if (error != std::errc() || number >= choices.usable.size()) return {};
        return {number};
    }
    std::vector<std::size_t> named, in_name;
    for (std::size_t n = 0; n < choices.usable.size(); ++n) {
        const std::string name = lower_case(choices.usable[n].name), wanted = lower_case(choice);
        if (name == wanted) named.push_back(n);
        if (name.find(wanted) != std::string::npos) in_name.push_back(n);
    }
    return named.empty() ? in_name : named;
}

std::size_t named_device(const Choices& choices, std::string_view choice) {
    const std::vector<std::size_t> found = find(choices, choice);
    const std::string quoted = '\'' + std::string(choice) + '\'';
    if (found.empty()) throw DeviceError("there is no device " + quoted + ": " + what_there_is(choices));
    if (found.size() > 1)
        throw DeviceError("several devices have " + quoted + " in their names: give the number of one, " +
                          list(choices, found));
    return found.front();
}

}  // namespace

std::optional<std::size_t> choose_among(const Choices& choices, std::string_view choice) {
    if (is_cpu(choice)) return {};
    if (lower_case(choice) == "auto") return best_gpu(choices);
    if (lower_case(choice) == "gpu") return demanded_gpu(choices);
    return named_device(choices, choice);
}

}  // namespace internal

const char* device_kind_name(DeviceKind kind) {
    switch (kind) {
        case DeviceKind::discrete:
            return "discrete";
        case DeviceKind::integrated:
            return "integrated";
        case DeviceKind::virtual_gpu:
            return "virtual";
        case DeviceKind::software:
            return "software";
        case DeviceKind::other:
            break;
    }
    return "other";
}

std::optional<std::size_t> choose_device(std::string_view choice) {
    if (internal::is_cpu(choice)) return {};  // without loading Vulkan
    internal::Choices choices{devices(), unusable_devices(), {}};
    if (choices.usable.empty() && choices.unusable.empty()) choices.why_none = why_no_devices();
    return internal::choose_among(choices, choice);
}

}  // namespace marrow::gpu
