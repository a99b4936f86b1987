// Reads the names and colours of labels.
#include <marrow/label_table.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include <marrow/error.h>

#include "io/bytes/byte_stream.h"
#include "io/bytes/text.h"

namespace marrow {

using namespace internal::io;

namespace {

struct Word {
    std::string text;
    bool quoted = false;

    std::optional<double> number() const {
        double value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (quoted || error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value))
            return {};
        return value;
    }
};

// Takes text in quotes off the line. Two quotes in it stand for one, as in CSV.
std::string quoted_text(std::string_view& line) {
    std::string text;
    line.remove_prefix(1);
    while (!line.empty()) {
        const std::size_t end = std::min(line.find('"'), line.size());
        text += line.substr(0, end);
        line.remove_prefix(std::min(end + 1, line.size()));
        if (line.empty() || line.front() != '"') break;
        text += '"';
        line.remove_prefix(1);
    }
    return text;
}

// Splits a line at spaces, tabs, commas and semicolons. Text in quotes is one word.
std::vector<Word> words_of(std::string_view line) {
    constexpr std::string_view kBetween = " \t\r,;";
    std::vector<Word> words;
    while (true) {
        line.remove_prefix(std::min(line.find_first_not_of(kBetween), line.size()));
        if (line.empty() || line.front() == '#') return words;
        if (line.front() == '"') {
            words.push_back({quoted_text(line), true});
            continue;
        }
        const std::size_t end = std::min(line.find_first_of(kBetween), line.size());
        words.push_back({std::string(line.substr(0, end)), false});
        line.remove_prefix(end);
    }
}

// The colour in three words from `first` on, if they are numbers from 0 to 255.
std::optional<std::array<double, 3>> colour_at(const std::vector<Word>& words, std::size_t first) {
    if (first + 3 > words.size()) return {};
    std::array<double, 3> colour{};
    for (std::size_t i = 0; i < 3; ++i) {
        const auto value = words[first + i].number();
        if (!value || *value < 0 || *value > 255) return {};
        colour[i] = *value / 255;
    }
    return colour;
}

LabelEntry entry_of(const std::vector<Word>& words) {
    // ITK-SNAP: seven numbers, then the name in quotes.
    if (words.size() == 8 && words.back().quoted) return {words.back().text, colour_at(words, 1)};
    // Three numbers after the name are a colour, or four with alpha.
    std::size_t end = words.size();
    while (end > 2 && words[end - 1].number()) --end;
    const std::size_t numbers = words.size() - end;
    LabelEntry entry;
    for (std::size_t i = 1; i < end; ++i) entry.name += (i > 1 ? " " : "") + words[i].text;
    if (numbers == 3 || numbers == 4) entry.colour = colour_at(words, end);
    return entry;
}

}  // namespace

LabelTable read_label_table(const std::filesystem::path& file) {
    constexpr std::uint64_t kMost = 16 << 20;
    const std::uint64_t size = regular_file_size(file);
    if (size > kMost) throw InputError(fmt::format("{} is too large to be a table of labels", quoted(file)));
    const std::string text = read_head(file, static_cast<std::size_t>(size));
    LabelTable table;
    int line_number = 0;
    std::string_view rest = text;
    constexpr std::string_view kUtf8Mark = "\xEF\xBB\xBF";
    if (rest.starts_with(kUtf8Mark)) rest.remove_prefix(kUtf8Mark.size());
    while (!rest.empty()) {
        const std::vector<Word> words = words_of(take_line(rest));
        ++line_number;
        if (words.empty()) continue;
        const auto label = words.front().number();
        const bool is_label = label && std::trunc(*label) == *label && std::abs(*label) < 9e15;
        if (!is_label || words.size() < 2)
            throw InputError(fmt::format("{}, line {}: is not a label and its name, such as '3 liver'",
                                         quoted(file), line_number));
        if (!table.emplace(static_cast<std::int64_t>(*label), entry_of(words)).second)
            throw InputError(
                fmt::format("{}, line {}: label {} occurs twice", quoted(file), line_number, *label));
    }
    return table;
}

std::array<double, 3> default_label_colour(std::int64_t label) {
    // Hues at steps of the golden section differ from all hues shortly before.
    constexpr double kGolden = 0.61803398874989485, kSaturation = 0.55, kValue = 0.92;
    const double turns = static_cast<double>(label) * kGolden, hue = 6 * (turns - std::floor(turns));
    std::array<double, 3> colour{};
    for (std::size_t i = 0; i < 3; ++i) {
        const double k = std::fmod(5 - 2 * static_cast<double>(i) + hue, 6);
        colour[i] = kValue * (1 - kSaturation * std::max(0.0, std::min({k, 4 - k, 1.0})));
    }
    return colour;
}

}  // namespace marrow
