// The table of names in the library's messages and what the command line calls them.
#include "library_options.h"

#include <array>
#include <cctype>
#include <string_view>

namespace marrow::apps {
namespace {

struct OptionFlag {
    std::string_view option;  // as the library's messages name it
    std::string_view flag;
};

constexpr std::array kFlags{
    // The function that lists series.
    OptionFlag{"inspect_scan", "'marrow info'"},
    // ScanOptions
    OptionFlag{"options.series", "--series"},
    OptionFlag{"options.spacing", "--spacing"},
    OptionFlag{"options.resample", "--resample"},
    OptionFlag{"options.volume", "--volume"},
    OptionFlag{"options.level", "--level"},
    OptionFlag{"options.threads", "--threads"},
    // MeshWriteOptions
    OptionFlag{"options.keep_patient", "--keep-patient"},
    // IsosurfaceOptions
    OptionFlag{"options.snap", "--snap"},
    OptionFlag{"options.topology", "--topology"},
    // SlabLimits
    OptionFlag{"limits.memory", "--max-memory"},
    // TerrainOptions
    OptionFlag{"options.cell", "--cell"},
    OptionFlag{"options.exaggerate", "--exaggerate"},
    OptionFlag{"options.base", "--base"},
    OptionFlag{"options.size", "--size"},
};

bool continues_name(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

}  // namespace

std::string name_flags(std::string message) {
    for (const auto& [option, flag] : kFlags) {
        for (std::size_t at = message.find(option); at != message.npos; at = message.find(option, at)) {
            const std::size_t end = at + option.size();
            // Not within the name of a file.
            const bool begins = at == 0 || message[at - 1] == ' ';
            if (!begins || (end < message.size() && continues_name(message[end]))) {
                at = end;
                continue;
            }
            message.replace(at, option.size(), flag);
            at += flag.size();
        }
    }
    return message;
}

}  // namespace marrow::apps
