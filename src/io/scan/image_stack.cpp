// Reads volumes made of images.
#include "image_stack.h"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include <marrow/error.h>

#include "io/bytes/text.h"
#include "number_gap.h"
#include "parallel_slices.h"

namespace marrow::internal::io {

bool natural_less(const std::filesystem::path& left, const std::filesystem::path& right) {
    const std::string& a = left.native();
    const std::string& b = right.native();
    const auto digit = [](char c) { return c >= '0' && c <= '9'; };
    const auto digits_at = [&](const std::string& s, std::size_t& at) {  // without leading zeros
        std::size_t end = at;
        while (end < s.size() && digit(s[end])) ++end;
        while (at + 1 < end && s[at] == '0') ++at;
        const std::string_view digits(s.data() + at, end - at);
        at = end;
        return digits;
    };
    std::size_t i = 0, j = 0;
    while (i < a.size() && j < b.size()) {
        if (digit(a[i]) && digit(b[j])) {
            const auto x = digits_at(a, i), y = digits_at(b, j);
            if (x.size() != y.size()) return x.size() < y.size();
            if (x != y) return x < y;
        } else {
            if (a[i] != b[j]) return a[i] < b[j];
            ++i, ++j;
        }
    }
    if (i < a.size() || j < b.size()) return i == a.size();
    return a < b;  // such as "01" and "1"
}

namespace {

constexpr double kHeadersDone = 0.2;  // fraction of the progress

// By how much the number in a file's name grows from one file to the next; nothing if the names differ in
// something else.
std::optional<std::int64_t> growth(const std::string& from, const std::string& to) {
    constexpr std::string_view kDigits = "0123456789";
    const auto differ = std::mismatch(from.begin(), from.end(), to.begin(), to.end()).first - from.begin();
    std::size_t begin = static_cast<std::size_t>(differ);
    while (begin > 0 && kDigits.find(from[begin - 1]) != kDigits.npos) --begin;
    const std::size_t end_from = std::min(from.find_first_not_of(kDigits, begin), from.size()),
                      end_to = std::min(to.find_first_not_of(kDigits, begin), to.size());
    const auto first = parse_integer(std::string_view(from).substr(begin, end_from - begin)),
               second = parse_integer(std::string_view(to).substr(begin, end_to - begin));
    if (!first || !second || from.substr(end_from) != to.substr(end_to)) return {};
    return *second - *first;
}

// Warnings if the numbers in the names of slices skip one, or if only some names differ in nothing but a
// number from the next.
std::vector<std::string> doubts_about(const std::vector<std::filesystem::path>& files) {
    const auto name = [&](std::size_t i) { return quoted(files[i].filename()); };
    std::vector<std::optional<std::int64_t>> growths;
    for (std::size_t i = 1; i < files.size(); ++i)
        growths.push_back(growth(files[i - 1].filename().native(), files[i].filename().native()));
    const auto other = std::find(growths.begin(), growths.end(), std::nullopt);
    const bool has_numbers =
        std::any_of(growths.begin(), growths.end(), [](const auto& g) { return g.has_value(); });
    std::vector<std::string> doubts;
    if (has_numbers && other != growths.end()) {
        const auto at = static_cast<std::size_t>(other - growths.begin());
        doubts.push_back(
            fmt::format("the slices {} and {} are named differently: one of them may not belong to the scan",
                        name(at), name(at + 1)));
    }
    if (std::string gap = number_gap(growths, name); !gap.empty()) doubts.push_back(std::move(gap));
    return doubts;
}

[[noreturn]] void refuse_different(const ImageStack& stack, std::size_t i) {
    fail<InputError>(stack.files[i],
                     "differs in size or sample type from {}; all slices of a volume must be the same",
                     quoted(stack.files.front().filename()));
}

}  // namespace

ImageStack read_image_stack(std::vector<std::filesystem::path> files, const ScanOptions& options) {
    const ImageHeader image = read_image_header(files.front());
    if (files.size() > 1 && image.pages != 1) {
        fail<InputError>(files.front(), "has several pages; read this file alone");
    }
    ImageStack stack{std::move(files), image, {}};
    stack.warnings = doubts_about(stack.files);
    stack.geometry.dims = {image.columns, image.rows,
                           image.pages * static_cast<std::int64_t>(stack.files.size())};
    if (options.spacing) stack.geometry.spacing = *options.spacing;
    check_geometry(stack.geometry);
    for_each_slice(stack.files.size(), options.threads, options.progress, 0, kHeadersDone,
                   [&](std::size_t i, const Step& step) {
                       if (read_image_header(stack.files[i]) != image) refuse_different(stack, i);
                       step(1);
                   });
    return stack;
}

Volume load_image_stack(const ImageStack& stack, const ScanOptions& options) {
    Volume volume(stack.geometry, stack.image.type);
    const std::size_t file_bytes = volume.bytes() / stack.files.size();
    for_each_slice(stack.files.size(), options.threads, options.progress, kHeadersDone, 1,
                   [&](std::size_t i, const Step& step) {
                       auto* to = static_cast<std::byte*>(volume.data()) + i * file_bytes;
                       if (!read_image(stack.files[i], stack.image, to, step)) refuse_different(stack, i);
                   });
    return volume;
}

}  // namespace marrow::internal::io
