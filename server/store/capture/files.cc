#include "server/store/capture/files.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <regex>
#include <vector>

#include "server/base/format.h"
#include "server/store/capture/format.h"

namespace pheromone::capture {
namespace {

constexpr int kMaxNames = 1000;

std::string PartName(uint32_t part) {
  std::string digits = std::to_string(part);
  return std::string(digits.size() < 4 ? 4 - digits.size() : 0, '0') + digits;
}

}  // namespace

Status Files::Begin(const Start& start) {
  Close();
  const bool is_new = stem_.empty() || start.recording != recording_;
  const std::string stem =
      folder_ + "/pheromone-" +
      UtcText(static_cast<int64_t>(start.recording / 1'000'000'000), "%Y%m%dT%H%M%SZ");
  recording_ = start.recording;
  for (int i = 0; !open(); ++i) {
    if (is_new) {
      stem_ = i == 0 ? stem : stem + "-" + std::to_string(i);
    }
    path_ = stem_ + "-" + PartName(start.part) + ".pcapng";
    descriptor_ = Descriptor(::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
    if (!open() && (errno != EEXIST || !is_new || i == kMaxNames)) {
      return SystemError(path_ + ": cannot be created");
    }
  }
  bytes_ = 0;
  number_ = 0;
  RemoveOldest();
  return Write(EncodeFileHeader(start.links, start.version));
}

Status Files::Write(std::string_view bytes) {
  if (!WriteAll(descriptor_.get(), bytes)) {
    return SystemError(path_ + ": cannot be written");
  }
  bytes_ += bytes.size();
  return Ok();
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
