/// The values of options: how they are read from text, and what they must be.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include <marrow/vector.h>

namespace marrow::apps {

/// The value that an option takes.
struct Value {
    std::string name;      ///< in the help, such as "MM" or "FILE.png"
    std::string expected;  ///< in messages: "--keep takes EXPECTED, not '2'"
    /// Stores the value; false if the text is not what is expected.
    std::function<bool(const std::string& text)> store;
    bool may_repeat = false;   ///< the option may be given several times
    bool may_be_left = false;  ///< the option may stand alone; `store` then receives an empty text
};

/// Text with its ASCII letters in lower case.
std::string lower_case(std::string text);

/// A finite number, with a point whatever the locale, and nothing after it.
std::optional<double> parse_number(std::string_view text);

/// `count` numbers separated by commas; writes them to `numbers`. False if the text is anything else.
bool parse_numbers(std::string_view text, double* numbers, std::size_t count);

/// Text as it is.
Value text_value(std::string name, std::string& to);
Value text_value(std::string name, std::optional<std::string>& to);

/// A file; `extension`, if not empty, is the only one that is accepted.
Value file_value(std::string name, std::filesystem::path& to, std::string_view extension = {});

/// A whole number from `least` to `most`.
Value integer_value(std::string name, int& to, int least, int most);
Value integer_value(std::string name, std::int64_t& to, std::int64_t least);
Value integer_value(std::string name, std::optional<std::int64_t>& to, std::int64_t least);

/// A number that `accepts` accepts; `expected` says in words which those are.
Value number_value(std::string name, std::string expected, double& to, bool (*accepts)(double));
Value number_value(std::string name, std::string expected, std::optional<double>& to,
                   bool (*accepts)(double));

/// Three positive numbers, in mm.
Value spacing_value(std::optional<Vec3d>& to);

/// A size in bytes, such as 800M.
Value memory_value(std::optional<std::size_t>& to);

}  // namespace marrow::apps
