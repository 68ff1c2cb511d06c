#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "server/operators/ctl/command_line.h"
#include "server/operators/ctl/journal_commands.h"
#include "server/operators/ctl/journal_resample.h"

namespace pheromone::ctl {
namespace {

struct JournalArguments {
  std::string folder;
  std::string format = "csv";
  std::string config;
};

}  // namespace

void AddJournalCommands(CLI::App* program, int* exit_status) {
  const auto arguments = std::make_shared<JournalArguments>();
  CLI::App* journal = program->add_subcommand("journal", "Journals: check, dump, export, resample");
  journal->require_subcommand(1);
  const auto add = [&](const char* name, const char* what, const auto& run) {
    CLI::App* command = journal->add_subcommand(name, what);
    command->add_option("FOLDER", arguments->folder)->required();
    command->callback([=] { *exit_status = run(*arguments); });
    return command;
  };
  add("check", "Verify a journal; print the state it holds and any damage",
      [](const JournalArguments& it) { return CheckJournal(it.folder); });
  add("dump", "Print every record with its file and byte offset",
      [](const JournalArguments& it) { return DumpJournal(it.folder); });
  add("export", "Print the events in order, each once",
      [](const JournalArguments& it) { return ExportJournal(it.folder, it.format); })
      ->add_option("--format", arguments->format, "csv or jsonl (default: csv)")
      ->check(CLI::IsMember({"csv", "jsonl"}))
      ->type_name("FORMAT");
  add("resample", "Move the state of a stopped server to the map of another configuration",
      [](const JournalArguments& it) { return ResampleJournal(it.config, it.folder); })
      ->add_option("--config", arguments->config, "The configuration with the new map")
      ->required()
      ->type_name("FILE");
}

}  // namespace pheromone::ctl
