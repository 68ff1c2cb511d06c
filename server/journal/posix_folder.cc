#include "server/journal/posix_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

namespace pheromone::journal {
namespace {

constexpr const char* kLockName = "lock";

Error SystemError(const std::string& name, const char* what, int number) {
  return Error{name + ": " + what + ": " + std::strerror(number)};
}

// Retries calls interrupted by a signal.
template <typename Call>
auto Again(Call&& call) {
  decltype(call()) result = call();
  while (result < 0 && errno == EINTR) {
    result = call();
  }
  return result;
}

class PosixFile final : public AppendFile {
 public:
  PosixFile(std::string name, int fd) : name_(std::move(name)), fd_(fd) {}
  ~PosixFile() override { close(fd_); }

  Status Append(std::string_view bytes) override {
    while (!bytes.empty()) {
      const ssize_t count = Again([&] { return write(fd_, bytes.data(), bytes.size()); });
      if (count < 0) {
        return SystemError(name_, "cannot be written", errno);
      }
      bytes.remove_prefix(static_cast<size_t>(count));
    }
    return Ok();
  }

  Status Sync() override {
    return Again([this] { return fdatasync(fd_); }) == 0
               ? Ok()
               : Status(SystemError(name_, "cannot be synced", errno));
  }

  Reserved Reserve(uint64_t bytes) override {
    if (Again([&] { return fallocate(fd_, FALLOC_FL_KEEP_SIZE, 0, static_cast<off_t>(bytes)); }) ==
        0) {
      return Reserved::kYes;
    }
    return errno == EOPNOTSUPP || errno == ENOSYS ? Reserved::kUnsupported : Reserved::kNoSpace;
  }

  void ReleaseReserve() override {
    struct stat status {};
    if (fstat(fd_, &status) == 0) {
      (void)!ftruncate(fd_, status.st_size);
    }
  }

 private:
  std::string name_;
  int fd_;
};

class PosixSlots final : public SlotFile {
 public:
  PosixSlots(std::string name, int fd) : name_(std::move(name)), fd_(fd) {}
  ~PosixSlots() override { close(fd_); }

  Status Write(uint64_t at, std::string_view bytes) override {
    while (!bytes.empty()) {
      const ssize_t count =
          Again([&] { return pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(at)); });
      if (count < 0) {
        return SystemError(name_, "cannot be written", errno);
      }
      at += static_cast<uint64_t>(count);
      bytes.remove_prefix(static_cast<size_t>(count));
    }
    return Again([this] { return fdatasync(fd_); }) == 0
               ? Ok()
               : Status(SystemError(name_, "cannot be synced", errno));
  }

 private:
  std::string name_;
  int fd_;
};

// Creates a folder whose parent exists, and makes its name durable.
Status MakeFolder(const std::string& path) {
  if (mkdir(path.c_str(), 0777) != 0) {
    return errno == EEXIST ? Ok() : Status(SystemError(path, "cannot be created", errno));
  }
  std::string parent = path.substr(0, path.find_last_not_of('/') + 1);
  const size_t slash = parent.rfind('/');
  parent = slash == std::string::npos ? "." : parent.substr(0, slash + 1);
  const int fd = open(parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool synced = fd >= 0 && Again([fd] { return fsync(fd); }) == 0;
  const int number = errno;
  if (fd >= 0) {
    close(fd);
  }
  return synced ? Ok() : Status(SystemError(parent, "cannot be synced", number));
}

}  // namespace

Result<std::unique_ptr<PosixFolder>> PosixFolder::Open(const std::string& path, Mode mode) {
  if (mode == Mode::kOwner) {
    const Status made = MakeFolder(path);
    if (!made.ok()) {
      return Error{made.error()};
    }
  }
  const int fd = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) {
    return SystemError(path, "cannot be opened", errno);
  }
  std::unique_ptr<PosixFolder> folder(new PosixFolder(path, fd, -1));
  if (mode == Mode::kOwner) {
    folder->lock_fd_ = openat(fd, kLockName, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (folder->lock_fd_ < 0) {
      return SystemError(path + "/" + kLockName, "cannot be opened", errno);
    }
    if (Again([&] { return flock(folder->lock_fd_, LOCK_EX | LOCK_NB); }) != 0) {
      return errno == EWOULDBLOCK
                 ? Error{path + ": in use by another server; each server needs a folder of its own"}
                 : SystemError(path + "/" + kLockName, "cannot be locked", errno);
    }
  }
  return folder;
}

PosixFolder::~PosixFolder() {
  if (lock_fd_ >= 0) {
    close(lock_fd_);
  }
  close(fd_);
}

Result<std::vector<std::string>> PosixFolder::List() const {
  return ListIf(true);
}

Result<std::vector<std::string>> PosixFolder::ListOthers() const {
  return ListIf(false);
}

Result<uint64_t> PosixFolder::Size(const std::string& name) const {
  struct stat status {};
  if (fstatat(fd_, name.c_str(), &status, AT_SYMLINK_NOFOLLOW) != 0) {
    return SystemError(path_ + "/" + name, "cannot be examined", errno);
  }
  return static_cast<uint64_t>(status.st_size);
}

Result<std::vector<std::string>> PosixFolder::ListIf(bool are_regular) const {
  std::vector<std::string> names;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(path_, error), end; !error && entry != end;
       entry.increment(error)) {
    struct stat status {};
    const std::string name = entry->path().filename().string();
    if (name != kLockName && fstatat(fd_, name.c_str(), &status, AT_SYMLINK_NOFOLLOW) == 0 &&
        S_ISREG(status.st_mode) == are_regular) {
      names.push_back(name);
    }
  }
  if (error) {
    return Error{path_ + ": cannot be listed: " + error.message()};
  }
  std::sort(names.begin(), names.end());
  return names;
}

