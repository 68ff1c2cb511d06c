#include "server/maps/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

namespace pheromone::maps {

namespace {

// A descriptor that is closed when it goes out of scope.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) {
      close(fd_);
    }
  }
  int get() const { return fd_; }
  bool Close() { return close(std::exchange(fd_, -1)) == 0; }

 private:
  int fd_;
};

Error SystemError(const std::string& path, const char* what) {
  return Error{path + ": " + what + ": " + std::strerror(errno)};
}

bool WriteAll(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = write(fd, bytes.data(), bytes.size());
    if (count < 0 && errno != EINTR) {
      return false;
    }
    bytes.remove_prefix(static_cast<size_t>(std::max<ssize_t>(count, 0)));
  }
  return true;
}

}  // namespace

Result<std::string> ReadFile(const std::string& path, size_t max_bytes) {
  // Without O_NONBLOCK, opening a pipe would wait for a writer.
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  struct stat status {};
  if (file.get() < 0 || fstat(file.get(), &status) != 0) {
    return SystemError(path, "cannot be opened");
  }
  if (!S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode)) {
    return Error{path + ": is not a regular file"};  // its bytes might never end, or never come
  }
  const auto too_long = [&] {
    return Error{path + ": too long, expected at most " + std::to_string(max_bytes) + " bytes"};
  };
  if (S_ISREG(status.st_mode) && static_cast<uint64_t>(status.st_size) > max_bytes) {
    return too_long();
  }
  std::string bytes;
  std::array<char, 65536> portion{};
  for (;;) {
    const ssize_t count = read(file.get(), portion.data(), portion.size());
    if (count == 0) {
      return bytes;
    }
    if (count < 0 && errno != EINTR) {
      return SystemError(path, "cannot be read");
    }
    bytes.append(portion.data(), static_cast<size_t>(std::max<ssize_t>(count, 0)));
    if (bytes.size() > max_bytes) {
      return too_long();  // it has grown, or is one of those that do not tell their size
    }
  }
}

Status WriteFile(const std::string& path, std::string_view bytes) {
  // A rename would also replace a device, such as /dev/null.
  struct stat found {};
  if (stat(path.c_str(), &found) == 0 && !S_ISREG(found.st_mode) && !S_ISDIR(found.st_mode)) {
    return Error{path + ": cannot be written: is not a regular file"};
  }
  // Exclusive, so that two writers do not share it; files left by a crash are skipped.
  std::string fresh;
  int fd = -1;
  for (int attempt = 0; fd < 0 && attempt < 100; ++attempt) {
    fresh = path + ".new" + std::to_string(attempt);
    fd = open(fresh.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd < 0 && errno != EEXIST) {
      break;
    }
  }
  Descriptor file(fd);
  if (file.get() < 0) {
    return SystemError(fresh, "cannot be created");
  }
  if (!WriteAll(file.get(), bytes) || fsync(file.get()) != 0 || !file.Close() ||
      std::rename(fresh.c_str(), path.c_str()) != 0) {
    const Error error = SystemError(path, "cannot be written");
    unlink(fresh.c_str());
    return error;
  }
  return Ok();
}

Error AtByte(std::string_view name, size_t offset, std::string_view what) {
  return Error{std::string(name) + ": byte " + std::to_string(offset) + ": " + std::string(what)};
}

Error AtLine(std::string_view name, size_t line, size_t column, std::string_view what) {
  std::string text = std::string(name) + ":" + std::to_string(line);
  if (column != 0) {
    text += ":" + std::to_string(column);
  }
  return Error{text + ": " + std::string(what)};
}

std::string Quoted(std::string_view found) {
  constexpr size_t kLongest = 32;
  std::string text = "\"";
  for (const char byte : found.substr(0, kLongest)) {
    text += byte >= ' ' && byte <= '~' ? byte : '?';
  }
  return text + (found.size() > kLongest ? "...\"" : "\"");
}

}  // namespace pheromone::maps
