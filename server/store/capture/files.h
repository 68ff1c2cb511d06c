// The files of a recording: their names, sizes and retention.
//
//   Files files(folder, most_files);
//   Status status = files.Begin(start);          // closes the one before
//   status = files.Write(records);               // encoded with the numbers from Number()
//   files.Close();
//
// A file is named pheromone-YYYYMMDDTHHMMSSZ-PART.pcapng after the UTC time at which its recording
// began and its number in the recording; if that name exists, -1 and so on is appended to the time.
// When the folder has more than `most_files` files of this form, the alphabetically first are
// removed, including those of earlier recordings. A file being written is never removed. Not
// thread-safe.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "server/base/descriptor.h"
#include "server/base/result.h"
#include "server/store/capture/record.h"

namespace pheromone::capture {

class Files {
 public:
  /// `most_files` 0: no limit.
  Files(std::string folder, uint32_t most_files)
      : folder_(std::move(folder)), most_files_(most_files) {}

  /// Creates the next file, with its header.
  Status Begin(const Start& start);
  Status Write(std::string_view bytes);
  void Close() { descriptor_.Close(); }
  /// Removes the present file.
  void Discard();

  bool open() const { return descriptor_.valid(); }
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
  Descriptor descriptor_;
  uint64_t bytes_ = 0;
  uint64_t number_ = 0;
};

}  // namespace pheromone::capture
