// Reads the names and colours of labels.
#include <marrow/label_table.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>
#include <utility>
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
    bool field = false;  // a comma, a semicolon or a tab is before it

    std::optional<double> number() const {
        double value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (quoted || error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value))
            return {};
        return value;
    }
};

// The label in a word: an integer, also as 4.0.
std::optional<std::int64_t> label_in(const Word& word) {
    std::int64_t label = 0;
    const char* const end = word.text.data() + word.text.size();
    const auto parsed = std::from_chars(word.text.data(), end, label);
    if (!word.quoted && parsed.ec == std::errc{} && parsed.ptr == end) return label;
    const auto number = word.number();
    if (!number || std::trunc(*number) != *number || !(std::abs(*number) < 9e15)) return {};
    return static_cast<std::int64_t>(*number);
}

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

// Splits a line at spaces, tabs, commas and semicolons. Text in quotes is one word. Two commas have an empty
// word between them.
std::vector<Word> words_of(std::string_view line) {
    constexpr std::string_view kBetween = " \t\r,;";
    std::vector<Word> words;
    while (true) {
        const std::string_view between =
            line.substr(0, std::min(line.find_first_not_of(kBetween), line.size()));
        line.remove_prefix(between.size());
        if (line.empty()) return words;
        const auto commas =
            std::count_if(between.begin(), between.end(), [](char c) { return c == ',' || c == ';'; });
        for (auto empty = commas; empty > 1 && !words.empty(); --empty) words.push_back({"", false, true});
        const bool field = commas > 0 || between.find('\t') != between.npos;
        if (line.front() == '"') {
            words.push_back({quoted_text(line), true, field});
            continue;
        }
        const std::size_t end = std::min(line.find_first_of(kBetween), line.size());
        words.push_back({std::string(line.substr(0, end)), false, field});
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

struct Line {
    LabelEntry entry;
    int bare_colour = 0;  // the numbers of a colour that is set off from the name by blanks alone
};

Line parse(const std::vector<Word>& words) {
    // ITK-SNAP: seven numbers, then the name in quotes.
    if (words.size() == 8 && words.back().quoted) return {{words.back().text, colour_at(words, 1)}};
    // Three numbers after the name are a colour, or four with alpha. The name can end in a number, too.
    std::size_t numbers = 0, fields = 0;
    for (; numbers + 2 < words.size(); ++numbers) {
        const Word& word = words[words.size() - 1 - numbers];
        if (!word.number()) break;
        fields += fields == numbers && word.field ? 1 : 0;
    }
    const bool bare = fields < 3;
    if (!bare)
        numbers = fields;
    else if (numbers > 4 && words.back().number() == 255 && colour_at(words, words.size() - 4))
        numbers = 4;  // FreeSurfer has a type of tissue after alpha, but never as large
    const std::size_t end = words.size() - numbers;
    Line line;
    for (std::size_t i = 1; i < end; ++i) {
        if (!words[i].text.empty()) line.entry.name += (line.entry.name.empty() ? "" : " ") + words[i].text;
    }
    if (numbers == 3 || numbers == 4) line.entry.colour = colour_at(words, end);
    if (line.entry.colour && bare && !words[end - 1].quoted) line.bare_colour = static_cast<int>(numbers);
    return line;
}

}  // namespace

LabelTable read_label_table(const std::filesystem::path& file) {
    constexpr std::uint64_t kMost = 16 << 20;
    const std::uint64_t size = regular_file_size(file);
    if (size > kMost) throw InputError(fmt::format("{} is too large to be a table of labels", quoted(file)));
    const std::string text = read_head(file, static_cast<std::size_t>(size));
    LabelTable table;
    int line_number = 0;
    int line_with_three = 0, line_with_four = 0;  // the first with as many numbers of a bare colour
    std::string_view rest = text;
    constexpr std::string_view kUtf8Mark = "\xEF\xBB\xBF";
    if (rest.starts_with(kUtf8Mark)) rest.remove_prefix(kUtf8Mark.size());
    while (!rest.empty()) {
        const std::string_view text_of_line = take_line(rest);
        ++line_number;
        if (trimmed(text_of_line).starts_with('#')) continue;
        std::vector<Word> words = words_of(text_of_line);
        words.erase(std::find_if(words.begin(), words.end(),
                                 [](const Word& word) { return word.text == "#" && !word.quoted; }),
                    words.end());
        if (words.empty()) continue;
        const std::optional<std::int64_t> label = label_in(words.front());
        if (!label || words.size() < 2)
            throw InputError(fmt::format("{}, line {}: is not a label and its name, such as '3 liver'",
                                         quoted(file), line_number));
        Line line = parse(words);
        if (line.bare_colour == 3 && line_with_three == 0) line_with_three = line_number;
        if (line.bare_colour == 4 && line_with_four == 0) line_with_four = line_number;
        if (!table.emplace(*label, std::move(line.entry)).second)
            throw InputError(
                fmt::format("{}, line {}: label {} occurs twice", quoted(file), line_number, *label));
    }
    if (line_with_three > 0 && line_with_four > 0)
        throw InputError(
            fmt::format("{}, line {}: the first of four numbers may belong to the name, as line {} has only "
                        "three; put the name in quotes",
                        quoted(file), line_with_four, line_with_three));
    return table;
}

LabelTable completed(LabelTable table, const LabelTable& others) {
    for (const auto& [label, other] : others) {
        LabelEntry& entry = table[label];
        if (entry.name.empty()) entry.name = other.name;
        if (!entry.colour) entry.colour = other.colour;
    }
    return table;
}

std::array<double, 3> default_label_colour(std::int64_t label) {
    // Hues at steps of the golden section differ from all hues shortly before. For a large label, a double
    // would have no digits left for the fraction of the product, so that fraction is computed in 64 bits.
    constexpr double kGolden = 0.61803398874989485, kSaturation = 0.55, kValue = 0.92;
    const bool is_large = label != static_cast<std::int32_t>(label);
    const double turns =
        is_large ? std::ldexp(
                       static_cast<double>(static_cast<std::uint64_t>(label) * 0x9e3779b97f4a7c15 >> 11), -53)
                 : static_cast<double>(label) * kGolden;
    const double hue = 6 * (turns - std::floor(turns));
    std::array<double, 3> colour{};
    for (std::size_t i = 0; i < 3; ++i) {
        const double k = std::fmod(5 - 2 * static_cast<double>(i) + hue, 6);
        colour[i] = kValue * (1 - kSaturation * std::max(0.0, std::min({k, 4 - k, 1.0})));
    }
    return colour;
}

LabelEntry label_entry(const LabelTable& table, std::int64_t label) {
    const auto at = table.find(label);
    LabelEntry entry = at != table.end() ? at->second : LabelEntry{};
    if (entry.name.empty()) entry.name = fmt::format("label-{}", label);
    if (!entry.colour) entry.colour = default_label_colour(label);
    return entry;
}

}  // namespace marrow
