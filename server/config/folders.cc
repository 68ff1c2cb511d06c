#include "server/config/folders.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

namespace pheromone::config {
namespace {

constexpr const char* kLockName = "lock";  // of a journal (server/store/journal/posix_folder.h)

std::string FirstOf(const char* directories) {
  const std::string all = directories != nullptr ? directories : "";
  return all.substr(0, all.find(':'));
}

bool IsWithin(const std::string& path, const std::string& folder) {
  const std::filesystem::path outer = AbsolutePath(folder);
  const std::filesystem::path inner = AbsolutePath(path);
  return std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end()).first == outer.end();
}

bool IsThere(const std::string& path) {
  std::error_code error;
  return std::filesystem::exists(path, error);
}

bool IsFolder(const std::string& path) {
  std::error_code error;
  return std::filesystem::is_directory(path, error);
}

// Itself, or its parent: the server creates a missing folder if its parent exists.
std::string SelfOrParent(const std::string& folder) {
  return IsThere(folder) ? folder
                         : std::filesystem::path(AbsolutePath(folder)).parent_path().string();
}

// Restrictions of systemd, which apply whatever the ownership of files, look like a fault of the
// disk.
std::string SandboxHint(const std::string& folder, const char* state_directory, int error) {
  const std::string state = FirstOf(state_directory);
  if (state.empty() || IsWithin(folder, state) || (error != EROFS && error != EACCES)) {
    return "";
  }
  return "; as a service, the server may only write to " + state +
         "; to permit more, add ReadWritePaths=" + folder + " in a drop-in (systemctl edit)";
}

std::string LineOf(const std::string& what, const std::string& folder) {
  return what + ": " + folder + (IsThere(folder) ? "" : ", to be created");
}

}  // namespace

std::string AbsolutePath(const std::string& path) {
  std::error_code error;
  const std::filesystem::path whole = std::filesystem::absolute(path, error);
  // "state/" is the folder "state", not something without a name inside of it.
  const std::filesystem::path normal =
      (error ? std::filesystem::path(path) : whole).lexically_normal();
  return (normal.has_filename() || !normal.has_relative_path() ? normal : normal.parent_path())
      .string();
}

std::string KeptPath(const std::string& path, const char* state_directory) {
  // An absolute path replaces the path to which it is appended.
  return path.empty() ? "" : AbsolutePath(std::filesystem::path(FirstOf(state_directory)) / path);
}

std::string JournalFolder(const JournalConfig& config, const char* state_directory) {
  if (config.durability == JournalConfig::Durability::kNone) {
    return "";
  }
  const bool by_itself = config.folder.empty() && !FirstOf(state_directory).empty();
  return KeptPath(by_itself ? "journal" : config.folder, state_directory);
}

std::string CaptureFolder(const CaptureSettings& config, const char* state_directory) {
  return KeptPath(config.folder, state_directory);
}

std::string ControlSocket(const ControlSettings& config, const char* runtime_directory) {
  return config.socket.empty()
             ? ""
             : (std::filesystem::path(FirstOf(runtime_directory)) / config.socket).string();
}

std::string WhyUnusable(const std::string& folder, const char* state_directory) {
  const std::string place = SelfOrParent(folder);
  if (IsThere(place) && !IsFolder(place)) {
    return place + ": is not a folder";
  }
  if (access(place.c_str(), R_OK | W_OK | X_OK) == 0) {
    return "";
  }
  const int error = errno;
  return place + ": " + std::strerror(error) + ", expected a writable folder" +
         SandboxHint(folder, state_directory, error);
}

std::string WhyNotKept(const std::string& path, const char* runtime_directory) {
  const std::string runtime = FirstOf(runtime_directory);
  return path.empty() || runtime.empty() || !IsWithin(path, runtime)
             ? ""
             : path + ": is in " + runtime +
                   ", which systemd removes when the service stops; use a relative path to keep it "
                   "in the service's state directory";
}

std::string WhyNoJournal(const Config& config, const std::string& folder) {
  return config.cluster && folder.empty()
             ? "a cluster needs a journal, expected [journal] with a folder"
             : "";
}

FolderReport LookAtFolders(const Config& config, const char* state_directory) {
  FolderReport report;
  const std::string journal = JournalFolder(config.journal, state_directory);
  if (const std::string why = WhyNoJournal(config, journal); !why.empty()) {
    report.warnings.push_back("journal.folder: " + why + ", or systemd's state directory");
  }
  if (journal.empty()) {
    report.lines.emplace_back(config.journal.durability == JournalConfig::Durability::kNone
                                  ? "journal: none"
                                  : "journal: none; as a systemd service, in its state directory");
  } else {
    std::string why = WhyUnusable(journal, state_directory);
    const std::string lock = journal + '/' + kLockName;
    if (why.empty() && access(lock.c_str(), F_OK) == 0 && access(lock.c_str(), R_OK | W_OK) != 0) {
      why = lock + ": " + std::strerror(errno) + ", expected a file owned by the server's user";
    }
    if (!why.empty()) {
      (IsFolder(SelfOrParent(journal)) ? report.warnings : report.errors)
          .push_back("journal.folder: " + why);
    }
    report.lines.push_back(LineOf("journal", journal));
  }
  const std::string captures = CaptureFolder(config.capture, state_directory);
  if (const std::string why = WhyUnusable(captures, state_directory); !why.empty()) {
    report.warnings.push_back("capture.folder: " + why);
  }
  report.lines.push_back(LineOf("recordings", captures));
  return report;
}

}  // namespace pheromone::config
