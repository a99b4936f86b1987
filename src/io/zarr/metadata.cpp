// Reads the JSON that describes Zarr arrays and groups.
#include "metadata.h"

#include <fmt/format.h>

#include <cmath>

#include <marrow/error.h>

#include "io/bytes/byte_stream.h"
#include "io/bytes/json.h"
#include "io/bytes/text.h"

namespace marrow::internal::io {

Metadata::Metadata(const std::filesystem::path& file)
    : document_(std::make_shared<Document>(Document{file, {}})), name_("it"), json_(&document_->json) {
    constexpr std::uint64_t kLargest = 16 << 20;
    const std::uint64_t size = regular_file_size(file);
    if (size > kLargest) refuse(fmt::format("has {} bytes, more than the {} that are read", size, kLargest));
    document_->json = parse_json_object(read_head(file, kLargest), [&](const char* why) { refuse(why); });
}

void Metadata::refuse(std::string_view why) const {
    throw InputError(fmt::format("{}: Zarr metadata: {}", quoted(file()), why));
}

bool Metadata::has(const char* name) const {
    return json_->is_object() && json_->contains(name) && !(*json_)[name].is_null();
}

Metadata Metadata::at(const char* name) const {
    if (!json_->is_object()) refuse(fmt::format("{} is not an object", name_));
    if (!json_->contains(name)) refuse(fmt::format("'{}' is missing", name));
    return {*this, fmt::format("'{}'", name), (*json_)[name]};
}

std::vector<Metadata> Metadata::elements() const {
    if (!json_->is_array()) refuse(fmt::format("{} is not an array", name_));
    std::vector<Metadata> out;
    for (const nlohmann::json& element : *json_) out.push_back(Metadata(*this, name_, element));
    return out;
}

std::string Metadata::text() const {
    if (!json_->is_string()) refuse(fmt::format("{} is not a string", name_));
    return json_->get<std::string>();
}

std::string Metadata::extension_name() const {
    return json_->is_string() ? text() : at("name").text();
}

double Metadata::number() const {
    if (!json_->is_number()) refuse(fmt::format("{} is not a number", name_));
    const auto value = json_->get<double>();
    if (!std::isfinite(value)) refuse(fmt::format("{} is not finite", name_));
    return value;
}

std::vector<double> Metadata::numbers() const {
    std::vector<double> out;
    for (const Metadata& element : elements()) out.push_back(element.number());
    return out;
}

std::vector<std::int64_t> Metadata::integers(std::int64_t least) const {
    std::vector<std::int64_t> out;
    for (const double value : numbers()) {
        if (value != std::floor(value) || value < static_cast<double>(least) || value > 9007199254740992.0)
            refuse(fmt::format("{} holds {:g}", name_, value));
        out.push_back(static_cast<std::int64_t>(value));
    }
    return out;
}

}  // namespace marrow::internal::io
