#include "client_fw/keys/start_count.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <cerrno>
#include <charconv>
#include <string_view>

#include "server/base/descriptor.h"
#include "server/base/file.h"

namespace pheromone::keys {
namespace {

constexpr size_t kMaxCountFile = 4096;
constexpr uint32_t kMaxStarts = 65'535;

Result<uint32_t> ReadCount(const std::string& path) {
  struct stat status = {};
  if (stat(path.c_str(), &status) != 0 && errno == ENOENT) {
    return 0u;
  }
  PHEROMONE_TRY(const std::string text, ReadFile(path, kMaxCountFile));
  std::string_view line = std::string_view(text).substr(0, text.find('\n'));
  if (line.ends_with('\r')) {
    line.remove_suffix(1);
  }
  uint32_t starts = 0;
  const char* const line_end = line.data() + line.size();
  const auto [end, error] = std::from_chars(line.data(), line_end, starts);
  if (error != std::errc() || end != line_end || starts > kMaxStarts) {
    return Error{
        fmt::format("{}: \"{}\", expected the number of starts, 0 to {}; without the "
                    "file the count begins at 0, for new keys only",
                    path, line, kMaxStarts)};
  }
  return starts;
}

}  // namespace

Result<uint16_t> CountStarts(const std::string& key_file, uint16_t count) {
  // The count is replaced with its file, so the lock is the key's.
  const Descriptor lock(open(key_file.c_str(), O_RDONLY | O_CLOEXEC));
  int locked = -1;
  do {
    locked = flock(lock.get(), LOCK_EX);
  } while (locked != 0 && errno == EINTR);
  if (locked != 0) {
    return SystemError(key_file);
  }
  const std::string path = key_file + ".starts";
  PHEROMONE_TRY(const uint32_t starts, ReadCount(path));
  if (starts + count > kMaxStarts) {
    return Error{fmt::format("{}: {} starts, expected at most {}: new keys are needed", path,
                             starts, kMaxStarts - count)};
  }
  PHEROMONE_TRY_STATUS(WriteFile(path, fmt::format("{}\n", starts + count)));
  return static_cast<uint16_t>(starts + 1);
}

}  // namespace pheromone::keys
