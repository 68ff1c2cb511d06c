// pheromonectl export, as it is declared to CLI11.
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "server/base/number_check.h"
#include "server/operators/ctl/command_line.h"
#include "server/operators/ctl/csv_export.h"
#include "server/operators/ctl/export_recording.h"
#include "server/operators/ctl/live_recording.h"
#include "server/operators/ctl/mcap_export.h"

namespace pheromone::ctl {
namespace {

struct ExportArguments {
  std::vector<std::string> files;
  McapOptions mcap;
  CsvOptions csv;
  bool live = false;
  double seconds = 0;
};

std::vector<std::string> OutputsOf(const ExportArguments& arguments) {
  if (arguments.csv.folder.empty()) {
    return {arguments.mcap.out};
  }
  std::vector<std::string> tables;
  for (const char* name : kCsvTables) {
    tables.push_back(std::filesystem::path(arguments.csv.folder) / name);
  }
  return tables;
}

int Export(const ServerOptions& options, const ExportArguments& arguments) {
  std::vector<std::string> files = arguments.files;
  if (files.empty() != arguments.live) {
    return Fail(kUsage, arguments.live ? "--live: found recordings as well, expected one of both"
                                       : "found nothing to export, expected recordings or --live");
  }
  if (arguments.csv.folder.empty() == arguments.mcap.out.empty()) {
    return Fail(kUsage, "expected either --csv FOLDER or --mcap FILE");
  }
  for (const std::string& out : OutputsOf(arguments)) {
    if (const Status free = CheckExportOutput(out, files); !free.ok()) {
      return Fail(kUsage, free.error());
    }
  }
  if (arguments.live) {
    const Result<std::vector<std::string>> recorded = RecordLive(options, arguments.seconds);
    if (!recorded.ok()) {
      return Fail(kFailed, recorded.error());
    }
    files = recorded.value();
  }
  return arguments.csv.folder.empty() ? ExportMcap(files, arguments.mcap)
                                      : ExportCsv(files, arguments.csv);
}

}  // namespace

void AddExportCommands(CLI::App* program, const ServerOptions* options, int* exit_status) {
  const auto it = std::make_shared<ExportArguments>();
  CLI::App* command = program->add_subcommand(
      "export",
      "Convert a recording of a server into tables, or for Foxglove, Lichtblick and ROS 2");
  command->add_option("FILE", it->files, "Recordings, in order")->expected(0, -1);
  CLI::Option* csv = command->add_option("--csv", it->csv.folder,
                                         "The folder for robots.csv, deposits.csv and events.csv");
  csv->type_name("FOLDER");
  CLI::Option* mcap =
      command->add_option("--mcap", it->mcap.out, "The MCAP file to write")->type_name("FILE");
  command
      ->add_option("--rate", it->csv.rate_hz,
                   "Rows of each robot in robots.csv in a second (default: 10)")
      ->needs(csv)
      ->check(Number(0.001, 1000))
      ->type_name("HZ");
  command
      ->add_option("--grid-rate", it->mcap.grid_hz,
                   "Pictures of each pheromone in a second, of those that changed (default: 2)")
      ->needs(mcap)
      ->check(Number(0.001, 10))
      ->type_name("HZ");
  command
      ->add_flag("--ros2", it->mcap.ros2,
                 "Messages of ROS 2 instead of Foxglove's, for ros2 bag play")
      ->needs(mcap);
  CLI::Option* live =
      command->add_flag("--live", it->live, "Record the running server first, instead of FILE");
  command
      ->add_option("--seconds", it->seconds, "For how long it is recorded (default: until Ctrl-C)")
      ->needs(live)
      ->check(Number(0.1, 1e7))
      ->type_name("S");
  command->callback([=] { *exit_status = Export(*options, *it); });
}

}  // namespace pheromone::ctl
