#include "client_fw/attach/robot_key.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <charconv>
#include <string_view>

#include "server/base/file.h"

namespace pheromone::attach {
namespace {

constexpr size_t kMaxFile = 4096;
constexpr size_t kDigits = 32;
constexpr uint32_t kMaxStarts = 65'535;

template <typename Number>
bool Parse(std::string_view text, int base, Number* number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *number, base);
  return error == std::errc() && end == text.data() + text.size();
}

std::string_view FirstLine(std::string_view text) {
  const std::string_view line = text.substr(0, text.find('\n'));
  return line.ends_with('\r') ? line.substr(0, line.size() - 1) : line;
}

Result<uint16_t> CountStart(const std::string& path) {
  uint32_t starts = 0;
  struct stat status = {};
  if (stat(path.c_str(), &status) == 0) {
    PHEROMONE_TRY(const std::string text, ReadFile(path, kMaxFile));
    if (!Parse(FirstLine(text), 10, &starts) || starts > kMaxStarts) {
      return Error{
          fmt::format("{}: \"{}\", expected the number of starts, 0 to {}; without the "
                      "file the count begins at 0, for a new key only",
                      path, FirstLine(text), kMaxStarts)};
    }
  }
  if (starts == kMaxStarts) {
    return Error{
        fmt::format("{}: {} starts, expected fewer: the robot needs a new key", path, starts)};
  }
  ++starts;
  PHEROMONE_TRY_STATUS(WriteFile(path, fmt::format("{}\n", starts)));
  return static_cast<uint16_t>(starts);
}

}  // namespace

Result<RobotKey> TakeKey(const std::string& path) {
  PHEROMONE_TRY(const std::string text, ReadFile(path, kMaxFile));
  const std::string_view line = FirstLine(text);
  RobotKey key;
  bool is_hex = line.size() == kDigits;
  for (size_t i = 0; is_hex && i < key.bytes.size(); ++i) {
    is_hex = Parse(line.substr(2 * i, 2), 16, &key.bytes.at(i));
  }
  if (!is_hex) {  // without the text: it may be most of a key
    return Error{
        fmt::format("{}: the first line has {} characters that are not a key, expected {} "
                    "hexadecimal digits",
                    path, line.size(), kDigits)};
  }
  struct stat status = {};
  key.open_to_others = stat(path.c_str(), &status) == 0 && (status.st_mode & 0077u) != 0;
  PHEROMONE_TRY(key.start, CountStart(path + ".starts"));
  return key;
}

}  // namespace pheromone::attach
