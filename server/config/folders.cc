#include "server/config/folders.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace pheromone::config {
namespace {

constexpr const char* kLockName = "lock";  // of a journal (server/journal/posix_folder.h)

std::string FirstOf(const char* state_directory) {
  const std::string all = state_directory != nullptr ? state_directory : "";
  return all.substr(0, all.find(':'));
}

// Why files cannot be made in a folder that is there; empty if they can.
std::string WhyNot(const std::string& folder) {
  struct stat status {};
  if (stat(folder.c_str(), &status) == 0 && !S_ISDIR(status.st_mode)) {
    return folder + ": is not a folder";
  }
  return access(folder.c_str(), R_OK | W_OK | X_OK) == 0
             ? ""
             : folder + ": " + std::strerror(errno) + ", expected a folder that can be written to";
}

// One that is not there is made by the server, if that which it belongs into is there.
void Look(const std::string& key, const std::string& what, const std::string& folder,
          FolderReport* report) {
  std::error_code error;
  const bool is_there = std::filesystem::exists(folder, error);
  const std::string above =
      std::filesystem::absolute(folder, error).lexically_normal().parent_path().string();
  const std::string lock = folder + '/' + kLockName;
  std::string why = WhyNot(is_there ? folder : above);
  if (why.empty() && key == "journal.folder" && access(lock.c_str(), F_OK) == 0 &&
      access(lock.c_str(), R_OK | W_OK) != 0) {
    why = lock + ": " + std::strerror(errno) + ", expected a file of the server's user";
  }
  if (!why.empty()) {
    report->warnings.push_back(key + ": " + why);
  }
  report->lines.push_back(what + ": " + folder + (is_there ? "" : ", which is not there yet"));
}

}  // namespace

std::string JournalFolder(const JournalConfig& config, const char* state_directory) {
  if (config.durability == JournalConfig::Durability::kNone) {
    return "";
  }
  const std::string state = FirstOf(state_directory);
  return !config.folder.empty() || state.empty() ? config.folder : state + "/journal";
}

std::string CaptureFolder(const CaptureSettings& config, const char* state_directory) {
  // An absolute path takes the place of what it is appended to.
  return (std::filesystem::path(FirstOf(state_directory)) / config.folder).string();
}

FolderReport LookAtFolders(const Config& config, const char* state_directory) {
  FolderReport report;
  const std::string journal = JournalFolder(config.journal, state_directory);
  if (journal.empty()) {
    report.lines.emplace_back(
        "journal: none, but that of the state directory which systemd gives a service");
    if (config.journal.durability == JournalConfig::Durability::kNone) {
      report.lines.back() = "journal: none";
    }
  } else {
    Look("journal.folder", "journal", journal, &report);
  }
  Look("capture.folder", "recordings", CaptureFolder(config.capture, state_directory), &report);
  return report;
}

}  // namespace pheromone::config
