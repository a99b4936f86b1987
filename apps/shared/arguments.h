/// Declares the options of commands and reads the command line.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <memory>
#include <string>
#include <vector>

#include "values.h"

namespace marrow::apps {

/// The texts in the help of a program or command, besides those of the options.
struct CommandHelp {
    std::string description;  ///< one sentence
    std::string usage;        ///< such as "marrow info [OPTIONS] INPUT..."
    std::string footer;       ///< follows the options; lines of at most 100 columns
};

/// The options of a program, and of its commands. Only arguments.cpp includes CLI11, whose headers compile
/// slowly.
class Arguments {
  public:
    /// A program of this name.
    Arguments(const std::string& name, const CommandHelp& help);
    ~Arguments();

    /// Adds a command to the program. The reference lives as long as the program.
    Arguments& add_command(const std::string& name, const CommandHelp& help);

    /// Adds a command that is a program of its own, so that the help lists it.
    void add_program(const std::string& name, const std::string& description);

    /// Starts a group of options with its own title in the help. "Input" follows the input itself; options
    /// before the first group are "General", the last group.
    void start_group(const std::string& title);

    /// Adds an option with a value. `names` are separated by commas: "-o,--output".
    void add_option(const std::string& names, Value value, const std::string& help);

    /// Adds an option without a value, which sets `to`.
    void add_flag(const std::string& names, bool& to, const std::string& help);

    /// Adds the input: one file or folder, which may be left out.
    void add_input(const std::string& name, std::filesystem::path& to, const std::string& help);

    /// Adds several inputs, at least one.
    void add_inputs(const std::string& name, std::vector<std::filesystem::path>& to, const std::string& help);

    /// Reads the command line and stores all values. Prints help or the version to `out` and returns false if
    /// that is wanted instead: by --help, or by "help COMMAND".
    /// \throw UsageError the first word that is wrong
    bool parse(int argc, const char* const* argv, std::ostream& out);

    /// Whether this command was named on the command line.
    bool is_chosen() const;

    /// The options that were given, each by its long name.
    std::vector<std::string> given() const;

  private:
    struct Command;
    explicit Arguments(std::unique_ptr<Command> command);

    std::unique_ptr<Command> command_;
};

}  // namespace marrow::apps
