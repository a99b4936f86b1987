// Reads command lines with CLI11.
#include "arguments.h"

#include <algorithm>
#include <ostream>
#include <set>
#include <sstream>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include <marrow/version.h>

#include "console.h"
#include "suggestions.h"

namespace marrow::apps {
namespace fs = std::filesystem;
namespace {

constexpr const char *kInputGroup = "Input", *kGeneralGroup = "General";
constexpr std::size_t kHelpWidth = 100, kNameWidth = 30;

// CLI11 2.1 does not break lines.
std::string wrapped(const std::string& text, std::size_t width) {
    std::string result;
    std::size_t column = 0;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find(' ', at), text.size());
        const std::size_t length = end - at;
        if (column > 0 && column + 1 + length > width) {
            result += '\n';
            column = 0;
        } else if (column > 0) {
            result += ' ';
            ++column;
        }
        result.append(text, at, length);
        column += length;
        at = end + 1;
    }
    return result;
}

// CLI11's help with wrapped lines, our own usage, and the general options last.
class HelpFormatter : public CLI::Formatter {
  public:
    explicit HelpFormatter(std::string usage) : usage_(std::move(usage)) {
        column_width(kNameWidth);
        label("Positionals", kInputGroup);
    }

    std::string make_help(const CLI::App* app, std::string, CLI::AppFormatMode mode) const override {
        return make_description(app) + "Usage: " + usage_ + "\n" + make_subcommands(app, mode) + input(app) +
               groups(app) + "\n" + make_footer(app);
    }
    std::string make_description(const CLI::App* app) const override {
        return wrapped(app->get_description(), kHelpWidth) + "\n";
    }
    std::string make_option_desc(const CLI::Option* option) const override {
        return wrapped(option->get_description(), kHelpWidth - kNameWidth);
    }
    std::string make_subcommand(const CLI::App* command) const override {
        std::ostringstream out;
        CLI::detail::format_help(out, command->get_name(),
                                 wrapped(command->get_description(), kHelpWidth - kNameWidth), kNameWidth);
        return out.str();
    }

  private:
    // The options of the input are listed with it.
    std::string input(const CLI::App* app) const {
        std::string text = make_positionals(app);
        for (const CLI::Option* option : app->get_options()) {
            if (option->get_group() == kInputGroup && option->nonpositional())
                text += make_option(option, false);
        }
        return text;
    }

    std::string groups(const CLI::App* app) const {
        std::vector<std::string> names = app->get_groups();
        std::stable_partition(names.begin(), names.end(),
                              [](const std::string& name) { return name != kGeneralGroup; });
        std::string text;
        for (const std::string& name : names) {
            const auto options = app->get_options([&](const CLI::Option* option) {
                return option->get_group() == name && option->nonpositional();
            });
            if (name != kInputGroup && !options.empty()) text += make_group(name, false, options);
        }
        return text;
    }

    const std::string usage_;
};

void set_up(CLI::App& app, const CommandHelp& help) {
    app.description(help.description);
    app.footer(help.footer);
    app.formatter(std::make_shared<HelpFormatter>(help.usage));
    app.get_help_ptr()->group(kGeneralGroup);
}

bool is_option(const std::string& word) {
    return word.size() > 1 && word.front() == '-';
}

// The name in a word such as "-o", "-oFILE", "--output" or "--output=FILE".
std::string option_name(const std::string& word) {
    return word.starts_with("--") ? word.substr(0, word.find('=')) : word.substr(0, 2);
}

bool has_value_attached(const std::string& word) {
    return word != option_name(word);
}

std::vector<std::string> names_of_options(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::Option* option : app.get_options()) {
        for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
    return names;
}

// Empty if the program has no commands; then "help" is none either.
std::vector<std::string> names_of_commands(const CLI::App& program) {
    std::vector<std::string> names;
    for (const CLI::App* command : program.get_subcommands({})) names.push_back(command->get_name());
    if (!names.empty()) names.emplace_back("help");
    return names;
}

// Finds the first word of a command line that is wrong. CLI11 would report all words that it cannot use, in
// which the one mistake hides.
class WordCheck {
  public:
    explicit WordCheck(const CLI::App& program) : program_(program), app_(&program) {}