Result<std::string> PosixFolder::Read(const std::string& name, uint64_t offset, size_t most) const {
  const int fd = openat(fd_, name.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
  struct stat status {};
  if (fd < 0 || fstat(fd, &status) != 0) {
    const Error error = SystemError(path_ + "/" + name, "cannot be opened", errno);
    if (fd >= 0) {
      close(fd);
    }
    return error;
  }
  const auto size = static_cast<uint64_t>(status.st_size);
  std::string bytes(std::min<uint64_t>(size > offset ? size - offset : 0, most), '\0');
  size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = Again([&] {
      return pread(fd, bytes.data() + done, bytes.size() - done, static_cast<off_t>(offset + done));
    });
    if (count < 0) {
      const Error error = SystemError(path_ + "/" + name, "cannot be read", errno);
      close(fd);
      return error;
    }
    if (count == 0) {
      break;
    }
    done += static_cast<size_t>(count);
  }
  close(fd);
  bytes.resize(done);
  return bytes;
}

Result<std::unique_ptr<AppendFile>> PosixFolder::Create(const std::string& name) {
  const int fd =
      openat(fd_, name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0666);
  if (fd < 0) {
    return SystemError(path_ + "/" + name, "cannot be created", errno);
  }
  return std::unique_ptr<AppendFile>(std::make_unique<PosixFile>(path_ + "/" + name, fd));
}

Result<std::unique_ptr<SlotFile>> PosixFolder::OpenSlots(const std::string& name, uint64_t bytes) {
  const int fd = openat(fd_, name.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (fd < 0) {
    return SystemError(path_ + "/" + name, "cannot be opened", errno);
  }
  auto file = std::make_unique<PosixSlots>(path_ + "/" + name, fd);
  if (Again([&] { return ftruncate(fd, static_cast<off_t>(bytes)); }) != 0) {
    return SystemError(path_ + "/" + name, "cannot be extended to its full size", errno);
  }
  return std::unique_ptr<SlotFile>(std::move(file));
}

Status PosixFolder::Rename(const std::string& from, const std::string& to) {
  return renameat(fd_, from.c_str(), fd_, to.c_str()) == 0
             ? Ok()
             : Status(SystemError(path_ + "/" + from, "cannot be renamed", errno));
}

// A file system may free all blocks of a large file in one commit, for which the log's syncs wait:
// 60 ms were measured for 100 MB on ext4 with discard. So the file is unlinked and then truncated
// in steps, unless it has other hard links.
Status PosixFolder::Remove(const std::string& name) {
  constexpr off_t kAtATime = off_t{4} << 20;
  const int fd = Again(
      [&] { return openat(fd_, name.c_str(), O_WRONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK); });
  const bool removed = unlinkat(fd_, name.c_str(), 0) == 0;
  const int number = errno;
  struct stat left {};
  if (fd >= 0 && removed && fstat(fd, &left) == 0 && left.st_nlink == 0) {
    while (left.st_size > kAtATime) {
      left.st_size -= kAtATime;
      if (ftruncate(fd, left.st_size) != 0 || fdatasync(fd) != 0) {
        break;  // the rest is freed at once
      }
    }
  }
  if (fd >= 0) {
    close(fd);
  }
  return removed ? Ok() : Status(SystemError(path_ + "/" + name, "cannot be removed", number));
}

Status PosixFolder::Sync() {
  return Again([this] { return fsync(fd_); }) == 0
             ? Ok()
             : Status(SystemError(path_, "cannot be synced", errno));
}

}  // namespace pheromone::journal
