/// Reads the JSON that describes Zarr arrays and groups, and refuses what is missing or of another type.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace marrow::internal::io {

/// A value within a metadata file, which knows its file for error messages. Copies share what was read.
class Metadata {
  public:
    /// Reads a metadata file. \throw IoError; InputError it is not JSON, or too large
    explicit Metadata(const std::filesystem::path& file);

    /// \throw InputError "<file>: Zarr metadata: <why>"
    [[noreturn]] void refuse(std::string_view why) const;

    const std::filesystem::path& file() const { return document_->file; }
    const nlohmann::json& json() const { return *json_; }

    /// Whether this is an object with a member that is not null.
    bool has(const char* name) const;
    /// The member of an object. \throw InputError there is none
    Metadata at(const char* name) const;
    /// The elements of an array. \throw InputError it is none
    std::vector<Metadata> elements() const;

    /// The value as the type that it must have. \throw InputError it has another one
    std::string text() const;
    /// The name of a codec or another extension of Zarr 3: {"name": ...}, or the name alone.
    std::string extension_name() const;
    double number() const;
    /// Whole numbers from `least` to 2^53, which a double holds exactly.
    std::vector<std::int64_t> integers(std::int64_t least) const;
    std::vector<double> numbers() const;

  private:
    struct Document {
        std::filesystem::path file;
        nlohmann::json json;
    };

    /// A value inside another one.
    Metadata(const Metadata& outer, std::string name, const nlohmann::json& json)
        : document_(outer.document_), name_(std::move(name)), json_(&json) {}

    std::shared_ptr<Document> document_;
    std::string name_;            // of the value, for messages
    const nlohmann::json* json_;  // in the document
};

}  // namespace marrow::internal::io