    // Returns the number of inputs; 0 if help is wanted instead. \throw UsageError
    int check(const std::vector<std::string>& words) {
        if (std::any_of(words.begin(), words.end(), [](const std::string& word) {
                return word == "-h" || word == "--help" || word == "--version";
            }))
            return 0;  // help comes before mistakes
        for (auto word = words.begin(); word != words.end(); ++word) {
            if (*word == "--") {
                std::for_each(word + 1, words.end(), [&](const std::string& input) { add_input(input); });
                break;
            }
            if (!is_option(*word)) {
                add_word(*word);
                continue;
            }
            std::string name = *word;
            const CLI::Option* option = &add_option(name);
            // In "-qo FILE", the last one takes the value.
            while (option->get_items_expected_max() == 0 && !name.starts_with("--") && name.size() > 2) {
                name.erase(1, 1);
                option = &add_option(name);
            }
            if (option->get_items_expected_max() == 0 && name.find('=') != name.npos)
                refuse(option_name(name) + " takes no value");
            if (name.starts_with("--") && name.find('=') == name.size() - 1)
                refuse(fmt::format("{} needs a value", name));
            if (option->get_items_expected_max() == 0 || has_value_attached(name)) continue;
            const bool has_next = word + 1 != words.end(), must_have = option->get_expected_min() > 0;
            if (must_have && !has_next) refuse(name + " needs a value");
            if (must_have && names_option(*(word + 1)))
                refuse(fmt::format("{} needs a value, but {} follows", name, *(word + 1)));
            if (must_have || (has_next && !is_option(*(word + 1)))) ++word;
        }
        return static_cast<int>(inputs_.size());
    }

  private:
    [[noreturn]] void refuse(const std::string& what) const {
        throw UsageError(fmt::format("{} (see {} --help)", what, full_name()));
    }

    std::string full_name() const {
        return app_ == &program_ ? program_.get_name() : program_.get_name() + " " + app_->get_name();
    }

    bool names_option(const std::string& word) const {
        return is_option(word) && app_->get_option_no_throw(option_name(word)) != nullptr;
    }

    const CLI::Option& add_option(const std::string& word) {
        const std::string name = option_name(word);
        const CLI::Option* option = app_->get_option_no_throw(name);
        if (option != nullptr && name.size() == 2 && word.starts_with(name + "="))
            refuse(
                fmt::format("'=' goes only with long names of options: write '{} {}'", name, word.substr(3)));
        if (option == nullptr)
            refuse(fmt::format("there is no option {}{}", name, did_you_mean(name, names_of_options(*app_))));
        const bool repeated = !options_.insert(option).second;
        if (repeated && option->get_items_expected_max() == 1) refuse(fmt::format("{} is given twice", name));
        return *option;
    }

    void add_word(const std::string& word) {
        const bool is_first = app_ == &program_ && inputs_.empty();
        const auto commands =
            program_.get_subcommands([&](const CLI::App* command) { return command->get_name() == word; });
        if (!is_first || commands.empty()) return add_input(word);
        if (!options_.empty())
            refuse(fmt::format("'{0}' must come first: {1} {0} ...", word, program_.get_name()));
        app_ = commands[0];
    }

    void add_input(const std::string& word) {
        std::error_code ignored;
        if (app_ == &program_ && inputs_.empty() && !fs::exists(word, ignored)) {
            const std::string suggestion = did_you_mean(word, names_of_commands(program_));
            if (!suggestion.empty()) refuse(fmt::format("there is no command '{}'{}", word, suggestion));
        }
        inputs_.push_back(word);
        const auto options = app_->get_options([](const CLI::Option* o) { return o->get_positional(); });
        if (!options.empty() &&
            inputs_.size() > static_cast<std::size_t>(options[0]->get_items_expected_max())) {
            if (app_ == &program_ && !names_of_commands(program_).empty() && !fs::exists(inputs_[0], ignored))
                refuse(fmt::format("'{}': there is no such command, and no such file or folder", inputs_[0]));
            refuse(fmt::format("there are several inputs, '{}' and '{}': give one", inputs_[0], word));
        }
    }

    const CLI::App& program_;
    const CLI::App* app_;  // the command, or the program itself
    std::set<const CLI::Option*> options_;
    std::vector<std::string> inputs_;
};

// "help info" means "info --help".
std::vector<std::string> without_help_command(std::vector<std::string> words, const CLI::App& program) {
    const std::vector<std::string> commands = names_of_commands(program);
    if (commands.empty() || words.empty() || words[0] != "help") return words;
    words.erase(words.begin());
    if (words.size() > 1) throw UsageError("help takes one command: marrow help [COMMAND]");
    if (!words.empty() && std::find(commands.begin(), commands.end(), words[0]) == commands.end())
        throw UsageError(
            fmt::format("there is no command '{}'{}", words[0], did_you_mean(words[0], commands)));
    if (words == std::vector<std::string>{"help"}) words.clear();
    words.push_back("--help");
    return words;
}

}  // namespace

struct Arguments::Command {
    struct Entry {
        CLI::Option* option;
        Value value;
    };

