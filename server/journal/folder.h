// The journal's folder and the few things that are done to files in it: the seam where tests put a
// disk that loses what was not synced, is full, or fails (testing/crash_folder.h).
//
//   auto folder = PosixFolder::Open("/var/lib/pheromoned", PosixFolder::Mode::kOwner);
//   auto file = folder.value()->Create("00000001.segment");
//   file.value()->Append(bytes);
//   file.value()->Sync();        // the bytes survive a power cut,
//   folder.value()->Sync();      // and so does the file's name
//
// Names are of files in this folder. Errors name the file and the system's reason.
//
// Threads: a folder may be used by several at once, a file by one at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"

namespace pheromone::journal {

/// A new file, written from its beginning on. What was not synced may be lost with the power, or
/// torn: some of it there, some of it not, in any order.
class AppendFile {
 public:
  enum class Reserved { kYes, kNoSpace, kUnsupported };

  AppendFile() = default;
  AppendFile(const AppendFile&) = delete;
  AppendFile& operator=(const AppendFile&) = delete;
  virtual ~AppendFile() = default;

  /// After an error, any part of the bytes may have been written.
  virtual Status Append(std::string_view bytes) = 0;

  /// Returns when all that was appended is on the disk. After an error nobody knows what is: the
  /// system forgets what it could not write, and a second sync would succeed without having done
  /// anything. Such a file is not used any more.
  virtual Status Sync() = 0;

  /// Space on the disk, so that the file can grow to `bytes` without failing for want of it. Its
  /// length stays.
  virtual Reserved Reserve(uint64_t bytes) = 0;

  /// Gives back what was reserved beyond the end. If that fails, it stays reserved.
  virtual void ReleaseReserve() = 0;
};

/// A small file of fixed length whose parts are written again and again.
class SlotFile {
 public:
  SlotFile() = default;
  SlotFile(const SlotFile&) = delete;
  SlotFile& operator=(const SlotFile&) = delete;
  virtual ~SlotFile() = default;

  /// Returns when the bytes are on the disk; the file's name is when the folder was synced. A power
  /// cut meanwhile may leave any mixture of old and new sectors there, and nowhere else.
  virtual Status Write(uint64_t at, std::string_view bytes) = 0;
};

class Folder {
 public:
  Folder() = default;
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  virtual ~Folder() = default;

  /// For messages.
  virtual const std::string& path() const = 0;

  /// The names of the regular files, sorted.
  virtual Result<std::vector<std::string>> List() const = 0;

  /// The names of all else that is in it, sorted: folders, links, devices.
  virtual Result<std::vector<std::string>> ListOthers() const = 0;

  /// Of a file, in bytes.
  virtual Result<uint64_t> Size(const std::string& name) const = 0;

  /// At most `most` bytes from `offset` on; fewer only at the end of the file.
  virtual Result<std::string> Read(const std::string& name, uint64_t offset, size_t most) const = 0;

  /// Fails if there is a file of that name.
  virtual Result<std::unique_ptr<AppendFile>> Create(const std::string& name) = 0;

  /// Of `bytes` length; made, of zeros, if it is not there.
  virtual Result<std::unique_ptr<SlotFile>> OpenSlots(const std::string& name, uint64_t bytes) = 0;

  /// Replaces a file that has the new name.
  virtual Status Rename(const std::string& from, const std::string& to) = 0;
  virtual Status Remove(const std::string& name) = 0;

  /// Returns when all names that were made, changed and removed are so on the disk.
  virtual Status Sync() = 0;
};

}  // namespace pheromone::journal
