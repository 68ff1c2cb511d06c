// What the command lines of all programs have in common: how help and errors read.
//
//   CLI::App app("...", "pheromonectl");
//   pheromone::Standardise(&app);  // before its options and commands are added
#pragma once

#include <memory>
#include <regex>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace pheromone {

/// Help that names a value once: "--id 1 to 254" in place of CLI11's "--id INT:1 to 254".
class HelpFormatter final : public CLI::Formatter {
 public:
  std::string make_option_name(const CLI::Option* option, bool is_positional) const override {
    const std::string name = CLI::Formatter::make_option_name(option, is_positional);
    return name.substr(0, name.find('{'));  // "--no-bumpers{false}"
  }

  std::string make_option_opts(const CLI::Option* option) const override {
    static const std::regex choice(R"((\w+:)?\{([^}]*)\})");
    static const std::regex twice(R"((\w+):\1\b)");
    static const std::regex kind(R"(\b(INT|UINT|FLOAT|TEXT):)");
    std::string text = CLI::Formatter::make_option_opts(option);
    text = std::regex_replace(text, choice, "$2");
    text = std::regex_replace(text, twice, "$1");
    return std::regex_replace(text, kind, "");
  }
};

/// An error in one line after the program's name, with the command that helps. An unknown command
/// is told with those that there are, a missing option with what it is for.
inline std::string ExplainError(const CLI::App* app, const CLI::Error& error) {
  std::string what = error.what();
  const CLI::App* last = app;
  std::string words;
  while (!last->get_subcommands().empty()) {
    last = last->get_subcommands().front();
    words += last->get_name() + ' ';
  }
  const std::vector<std::string> unknown = app->remaining(true);
  const auto known = last->get_subcommands([](const CLI::App*) { return true; });
  std::string names;
  for (const CLI::App* it : known) {
    names += (names.empty() ? "" : ", ") + it->get_name();
  }
  if (!known.empty() && !unknown.empty() && unknown.front().front() != '-') {
    what = "unknown command \"" + words + unknown.front() + "\", expected one of " + names;
  } else if (!known.empty() && last->get_subcommands().empty() && unknown.empty() &&
             error.get_name() == "RequiredError") {
    what = "a command is missing, expected one of " + names;
  }
  for (const CLI::Option* it : last->get_options()) {
    if (what == it->get_name() + " is required") {
      what += ": " + it->get_description();
    }
  }
  return app->get_name() + ": " + what + "\nTry " + app->get_name() + ' ' + words + "--help\n";
}

inline void Standardise(CLI::App* app) {
  app->formatter(std::make_shared<HelpFormatter>());
  app->failure_message(ExplainError);
}

}  // namespace pheromone
