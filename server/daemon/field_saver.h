// Writes the field to a file (maps/field_file.h): on a thread of its own while robots are served,
// and at the end.
//
//   FieldSaver saver(&service, now_ms, "lab.field");
//   saver.SaveBeside();               // SIGUSR1
//   bool written = saver.SaveAtEnd(); // when the field no longer changes
//
// While robots are served it uses a FieldReader: no thread waits for it, and neighbouring nodes may
// differ in time by a few milliseconds. At the end it is exact. In both cases the file is replaced
// atomically, and the outcome is logged.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>

#include "server/base/result.h"
#include "server/core/engine/service/service.h"
#include "server/formats/maps/field_file.h"

namespace pheromone::daemon {

/// Whether a file can be created or replaced there, checked at the start rather than at the end.
/// `path` is absolute, `state_directory` $STATE_DIRECTORY (server/config/folders.h).
/// An existing file is a saved field, or empty: no configuration is replaced by mistake.
Status CheckSavePath(const std::string& path, const char* state_directory);

class FieldSaver {
 public:
  /// `now_ms` gives the present field time; it is called under the service's lock. An empty `path`:
  /// there is nothing to save to.
  FieldSaver(const engine::Service* service, std::function<uint64_t()> now_ms, std::string path);
  FieldSaver(const FieldSaver&) = delete;
  FieldSaver& operator=(const FieldSaver&) = delete;
  ~FieldSaver();

  /// Returns at once; one thread at a time. A request during a save is served right after it.
  void SaveBeside();

  /// False if there was a file to write and that failed.
  bool SaveAtEnd();

 private:
  Result<maps::SavedField> CaptureBeside() const;
  bool Write(const Result<maps::SavedField>& saved) const;

  const engine::Service& service_;
  const std::function<uint64_t()> now_ms_;
  const std::string path_;
  std::thread thread_;
  std::atomic<uint64_t> asked_{0};  // and not yet served; as long as it is not 0, thread_ runs
};

}  // namespace pheromone::daemon
