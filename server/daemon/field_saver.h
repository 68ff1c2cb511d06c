// Writes the whole field to a file (maps/field_file.h): while robots are served, beside them in a
// thread of its own, and at the end.
//
//   FieldSaver saver(&service, now_ms, "lab.field");
//   saver.SaveBeside();               // SIGUSR1
//   bool written = saver.SaveAtEnd(); // when nobody changes the field any more
//
// Beside the robots it looks through a FieldReader: nobody waits for it, and what it sees of
// neighbouring nodes may be some milliseconds apart. At the end it is exact. Either way the file is
// replaced as a whole. What happens is told in the log.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>

#include "server/base/result.h"
#include "server/engine/service.h"
#include "server/maps/field_file.h"

namespace pheromone::daemon {

/// Whether a file could be made there, or replaced: told at the start rather than at the end.
/// `path` is absolute, `state_directory` $STATE_DIRECTORY (server/config/folders.h).
Status CheckFolderOf(const std::string& path, const char* state_directory);

class FieldSaver {
 public:
  /// `now_ms` gives the present field time; it is called under the service's lock. An empty `path`:
  /// there is nothing to save to.
  FieldSaver(const engine::Service* service, std::function<uint64_t()> now_ms, std::string path);
  FieldSaver(const FieldSaver&) = delete;
  FieldSaver& operator=(const FieldSaver&) = delete;
  ~FieldSaver();

  /// Returns at once; one thread at a time. Whoever asks while it is still at it is served right
  /// afterwards.
  void SaveBeside();

  /// False if there is a file to write and that failed.
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
