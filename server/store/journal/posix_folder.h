// A folder on this machine.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/base/descriptor.h"
#include "server/store/journal/folder.h"

namespace pheromone::journal {

class PosixFolder final : public Folder {
 public:
  enum class Mode {
    kOwner,   ///< for writing; created if missing; locked against other owners
    kReader,  ///< for reading, even while it has an owner
  };

  /// Errors: it is not a folder, it cannot be created or opened, or, for kOwner, another process
  /// owns it: the lock is on the file `lock`, and ends with the process.
  static Result<std::unique_ptr<PosixFolder>> Open(const std::string& path, Mode mode);

  const std::string& path() const override { return path_; }
  Result<std::vector<std::string>> List() const override;
  Result<std::vector<std::string>> ListOthers() const override;
  Result<uint64_t> Size(const std::string& name) const override;
  Result<std::string> Read(const std::string& name, uint64_t offset, size_t most) const override;
  Result<std::unique_ptr<AppendFile>> Create(const std::string& name) override;
  Result<std::unique_ptr<SlotFile>> OpenSlots(const std::string& name, uint64_t bytes) override;
  Status Rename(const std::string& from, const std::string& to) override;
  Status Remove(const std::string& name) override;
  Status Sync() override;

 private:
  Result<std::vector<std::string>> ListIf(bool are_regular) const;

  PosixFolder(std::string path, Descriptor fd) : path_(std::move(path)), fd_(std::move(fd)) {}

  std::string path_;
  Descriptor fd_;
  Descriptor lock_fd_;  // not a reader's
};

}  // namespace pheromone::journal
