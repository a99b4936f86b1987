/// Parses the JSON of untrusted files.
#pragma once

#include <string_view>

#include <nlohmann/json.hpp>

namespace marrow::internal::io {

/// The object that a JSON text consists of. Otherwise it calls refuse(why), which throws. What copies or
/// prints a value recurses into it, so that deeply nested values would overflow the stack.
template <class Refuse>
nlohmann::json parse_json_object(std::string_view text, const Refuse& refuse) {
    constexpr int kMostDepth = 32;
    const auto check_depth = [&](int depth, nlohmann::json::parse_event_t, const nlohmann::json&) {
        if (depth > kMostDepth) refuse("its JSON is nested too deeply");
        return true;
    };
    nlohmann::json json = nlohmann::json::parse(text, check_depth, false);
    if (json.is_discarded()) refuse("its JSON is not valid");
    if (!json.is_object()) refuse("its JSON is not an object");
    return json;
}

}  // namespace marrow::internal::io
