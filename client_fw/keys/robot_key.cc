#include "client_fw/keys/robot_key.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <optional>
#include <string_view>

#include "client_fw/keys/start_count.h"
#include "server/base/file.h"
#include "server/base/hex.h"

namespace pheromone::keys {
namespace {

constexpr size_t kMaxFile = 4096;
constexpr size_t kDigits = 32;

std::string_view FirstLine(std::string_view text) {
  const std::string_view line = text.substr(0, text.find('\n'));
  return line.ends_with('\r') ? line.substr(0, line.size() - 1) : line;
}

}  // namespace

Result<RobotKey> TakeKey(const std::string& path) {
  PHEROMONE_TRY(const std::string text, ReadFile(path, kMaxFile));
  const std::string_view line = FirstLine(text);
  const auto bytes = line.size() == kDigits ? ParseHex(line) : std::nullopt;
  if (!bytes) {  // without the text: it may be most of a key
    return Error{
        fmt::format("{}: the first line has {} characters that are not a key, expected {} "
                    "hexadecimal digits",
                    path, line.size(), kDigits)};
  }
  RobotKey key;
  std::copy(bytes->begin(), bytes->end(), key.bytes.begin());
  struct stat status = {};
  key.open_to_others = stat(path.c_str(), &status) == 0 && (status.st_mode & 0077u) != 0;
  PHEROMONE_TRY(key.start, CountStarts(path));
  return key;
}

}  // namespace pheromone::keys
