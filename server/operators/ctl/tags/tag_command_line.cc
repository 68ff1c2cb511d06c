#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "server/base/number_check.h"
#include "server/core/tags/tag.h"
#include "server/operators/ctl/command_line.h"
#include "server/operators/ctl/tags/tag_commands.h"
#include "server/operators/ctl/tags/tag_files.h"

namespace pheromone::ctl {
namespace {

struct TagArguments {
  TagNote note;
  std::vector<std::string> words;
  std::optional<int> slot;
  bool all = false;
  tags::Maker maker;
  int id = 0;
  std::vector<std::string> examples;
  TagFile file;
  std::vector<std::string> names;
};

void AddWrite(CLI::App* tags, const ServerOptions* options, const std::shared_ptr<TagArguments>& it,
              int* exit_status) {
  CLI::App* write = tags->add_subcommand("write", "Write a sentence on a tag");
  write->add_option("NAME", it->note.tag, "Name of the tag")->required();
  write
      ->add_option("SENTENCE", it->words,
                   "Subject, predicate and object, such as \"15 lookingfortag 244\"")
      ->required();
  write->add_option("--author", it->note.author, "Unique ID of the author (default: operator)")
      ->type_name("ID");
  write->add_flag("--replace", it->note.replace,
                  "Replace what the author wrote about the same subject and predicate");
  write->add_option("--lease", it->note.lease_s, "Protect it for this time, then erase it")
      ->check(Number(0, tags::kMaxLeaseMs / 1e3))
      ->type_name("SECONDS");
  write->add_option("--slot", it->note.slot, "Into this slot (default: the tag's drop policy)")
      ->check(WholeNumber(0, tags::kMaxSlots - 1))
      ->type_name("N");
  write->callback([=] {
    it->note.sentence = fmt::to_string(fmt::join(it->words, " "));
    *exit_status =
        it->words.size() == 1
            ? WriteTag(*options, it->note)
            : Fail(kUsage, fmt::format("found a sentence of {} arguments, expected it in "
                                       "quotes, as one: '{}'",
                                       it->words.size(), it->note.sentence));
  });
}

void AddErase(CLI::App* tags, const ServerOptions* options, const std::shared_ptr<TagArguments>& it,
              int* exit_status) {
  CLI::App* erase = tags->add_subcommand("erase", "Erase a slot of a tag, or all of them");
  erase->add_option("NAME", it->note.tag, "Name of the tag")->required();
  auto* slot = erase->add_option("SLOT", it->slot, "Number of the slot")
                   ->check(WholeNumber(0, tags::kMaxSlots - 1));
  erase->add_flag("--all", it->all, "All slots")->excludes(slot);
  erase->callback([=] {
    *exit_status = it->all != it->slot.has_value()
                       ? EraseTag(*options, it->note.tag, it->slot)
                       : Fail(kUsage, "expected the number of a slot, or --all");
  });
}

void AddForget(CLI::App* tags, const ServerOptions* options,
               const std::shared_ptr<TagArguments>& it, int* exit_status) {
  CLI::App* forget = tags->add_subcommand(
      "forget", "Remove what a robot has defined and no tag or other definition uses");
  auto* link = forget->add_option("LINK", it->maker.link, "Name of the robot's link");
  auto* id = forget->add_option("ID", it->id, "Its ID")->check(WholeNumber(1, 254));
  link->needs(id);
  auto* operators =
      forget->add_flag("--operators", it->all, "What operators and nets have defined");
  operators->excludes(link)->excludes(id);
  forget->callback([=] {
    it->maker.id = static_cast<uint8_t>(it->id);
    *exit_status = it->all != it->maker.is_robot()
                       ? ForgetSymbols(*options, it->maker)
                       : Fail(kUsage, "expected the link and the ID of a robot, or --operators");
  });
}

void AddFiles(CLI::App* tags, const ServerOptions* options, const std::shared_ptr<TagArguments>& it,
              int* exit_status) {
  const auto format = [&](CLI::App* command) {
    command
        ->add_option("--format", it->file.format,
                     "ntriples, turtle or rdfxml (default: by the file's ending)")
        ->check(CLI::IsMember({"ntriples", "turtle", "rdfxml"}))
        ->type_name("FORMAT");
  };
  CLI::App* exporting = tags->add_subcommand("export", "Write what is on the tags as RDF");
  exporting->add_option("NAME", it->names, "Only these tags");
  format(exporting);
  exporting->add_option("--output", it->file.path, "Into this file (default: standard output)")
      ->type_name("FILE");
  exporting->callback([=] { *exit_status = ExportTags(*options, it->file, it->names); });

  CLI::App* importing =
      tags->add_subcommand("import", "Write the facts of an RDF file on their tags");
  importing->add_option("FILE", it->file.path, ".nt, .ttl, .rdf or .xml")->required();
  format(importing);
  importing->callback([=] { *exit_status = ImportTags(*options, it->file); });
}

}  // namespace

void AddTagCommands(CLI::App* program, const ServerOptions* options, int* exit_status) {
  const auto it = std::make_shared<TagArguments>();
  CLI::App* tags = program->add_subcommand(
      "tags", "Virtual RFID tags: list, show, write, erase, forget, find, export, import");
  tags->require_subcommand(1);

  CLI::App* list = tags->add_subcommand("list", "Show the tags");
  list->callback([=] { *exit_status = ListTags(*options); });

  CLI::App* show = tags->add_subcommand("show", "Show what is written on a tag");
  show->add_option("NAME", it->note.tag, "Name of the tag")->required();
  show->callback([=] { *exit_status = ShowTag(*options, it->note.tag); });

  AddWrite(tags, options, it, exit_status);
  AddErase(tags, options, it, exit_status);
  AddForget(tags, options, it, exit_status);
  AddFiles(tags, options, it, exit_status);

  CLI::App* find = tags->add_subcommand("find", "Show the sentences that agree with examples");
  find->add_option("EXAMPLE", it->examples,
                   "robot=, subject=, predicate=, object= or tag=, each with a value")
      ->required()
      ->type_name("KEY=VALUE");
  find->callback([=] { *exit_status = FindOnTags(*options, it->examples); });
}

}  // namespace pheromone::ctl
