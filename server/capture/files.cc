#include "server/capture/files.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <regex>
#include <vector>

#include "server/capture/format.h"

namespace pheromone::capture {
namespace {

constexpr int kMaxNames = 1000;

Error Failed(const std::string& path, const char* what) {
  return Error{path + ": " + what + ": " + std::strerror(errno)};
}

// 20260131T235959Z, from days to a date as in Hinnant's civil_from_days.
std::string UtcName(uint64_t utc_ns) {
  const uint64_t seconds = utc_ns / 1'000'000'000;
  const uint64_t days = seconds / 86'400 + 719'468;
  const uint64_t era = days / 146'097;
  const uint64_t day_of_era = days % 146'097;
  const uint64_t year_of_era =
      (day_of_era - day_of_era / 1460 + day_of_era / 36'524 - day_of_era / 146'096) / 365;
  const uint64_t day_of_year =
      day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
  const uint64_t march_month = (5 * day_of_year + 2) / 153;
  const uint64_t day = day_of_year - (153 * march_month + 2) / 5 + 1;
  const uint64_t month = march_month < 10 ? march_month + 3 : march_month - 9;
  const uint64_t year = year_of_era + era * 400 + (month <= 2 ? 1 : 0);
  std::array<char, 80> text{};
  const int size =
      std::snprintf(text.data(), text.size(), "%04u%02u%02uT%02u%02u%02uZ",
                    static_cast<unsigned>(year), static_cast<unsigned>(month),
                    static_cast<unsigned>(day), static_cast<unsigned>(seconds / 3600 % 24),
                    static_cast<unsigned>(seconds / 60 % 60), static_cast<unsigned>(seconds % 60));
  return {text.data(), static_cast<size_t>(size)};
}

std::string PartName(uint32_t part) {
  std::string digits = std::to_string(part);
  return std::string(digits.size() < 4 ? 4 - digits.size() : 0, '0') + digits;
}

}  // namespace

Status Files::Begin(const Start& start) {
  Close();
  const bool is_new = stem_.empty() || start.recording != recording_;
  const std::string stem = folder_ + "/pheromone-" + UtcName(start.recording);
  recording_ = start.recording;
  for (int i = 0; descriptor_ < 0; ++i) {
    if (is_new) {
      stem_ = i == 0 ? stem : stem + "-" + std::to_string(i);
    }
    path_ = stem_ + "-" + PartName(start.part) + ".pcapng";
    descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
    if (descriptor_ < 0 && (errno != EEXIST || !is_new || i == kMaxNames)) {
      return Failed(path_, "cannot be created");
    }
  }
  bytes_ = 0;
  number_ = 0;
  RemoveOldest();
  return Write(EncodeFileHeader(start.links, start.version));
}

Status Files::Write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t size = ::write(descriptor_, bytes.data(), bytes.size());
    if (size < 0 && errno == EINTR) {
      continue;
    }
    if (size < 0) {
      return Failed(path_, "cannot be written");
    }
    bytes_ += static_cast<uint64_t>(size);
    bytes.remove_prefix(static_cast<size_t>(size));
  }
  return Ok();
}

void Files::Close() {
  if (descriptor_ >= 0) {
    ::close(descriptor_);
    descriptor_ = -1;
  }
}

void Files::Discard() {
  if (open()) {
    Close();
    ::unlink(path_.c_str());
  }
}

// If removing fails, the recording continues.
void Files::RemoveOldest() const {
  if (most_files_ == 0) {
    return;
  }
  static const std::regex ours(R"(pheromone-\d{8}T\d{6}Z(-\d+)?-\d{4,}\.pcapng)");
  std::error_code error;
  std::vector<std::filesystem::path> found;
  for (std::filesystem::directory_iterator it(folder_, error), end; !error && it != end;
       it.increment(error)) {
    if (std::regex_match(it->path().filename().string(), ours) &&
        it->path() != std::filesystem::path(path_)) {
      found.push_back(it->path());
    }
  }
  std::sort(found.begin(), found.end());
  for (size_t i = 0; i + (most_files_ - 1) < found.size(); ++i) {
    std::filesystem::remove(found[i], error);
  }
}

}  // namespace pheromone::capture
