// Reading and writing of whole files.
//
//   Result<std::string> bytes = ReadFile("lab.pgm", kMaxFileBytes);
//   Status written = WriteFile("lab.pgm", bytes.value());
//
// And writing in parts:
//
//   FileWriter file("lab.mcap");
//   file.Write(part);
//   Status written = file.Commit();
//
// Any thread; a writer is for one at a time. Errors name the file and the system's reason.
#pragma once

#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"

namespace pheromone {

constexpr size_t kMaxFileBytes = size_t{1} << 30;

/// All bytes of a regular file; pipes and devices, which may never end, are refused unread. More
/// than `max_bytes` is an error, detected before they are read.
Result<std::string> ReadFile(const std::string& path, size_t max_bytes = kMaxFileBytes);

/// Replaces a file atomically: the bytes are written to a new file beside it and synced, and the
/// new file is then renamed. A concurrent reader, or one after a power failure, finds either the
/// old or the new content. On an error the old file is untouched. It is an error if something that
/// is not a regular file, such as a device, has that name.
Status WriteFile(const std::string& path, std::string_view bytes);

/// The same for what only the owner may read: mode 0600 from the beginning, under any umask. A file
/// that is replaced keeps its owner: root may change what belongs to a service's user.
Status WriteSecretFile(const std::string& path, std::string_view bytes);

/// Replaces a file by what is written in parts, as WriteFile does; without a Commit, the old file
/// is untouched. A link stays, and the file it leads to is replaced. What is not a regular file,
/// such as a device or a pipe, is written to at once, and never removed.
class FileWriter {
 public:
  explicit FileWriter(std::string path);
  FileWriter(const FileWriter&) = delete;
  FileWriter& operator=(const FileWriter&) = delete;
  ~FileWriter();

  /// Nothing more is written after an error.
  void Write(std::string_view part);
  /// The bytes are durable, but the old file is still there. Nothing may be written any more.
  Status Close();
  /// Closes it, if that was not done, and replaces the old file.
  Status Commit();

  const std::string& path() const { return path_; }
  /// The first error.
  const Status& status() const { return status_; }

 private:
  void Fail();

  const std::string path_;
  std::string target_;  // where the path leads
  std::string fresh_;   // the new file beside it; empty: there is none
  std::FILE* file_ = nullptr;
  Status status_ = Ok();
};

/// That writing `output` replaces none of the `inputs`, under whatever names. Inputs that do not
/// exist are none.
Status CheckOutput(const std::string& output, const std::vector<std::string>& inputs);

}  // namespace pheromone
