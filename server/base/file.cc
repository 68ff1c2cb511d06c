#include "server/base/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

#include "server/base/descriptor.h"

namespace pheromone {

Result<std::string> ReadFile(const std::string& path, size_t max_bytes) {
  // Without O_NONBLOCK, opening a pipe would wait for a writer.
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  struct stat status {};
  if (!file.valid() || fstat(file.get(), &status) != 0) {
    return SystemError(path + ": cannot be opened");
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
      return SystemError(path + ": cannot be read");
    }
    bytes.append(portion.data(), static_cast<size_t>(std::max<ssize_t>(count, 0)));
    if (bytes.size() > max_bytes) {
      return too_long();  // it has grown, or does not report its size
    }
  }
}

namespace {

// Creates a new file beside this one. Exclusive, so that two writers do not share it; files left by
// a crash are skipped. `*fresh` is its name.
Descriptor OpenBeside(const std::string& path, mode_t mode, std::string* fresh) {
  Descriptor file;
  for (int attempt = 0; !file.valid() && attempt < 100; ++attempt) {
    *fresh = path + ".new" + std::to_string(attempt);
    file = Descriptor(open(fresh->c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode));
    if (!file.valid() && errno != EEXIST) {
      break;
    }
  }
  return file;
}

Status Replace(const std::string& path, std::string_view bytes, bool is_secret) {
  // A rename would also replace a device, such as /dev/null.
  struct stat found {};
  const bool exists = stat(path.c_str(), &found) == 0;
  if (exists && !S_ISREG(found.st_mode) && !S_ISDIR(found.st_mode)) {
    return Error{path + ": cannot be written: is not a regular file"};
  }
  std::string fresh;
  Descriptor file = OpenBeside(path, is_secret ? 0600 : 0666, &fresh);
  if (!file.valid()) {
    return SystemError(fresh + ": cannot be created");
  }
  const bool has_owner =
      !is_secret || (fchmod(file.get(), 0600) == 0 &&
                     (!exists || found.st_uid == geteuid() ||
                      fchown(file.get(), found.st_uid, static_cast<gid_t>(-1)) == 0));
  if (!has_owner || !WriteAll(file.get(), bytes) || fsync(file.get()) != 0 || !file.Close() ||
      std::rename(fresh.c_str(), path.c_str()) != 0) {
    const Error error = SystemError(path + ": cannot be written");
    unlink(fresh.c_str());
    return error;
  }
  return Ok();
}

}  // namespace

Status WriteFile(const std::string& path, std::string_view bytes) {
  return Replace(path, bytes, false);
}

Status WriteSecretFile(const std::string& path, std::string_view bytes) {
  return Replace(path, bytes, true);
}

FileWriter::FileWriter(std::string path) : path_(std::move(path)), target_(path_) {
  struct stat found {};
  const bool exists = lstat(path_.c_str(), &found) == 0;
  if (exists && S_ISLNK(found.st_mode)) {
    std::error_code error;
    const std::filesystem::path end = std::filesystem::canonical(path_, error);
    target_ = error ? path_ : end.string();
  }
  const bool is_file = stat(target_.c_str(), &found) == 0 && S_ISREG(found.st_mode);
  Descriptor file;
  if (exists && !is_file) {
    file =
        Descriptor(open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOCTTY, 0666));
  } else {
    file = OpenBeside(target_, 0666, &fresh_);
  }
  file_ = file.valid() ? fdopen(file.get(), "wb") : nullptr;
  if (file_ == nullptr) {
    status_ = SystemError((fresh_.empty() ? path_ : fresh_) + ": cannot be created");
    fresh_.clear();
    return;
  }
  file.release();
}

FileWriter::~FileWriter() {
  if (file_ != nullptr) {
    std::fclose(file_);
  }
  if (!fresh_.empty()) {
    unlink(fresh_.c_str());
  }
}

void FileWriter::Fail() {
  if (status_.ok()) {
    status_ = SystemError(path_ + ": cannot be written");
  }
}

void FileWriter::Write(std::string_view part) {
  if (status_.ok() && std::fwrite(part.data(), 1, part.size(), file_) != part.size()) {
    Fail();
  }
}

Status FileWriter::Close() {
  std::FILE* const file = std::exchange(file_, nullptr);
  if (file == nullptr) {
    return status_;
  }
  if (std::fflush(file) != 0 || (!fresh_.empty() && fsync(fileno(file)) != 0)) {
    Fail();
  }
  if (std::fclose(file) != 0) {
    Fail();
  }
  return status_;
}

Status FileWriter::Commit() {
  PHEROMONE_TRY_STATUS(Close());
  if (!fresh_.empty() && std::rename(fresh_.c_str(), target_.c_str()) != 0) {
    Fail();
  } else {
    fresh_.clear();
  }
  return status_;
}

Status CheckOutput(const std::string& output, const std::vector<std::string>& inputs) {
  struct stat written {};
  if (stat(output.c_str(), &written) != 0 || !S_ISREG(written.st_mode)) {
    return Ok();
  }
  for (const std::string& input : inputs) {
    struct stat read {};
    if (stat(input.c_str(), &read) == 0 && read.st_dev == written.st_dev &&
        read.st_ino == written.st_ino) {
      return Error{output + ": the output is the input " + input + ", expected another name"};
    }
  }
  return Ok();
}

}  // namespace pheromone
