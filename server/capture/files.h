// The files of a recording: their names, their size, how many are kept.
//
//   Files files(folder, most_files);
//   Status status = files.Begin(start);          // closes the one before
//   status = files.Write(records);               // encoded with the numbers from Number()
//   files.Close();
//
// A file is called pheromone-YYYYMMDDTHHMMSSZ-PART.pcapng after the time at which its recording
// began (UTC) and its place in it; if there is one of that name, -1 and so on is added to the time.
// When there are more than `most_files` in the folder whose names look like that, the ones that
// come first in the alphabet are removed: those of earlier recordings too. A file that is being
// written is never removed. Not thread-safe.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "server/base/result.h"
#include "server/capture/record.h"

namespace pheromone::capture {

class Files {
 public:
  /// `most_files` 0: no limit.
  Files(std::string folder, uint32_t most_files)
      : folder_(std::move(folder)), most_files_(most_files) {}
  Files(const Files&) = delete;
  Files& operator=(const Files&) = delete;
  ~Files() { Close(); }

  /// Creates the next file, with its header.
  Status Begin(const Start& start);
  Status Write(std::string_view bytes);
  void Close();
  /// Removes the present file.
  void Discard();

  bool open() const { return descriptor_ >= 0; }
  const std::string& path() const { return path_; }
  uint64_t bytes() const { return bytes_; }
  /// Of the next record in this file.
  uint64_t TakeNumber() { return ++number_; }

 private:
  void RemoveOldest() const;

  const std::string folder_;
  const uint32_t most_files_;
  std::string stem_;
  uint64_t recording_ = 0;
  std::string path_;
  int descriptor_ = -1;
  uint64_t bytes_ = 0;
  uint64_t number_ = 0;
};

}  // namespace pheromone::capture
