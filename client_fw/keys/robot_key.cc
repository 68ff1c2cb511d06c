#include "client_fw/keys/robot_key.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <charconv>
#include <string_view>

#include "client_fw/keys/start_count.h"
#include "server/base/file.h"

namespace pheromone::keys {
namespace {

constexpr size_t kMaxFile = 4096;
constexpr size_t kDigits = 32;

bool ParseByte(std::string_view digits, uint8_t* byte) {
  const auto [end, error] =
      std::from_chars(digits.data(), digits.data() + digits.size(), *byte, 16);
  return error == std::errc() && end == digits.data() + digits.size();
}

std::string_view FirstLine(std::string_view text) {
  const std::string_view line = text.substr(0, text.find('\n'));
  return line.ends_with('\r') ? line.substr(0, line.size() - 1) : line;
}

}  // namespace

Result<RobotKey> TakeKey(const std::string& path) {
  PHEROMONE_TRY(const std::string text, ReadFile(path, kMaxFile));
  const std::string_view line = FirstLine(text);
  RobotKey key;
  bool is_hex = line.size() == kDigits;
  for (size_t i = 0; is_hex && i < key.bytes.size(); ++i) {
    is_hex = ParseByte(line.substr(2 * i, 2), &key.bytes.at(i));
  }
  if (!is_hex) {  // without the text: it may be most of a key
    return Error{
        fmt::format("{}: the first line has {} characters that are not a key, expected {} "
                    "hexadecimal digits",
                    path, line.size(), kDigits)};
  }
  struct stat status = {};
  key.open_to_others = stat(path.c_str(), &status) == 0 && (status.st_mode & 0077u) != 0;
  PHEROMONE_TRY(key.start, CountStarts(path));
  return key;
}

}  // namespace pheromone::keys