    std::unique_ptr<CLI::App> root;  // only of a program
    CLI::App* app = nullptr;
    CLI::Option* inputs = nullptr;  // only of a command that takes several
    std::string group = kGeneralGroup;
    std::vector<Entry> entries;
    std::vector<std::unique_ptr<Arguments>> commands;
    CLI::Option* add(const std::string& names, Value value, const std::string& help) {
        // The texts are stored after parsing, so that --help comes before mistakes.
        CLI::Option* option = app->add_option(
            names, [](const CLI::results_t&) { return true; }, help);
        option->group(group)->type_size(1)->option_text(value.name);
        entries.push_back({option, std::move(value)});
        return option;
    }

    // Unless CLI11 knows the number of inputs, it takes '[a,b]' for the files a and b.
    void expect(int count) const {
        if (inputs && count > 0) inputs->expected(count)->allow_extra_args(false);
    }

    void store() const {
        for (const auto& [option, value] : entries) {
            for (const std::string& text : option->results()) {
                if (!value.store(text))
                    throw UsageError(
                        fmt::format("{} takes {}, not '{}'", option->get_name(), value.expected, text));
            }
        }
    }
};

Arguments::Arguments(const std::string& name, const CommandHelp& help)
    : command_(std::make_unique<Command>()) {
    command_->root = std::make_unique<CLI::App>("", name);
    command_->app = command_->root.get();
    command_->root->require_subcommand(0, 1);  // so that files may have the names of commands
    command_->app->set_help_flag("-h,--help", "Print this help and exit.");
    set_up(*command_->app, help);
    command_->app->set_version_flag("--version", "marrow " MARROW_VERSION, "Print the version and exit.")
        ->group(kGeneralGroup);
}

Arguments::Arguments(std::unique_ptr<Command> command) : command_(std::move(command)) {}

Arguments::~Arguments() = default;

Arguments& Arguments::add_command(const std::string& name, const CommandHelp& help) {
    auto command = std::make_unique<Command>();
    command->app = command_->app->add_subcommand(name)->group("Commands");
    set_up(*command->app, help);
    command_->commands.emplace_back(new Arguments(std::move(command)));
    return *command_->commands.back();
}

void Arguments::add_program(const std::string& name, const std::string& description) {
    command_->app->add_subcommand(name, description)->group("Commands")->allow_extras();
}

void Arguments::start_group(const std::string& title) {
    command_->group = title;
}

void Arguments::add_option(const std::string& names, Value value, const std::string& help) {
    const bool may_repeat = value.may_repeat, may_be_left = value.may_be_left;
    CLI::Option* option = command_->add(names, std::move(value), help);
    if (may_repeat)
        option->expected(CLI::detail::expected_max_vector_size)->allow_extra_args(false);
    else
        option->expected(may_be_left ? 0 : 1, 1);
}

void Arguments::add_flag(const std::string& names, bool& to, const std::string& help) {
    command_->app
        ->add_flag(
            names, [&to](std::int64_t count) { to = count > 0; }, help)
        ->group(command_->group);
}

void Arguments::add_input(const std::string& name, fs::path& to, const std::string& help) {
    command_->add(name, file_value(name, to), help)->expected(1)->option_text(" ");
}

void Arguments::add_inputs(const std::string& name, std::vector<fs::path>& to, const std::string& help) {
    const auto store = [&to](const std::string& text) {
        to.emplace_back(text);
        return true;
    };
    command_->inputs = command_->add(name, {name, "a file", store}, help);
    command_->inputs->expected(CLI::detail::expected_max_vector_size)->required()->option_text(" ");
}

bool Arguments::parse(int argc, const char* const* argv, std::ostream& out) {
    CLI::App& app = *command_->app;
    std::vector<std::string> words = without_help_command({argv + 1, argv + argc}, app);
    const int inputs = WordCheck(app).check(words);
    command_->expect(inputs);
    for (const auto& command : command_->commands) command->command_->expect(inputs);
    try {
        std::reverse(words.begin(), words.end());  // as CLI11 wants them
        app.parse(std::move(words));
    } catch (const CLI::CallForHelp&) {
        out << app.help();
        return false;
    } catch (const CLI::CallForVersion& version) {
        out << version.what() << '\n';
        return false;
    } catch (const CLI::ParseError& error) {
        std::string name = app.get_name();
        for (const CLI::App* command : app.get_subcommands()) name += " " + command->get_name();
        throw UsageError(fmt::format("{} (see {} --help)", error.what(), name));
    }
    command_->store();
    for (const auto& command : command_->commands) command->command_->store();
    return true;
}

bool Arguments::is_chosen() const {
    return command_->app->parsed();
}

std::vector<std::string> Arguments::given() const {
    std::vector<std::string> names;
    for (const CLI::Option* option : command_->app->get_options()) {
        if (option->count() > 0 && option->nonpositional()) names.push_back(option->get_name());
    }
    return names;
}

}  // namespace marrow::apps
