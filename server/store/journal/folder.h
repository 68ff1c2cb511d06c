// The interface of the journal's folder and the file operations in it. Tests implement it with a
// disk that loses unsynced data, is full, or fails (testing/crash_folder.h).
//
//   auto folder = PosixFolder::Open("/var/lib/pheromoned", PosixFolder::Mode::kOwner);
//   auto file = folder.value()->Create("00000001.segment");
//   file.value()->Append(bytes);
//   file.value()->Sync();        // the bytes survive a power failure,
//   folder.value()->Sync();      // and so does the file name
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

/// A new, append-only file. In a power failure, unsynced data may be lost or torn: any part of it
/// may survive.
class AppendFile {
 public:
  enum class Reserved { kYes, kNoSpace, kUnsupported };

  AppendFile() = default;
  AppendFile(const AppendFile&) = delete;
  AppendFile& operator=(const AppendFile&) = delete;
  virtual ~AppendFile() = default;

  /// After an error, any part of the bytes may have been written.
  virtual Status Append(std::string_view bytes) = 0;

  /// Returns when all appended data is durable. After an error it is unknown what is: the kernel
  /// discards pages it could not write, and a second sync would succeed without writing them. Such
  /// a file must not be used any more.
  virtual Status Sync() = 0;

  /// Reserves disk space so that the file can grow to `bytes`. Its length does not change.
  virtual Reserved Reserve(uint64_t bytes) = 0;

  /// Releases the space reserved beyond the end. If that fails, it stays reserved.
  virtual void ReleaseReserve() = 0;
};

/// A small file of fixed length whose parts are written again and again.
class SlotFile {
 public:
  SlotFile() = default;
  SlotFile(const SlotFile&) = delete;
  SlotFile& operator=(const SlotFile&) = delete;
  virtual ~SlotFile() = default;

  /// Returns when the bytes are durable; the file name is durable once the folder was synced. A
  /// power failure meanwhile may leave any mixture of old and new sectors in this range only.
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

  /// The names of all other entries, sorted: folders, links, devices.
  virtual Result<std::vector<std::string>> ListOthers() const = 0;

  /// The size of a file in bytes.
  virtual Result<uint64_t> Size(const std::string& name) const = 0;

  /// Reads at most `most` bytes from `offset`; fewer only at the end of the file.
  virtual Result<std::string> Read(const std::string& name, uint64_t offset, size_t most) const = 0;

  /// Creates a file; fails if it exists.
  virtual Result<std::unique_ptr<AppendFile>> Create(const std::string& name) = 0;

  /// Opens a file of `bytes` length; creates it, filled with zeros, if it does not exist.
  virtual Result<std::unique_ptr<SlotFile>> OpenSlots(const std::string& name, uint64_t bytes) = 0;

  /// Renames a file, replacing an existing one.
  virtual Status Rename(const std::string& from, const std::string& to) = 0;
  virtual Status Remove(const std::string& name) = 0;

  /// Returns when all created, renamed and removed names are durable.
  virtual Status Sync() = 0;
};

}  // namespace pheromone::journal
