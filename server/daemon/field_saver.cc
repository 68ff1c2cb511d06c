#include "server/daemon/field_saver.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <tuple>
#include <utility>
#include <vector>

#include "server/config/folders.h"

namespace pheromone::daemon {

Status CheckSavePath(const std::string& path, const char* state_directory) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  if (access(folder.c_str(), F_OK) != 0) {
    return Error{path + ": cannot create files in its folder: " + std::strerror(errno)};
  }
  const std::string why = config::WhyUnusable(folder, state_directory);
  if (!why.empty()) {
    return Error{path + ": cannot be written: " + why};
  }
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    return Error{path + ": is a folder"};
  }
  if (!std::filesystem::exists(path, ignored)) {
    return Ok();
  }
  if (!std::filesystem::is_regular_file(path, ignored)) {
    return Error{path + ": is not a regular file"};
  }
  std::string head(maps::kFieldMagic.size(), '\0');
  std::ifstream file(path, std::ios::binary);
  if (!file.is_open()) {
    return Error{path + ": cannot be opened: " + std::strerror(errno)};
  }
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  return file.gcount() == 0 || head == maps::kFieldMagic
             ? Ok()
             : Error{path +
                     ": is not a saved field, expected the name of one, or of no file, to "
                     "save the field to"};
}

FieldSaver::FieldSaver(const engine::Service* service, std::function<uint64_t()> now_ms,
                       std::string path)
    : service_(*service), now_ms_(std::move(now_ms)), path_(std::move(path)) {}

FieldSaver::~FieldSaver() {
  if (thread_.joinable()) {
    thread_.join();
  }
}

void FieldSaver::SaveBeside() {
  if (path_.empty()) {
    spdlog::warn("SIGUSR1 ignored: the server was started without --save-field");
    return;
  }
  if (asked_.fetch_add(1) != 0) {
    return;
  }
  if (thread_.joinable()) {
    thread_.join();
  }
  thread_ = std::thread([this] {
    uint64_t served = 0;
    do {
      served = asked_;
      Write(CaptureBeside());
    } while (asked_.fetch_sub(served) != served);
  });
}

bool FieldSaver::SaveAtEnd() {
  if (thread_.joinable()) {
    thread_.join();
  }
  return path_.empty() || Write(service_.Inspect([this](const engine::Engine& engine) {
           return Result<maps::SavedField>(maps::TakeFieldSnapshot(engine.field(), now_ms_()));
         }));
}

Result<maps::SavedField> FieldSaver::CaptureBeside() const {
  const auto laws_of = [](const engine::Engine& engine) {
    return engine.config().field.pheromones;
  };
  for (;;) {
    const std::vector<field::PheromoneLaw> laws = service_.Inspect(laws_of);
    const auto [field, map, now_ms] = service_.Inspect([this](const engine::Engine& engine) {
      return std::tuple(&engine.field(), engine.config().field.map, now_ms_());
    });
    const field::FieldReader reader(*field);  // the engine keeps its field, once it has one
    if (!reader.ok()) {
      return Error{"too many readers of the field"};
    }
    maps::SavedField saved = maps::TakeFieldSnapshot(reader, map, laws, now_ms);
    // A level read under one law must not be written under another.
    if (service_.Inspect(laws_of) == laws) {
      return saved;
    }
  }
}

bool FieldSaver::Write(const Result<maps::SavedField>& saved) const {
  const Status written = saved.ok() ? maps::SaveField(path_, saved.value()) : saved.error();
  if (!written.ok()) {
    spdlog::error("the field was not saved: {}", written.error());
    return false;
  }
  spdlog::info("field saved to {}: {} nodes", path_, maps::CountNodes(saved.value()));
  return true;
}

}  // namespace pheromone::daemon
