// Reads command lines with CLI11.
#include "arguments.h"

#include <ostream>
#include <sstream>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include <marrow/version.h>

#include "console.h"

namespace marrow::cli {
namespace fs = std::filesystem;
namespace {

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

// CLI11's help with wrapped lines and our own usage.
class HelpFormatter : public CLI::Formatter {
  public:
    explicit HelpFormatter(std::string usage) : usage_(std::move(usage)) {
        column_width(kNameWidth);
        label("Positionals", "Input");
    }

    std::string make_usage(const CLI::App*, std::string) const override { return "Usage: " + usage_ + "\n"; }
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
    const std::string usage_;
};

void set_up(CLI::App& app, const CommandHelp& help) {
    app.description(help.description);
    app.footer(help.footer);
    app.formatter(std::make_shared<HelpFormatter>(help.usage));
}

}  // namespace

struct Arguments::Command {
    struct Entry {
        CLI::Option* option;
        Value value;
    };

    std::unique_ptr<CLI::App> root;  // only of a program
    CLI::App* app = nullptr;
    std::string group = "Options";
    std::vector<Entry> entries;
    std::vector<std::unique_ptr<Arguments>> commands;
    std::vector<CLI::App*> programs;

    CLI::Option* add(const std::string& names, Value value, const std::string& help) {
        // The texts are stored after parsing, so that --help comes before mistakes.
        CLI::Option* option = app->add_option(
            names, [](const CLI::results_t&) { return true; }, help);
        option->group(group)->type_size(1)->option_text(value.name);
        entries.push_back({option, std::move(value)});
        return option;
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
    set_up(*command_->app, help);
    command_->app->set_help_flag("-h,--help", "Print this help and exit.");
    command_->app->set_version_flag("--version", "marrow " MARROW_VERSION, "Print the version and exit.");
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
    command_->programs.push_back(
        command_->app->add_subcommand(name, description)->group("Commands")->allow_extras());
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
    command_->add(name, {name, "a file", store}, help)
        ->expected(CLI::detail::expected_max_vector_size)
        ->required()
        ->option_text(" ");
}

bool Arguments::parse(int argc, const char* const* argv, std::ostream& out) {
    CLI::App& app = *command_->app;
    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        // CLI11 separates groups by two empty lines.
        out << CLI::detail::find_and_replace(app.help(), "\n\n\n", "\n\n");
        return false;
    } catch (const CLI::CallForVersion& version) {
        out << version.what() << '\n';
        return false;
    } catch (const CLI::ParseError& error) {
        throw UsageError(fmt::format("{} (see {} --help)", error.what(), app.get_name()));
    }
    for (const CLI::App* program : command_->programs) {
        if (program->parsed())
            throw UsageError(fmt::format("'{0}' must come first: marrow {0} ...", program->get_name()));
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

}  // namespace marrow::cli
