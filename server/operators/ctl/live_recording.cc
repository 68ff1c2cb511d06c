#include "server/operators/ctl/live_recording.h"

#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <iostream>

#include "server/operators/ctl/json_read.h"

namespace pheromone::ctl {
namespace {

using Clock = std::chrono::steady_clock;

// More often than files are full.
constexpr useconds_t kLookEveryUs = 100'000;
constexpr const char* kCapture = "/api/v1/capture";

volatile std::sig_atomic_t g_stop = 0;

void AddFile(const boost::json::value& view, std::vector<std::string>* files) {
  const std::filesystem::path name = TextAt(view, "file");
  const std::string path = (std::filesystem::path(TextAt(view, "folder")) / name).string();
  if (!name.empty() && (files->empty() || files->back() != path)) {
    files->push_back(path);
  }
}

}  // namespace

Result<std::vector<std::string>> RecordLive(const ServerOptions& options, double seconds) {
  std::vector<std::string> files;
  for (const int signal : {SIGINT, SIGTERM}) {
    std::signal(signal, [](int) { g_stop = 1; });
  }
  PHEROMONE_TRY(boost::json::value view,
                AskJson(options, "POST", kCapture, R"({"action":"start"})"));
  AddFile(view, &files);
  if (files.empty()) {
    return Error{"the server has started a recording, but does not name its file"};
  }
  std::cerr << "recording into " << files.back() << (seconds == 0 ? "; Ctrl-C ends it\n" : "\n");
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  while (g_stop == 0 && (seconds == 0 || Clock::now() < end) && FlagAt(view, "recording")) {
    usleep(kLookEveryUs);
    PHEROMONE_TRY(view, AskJson(options, "GET", kCapture));
    AddFile(view, &files);
  }
  PHEROMONE_TRY(view, AskJson(options, "POST", kCapture, R"({"action":"stop"})"));
  AddFile(view, &files);
  for (const std::string& file : files) {
    if (access(file.c_str(), R_OK) != 0) {
      return Error{file + (errno == ENOENT
                               ? ": recorded, but no longer there: the server keeps max_files of "
                                 "[capture]; export the files that are left by their names"
                               : ": recorded, but not readable for you: it is of the user that "
                                 "the server runs as; export it as that user, or with sudo")};
    }
  }
  return files;
}

}  // namespace pheromone::ctl
