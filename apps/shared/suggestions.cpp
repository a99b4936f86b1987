// Compares names by the number of typing mistakes between them.
#include "suggestions.h"

#include <algorithm>
#include <iterator>
#include <string_view>

namespace marrow::apps {
namespace {

// How many letters must be inserted, removed, replaced or swapped with the next to turn `a` into `b` (the
// optimal string alignment distance, after Damerau 1964).
std::size_t typing_mistakes(std::string_view a, std::string_view b) {
    // mistakes[i][j] is the distance between the first i letters of `a` and the first j of `b`.
    std::vector<std::vector<std::size_t>> mistakes(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
    for (std::size_t i = 0; i <= a.size(); ++i) {
        for (std::size_t j = 0; j <= b.size(); ++j) {
            if (i == 0 || j == 0) {
                mistakes[i][j] = i + j;
                continue;
            }
            const std::size_t replaced = mistakes[i - 1][j - 1] + (a[i - 1] != b[j - 1]);
            mistakes[i][j] = std::min({replaced, mistakes[i - 1][j] + 1, mistakes[i][j - 1] + 1});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                mistakes[i][j] = std::min(mistakes[i][j], mistakes[i - 2][j - 2] + 1);
        }
    }
    return mistakes.back().back();
}

std::string_view without_dashes(std::string_view name) {
    return name.substr(std::min(name.find_first_not_of('-'), name.size()));
}

// One mistake in three letters is forgiven.
std::vector<std::string> closest(const std::string& name, const std::vector<std::string>& known) {
    std::vector<std::string> found;
    std::size_t fewest = without_dashes(name).size() / 3;
    for (const std::string& candidate : known) {
        const std::size_t mistakes = typing_mistakes(without_dashes(name), without_dashes(candidate));
        if (mistakes > fewest || mistakes >= without_dashes(candidate).size()) continue;
        if (mistakes < fewest) found.clear();
        fewest = mistakes;
        found.push_back(candidate);
    }
    return found;
}

}  // namespace

std::string did_you_mean(const std::string& name, const std::vector<std::string>& known) {
    std::vector<std::string> found = closest(name, known);
    if (found.empty()) {  // perhaps it was cut short
        std::copy_if(known.begin(), known.end(), std::back_inserter(found),
                     [&](const std::string& candidate) {
                         return without_dashes(candidate).starts_with(without_dashes(name));
                     });
    }
    constexpr std::size_t kMost = 5;
    if (found.empty() || found.size() > kMost) return {};
    std::string text = ": did you mean ";
    for (std::size_t i = 0; i < found.size(); ++i) {
        if (i > 0) text += i + 1 < found.size() ? ", " : " or ";
        text += found[i];
    }
    return text + "?";
}

}  // namespace marrow::apps
