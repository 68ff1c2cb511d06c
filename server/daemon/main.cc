// pheromoned: the pheromone server.
//
// Exit status: 0 after an orderly stop, 1 if it could not run, 2 for errors that a restart does not
// cure: in the command line or the configuration, or a configuration that does not match the
// folders or the state.
#include <fcntl.h>
#include <malloc.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <utility>

#include <CLI/CLI.hpp>

#include "server/base/command_line.h"
#include "server/base/descriptor.h"
#include "server/base/hex.h"
#include "server/base/program.h"
#include "server/base/random.h"
#include "server/config/config.h"
#include "server/config/describe.h"
#include "server/config/folders.h"
#include "server/daemon/daemon.h"
#include "server/daemon/field_saver.h"
#include "server/daemon/logging.h"
#include "server/formats/maps/field_file.h"

namespace pheromone::daemon {
namespace {

constexpr int kUsage = Daemon::kMisconfigured;

struct Options {
  std::string config_path;  // empty: the default configuration
  std::string log_level;    // empty: as configured
  std::string load_field;   // absolute; empty: only the configured paths and rasters
  std::string save_field;   // absolute; empty: the field is not saved
  std::string web_root;     // empty: the dashboard built in
  std::string node;         // of the cluster; empty: as configured
  bool check = false;
  bool print_default = false;
};

Result<config::Config> Load(const Options& options) {
  std::array<char, 256> host{};
  (void)gethostname(host.data(), host.size() - 1);
  Result<config::Config> config = config::LoadConfigOrDefault(
      options.config_path, std::filesystem::path(), config::Machine{host.data(), options.node});
  if (config.ok() && !config.value().cluster && !options.node.empty()) {
    return Error{"--node is given, expected a configuration with [cluster]"};
  }
  if (config.ok()) {
    config.value().web.root = options.web_root;
  }
  return config;
}

// Adds the field named by --load-field to the initial contents of the configuration.
Status LayLoaded(const std::string& path, config::Config* config,
                 std::optional<maps::SavedField>* loaded) {
  PHEROMONE_TRY(maps::SavedField saved, maps::LoadField(path));
  const Status laid = maps::LayOnto(saved, &config->engine.field);
  if (!laid.ok()) {
    return Error{path + " does not match the configuration: " + laid.error()};
  }
  *loaded = std::move(saved);
  return Ok();
}

// Rereads the configuration. The field loaded at the start remains part of it; otherwise it would
// be erased like a path that is no longer configured.
Result<config::Config> LoadAgain(const Options& options,
                                 const std::optional<maps::SavedField>& loaded) {
  Result<config::Config> config = Load(options);
  if (!config.ok() || !loaded) {
    return config;
  }
  field::FieldConfig& field = config.value().engine.field;
  for (const field::InitialRaster& print : loaded->initial_rasters) {
    const field::PheromoneLaw* law = field.FindLaw(print.type);
    if (law == nullptr || law->is_blend()) {
      return Error{"the field loaded from " + options.load_field + " has pheromone type " +
                   std::to_string(print.type) + ", which is no longer configured"};
    }
    field.initial_rasters.push_back(print);
  }
  return config;
}

// Refuses a journal folder that cannot be used.
Status CheckJournalFolder(const config::Config& config, const char* state_directory) {
  const std::string journal = config::JournalFolder(config.journal, state_directory);
  const std::string why = journal.empty() ? config::WhyNoJournal(config, journal)
                                          : config::WhyUnusable(journal, state_directory);
  return why.empty() ? Ok() : Status(Error{"journal: " + why});
}

void WarnOfWhatIsNotKept(const config::Config& config, const std::string& save_field,
                         const char* state_directory) {
  const char* runtime = std::getenv("RUNTIME_DIRECTORY");
  for (const std::string& path :
       {config::JournalFolder(config.journal, state_directory),
        config::CaptureFolder(config.capture, state_directory), save_field}) {
    const std::string why = config::WhyNotKept(path, runtime);
    if (!why.empty()) {
      spdlog::warn("{}", why);
    }
  }
}

// In the file that the configuration names, if there is none yet. Without one, robots are served
// all the same.
void MakeToken(config::WebSettings* web) {
  if (web->listen.address.empty() || web->token_file.empty() || !web->token.empty()) {
    return;
  }
  std::array<uint8_t, 16> random{};
  FillRandom(random);
  const std::string token = HexText(random);
  const Descriptor file(
      open(web->token_file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR));
  if (!file.valid() || !WriteAll(file.get(), token + '\n')) {
    const Error why = SystemError(web->token_file + ": cannot be created");
    if (file.valid()) {  // not that of somebody else
      unlink(web->token_file.c_str());
    }
    spdlog::warn(
        "{}; until somebody writes a token there, such as by `openssl rand -hex 32`, nothing can "
        "be changed over the network",
        why);
    return;
  }
  web->token = token;
  spdlog::info("web: made a token, {}", config::AbsolutePath(web->token_file));
}

int Serve(const Options& options, const std::optional<maps::SavedField>& field,
          config::Config config) {
  const char* state_directory = std::getenv("STATE_DIRECTORY");
  WarnOfWhatIsNotKept(config, options.save_field, state_directory);
  const Status usable = CheckJournalFolder(config, state_directory);
  if (!usable.ok()) {
    spdlog::critical("{}", usable.error());
    return kUsage;
  }
  MakeToken(&config.web);
  auto journal = JournalOwner::Open(config.journal, config.cluster.has_value());
  if (!journal.ok()) {
    spdlog::critical("{}", journal.error());
    return 1;
  }
  const std::string misfit =
      journal.value()->WhyNotFor(config.cluster ? config.cluster->name : std::string());
  if (!misfit.empty()) {
    spdlog::critical("journal: {}", misfit);
    return kUsage;
  }
  Daemon daemon(
      std::move(config), std::move(journal).value(), [&] { return LoadAgain(options, field); },
      options.save_field);
  return daemon.Run();
}

int Run(const Options& options) {
  const char* state_directory = std::getenv("STATE_DIRECTORY");
  if (options.print_default) {
    std::cout << config::DefaultConfigText();
    return 0;
  }
  Result<config::Config> loaded = Load(options);
  if (!loaded.ok()) {
    std::cerr << loaded.error() << '\n';
    return kUsage;
  }
  config::Config& config = loaded.value();
  std::optional<maps::SavedField> field;
  if (!options.load_field.empty()) {
    const Status laid = LayLoaded(options.load_field, &config, &field);
    if (!laid.ok()) {
      std::cerr << laid.error() << '\n';
      return kUsage;
    }
  }
  if (!options.save_field.empty()) {
    const Status writable = CheckSavePath(options.save_field, state_directory);
    if (!writable.ok()) {
      std::cerr << writable.error() << '\n';
      return kUsage;
    }
  }
  const std::string name =
      options.config_path.empty() ? "default configuration" : options.config_path;
  if (options.check) {
    const config::CheckReport report = config::DescribeCheck(name, config, state_directory);
    std::cerr << report.warnings << report.errors;
    std::cout << report.text;
    return report.errors.empty() ? 0 : kUsage;
  }
  SetUpLogging(options.log_level.empty() ? config.daemon.log_level : options.log_level);
  spdlog::info("pheromoned {}, {}", PHEROMONE_VERSION, name);
  return EndLogging(Serve(options, field, std::move(config)));
}

int Main(int argc, char** argv) {
  Options options;
  CLI::App app("The pheromone server: virtual pheromone trails for robot swarms.", "pheromoned");
  Standardise(&app);
  const auto not_empty = [](const std::string& path) {
    return path.empty() ? std::string("is empty, expected a file name") : std::string();
  };
  app.add_option("--config", options.config_path,
                 "The configuration file (default: the built-in configuration)")
      ->check(not_empty)
      ->type_name("FILE");
  app.add_option("--load-field", options.load_field, "Load a field that an earlier run has saved")
      ->check(not_empty)
      ->type_name("FILE");
  app.add_option("--save-field", options.save_field,
                 "Save the field to this file on an orderly stop and on SIGUSR1")
      ->check(not_empty)
      ->type_name("FILE");
  app.add_option("--web-root", options.web_root,
                 "Serve the dashboard from this folder, while it is edited")
      ->check(CLI::ExistingDirectory)
      ->type_name("DIR");
  app.add_option("--node", options.node,
                 "Which node of its cluster this is (default: as configured, or the host's name)")
      ->check(not_empty)
      ->type_name("NAME");
  app.add_flag("--check", options.check, "Check the configuration, print its meaning, and exit");
  app.add_flag("--default-config", options.print_default,
               "Print the default configuration and exit");
  app.add_option("--log-level", options.log_level, "Override the configured log level")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "critical", "off"}))
      ->type_name("LEVEL");
  app.set_version_flag("--version", "pheromoned " PHEROMONE_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ExtrasError&) {
    std::fprintf(stderr,
                 "pheromoned: found \"%s\", expected an option; a configuration is given with "
                 "--config FILE\n",
                 app.remaining().empty() ? "" : app.remaining().front().c_str());
    return kUsage;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kUsage;
  }
  for (std::string* path : {&options.load_field, &options.save_field}) {
    *path = config::KeptPath(*path, std::getenv("STATE_DIRECTORY"));
  }
  return Run(options);
}

}  // namespace
}  // namespace pheromone::daemon

int main(int argc, char** argv) {
  // Each heap arena retains some MiB after a large map was erased, and by default each thread has
  // its own arena. With a single arena, a thread that draws could hold the lock that a thread
  // answering robots needs.
  mallopt(M_ARENA_MAX, 2);
  return pheromone::RunProgram("pheromoned", [&] { return pheromone::daemon::Main(argc, argv); });
}
