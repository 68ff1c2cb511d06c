#include "server/robots/signing/keys_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "server/base/descriptor.h"
#include "server/base/file.h"
#include "server/base/hex.h"
#include "server/base/message.h"
#include "server/base/text.h"

namespace pheromone::signing {
namespace {

constexpr size_t kMaxBytes = 1 << 20;
constexpr std::string_view kLineExpected = "expected ID KEY [COMMENT]";

// Takes the first word off; a # ends it, too.
std::string_view TakeWord(std::string_view* text) {
  const std::string_view word = text->substr(0, text->find_first_of(" \t\r#"));
  *text = Trim(text->substr(word.size()));
  return word;
}

std::optional<uint8_t> ParseNumber(std::string_view digits, int base) {
  uint8_t number = 0;
  const char* const end = digits.data() + digits.size();
  const auto parsed = std::from_chars(digits.data(), end, number, base);
  return parsed.ec == std::errc() && parsed.ptr == end ? std::optional(number) : std::nullopt;
}

// Says where a key is wrong, and not what it is.
Result<Key> ParseKey(std::string_view digits) {
  constexpr std::string_view kExpected = ", expected 32 hexadecimal digits";
  Key key{};
  const size_t good = std::min(digits.find_first_not_of("0123456789abcdefABCDEF"), digits.size());
  if (good != digits.size()) {
    return Error{"character " + std::to_string(good + 1) + " of the key is no digit" +
                 std::string(kExpected)};
  }
  if (digits.size() != 2 * key.size()) {
    return Error{"found a key of " + std::to_string(digits.size()) + " digits" +
                 std::string(kExpected)};
  }
  for (size_t i = 0; i < key.size(); ++i) {
    key[i] = *ParseNumber(digits.substr(2 * i, 2), 16);
  }
  return key;
}

// The file itself is replaced, so the lock is its folder's.
Result<Descriptor> LockFolderOf(const std::string& path) {
  const std::string parent = std::filesystem::path(path).parent_path();
  const std::string folder = parent.empty() ? "." : parent;
  Descriptor lock(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  int locked = -1;
  do {
    locked = flock(lock.get(), LOCK_EX);
  } while (locked != 0 && errno == EINTR);
  if (locked != 0) {
    return SystemError(folder);
  }
  return lock;
}

}  // namespace

KeysFile::KeysFile() : lines_{"# ID KEY [COMMENT]: a robot a line, see pheromonectl(1)"} {}

Result<KeysFile> KeysFile::Parse(std::string_view text, const std::string& name) {
  KeysFile file;
  file.lines_.clear();
  if (const Status status = SkipByteOrderMark(&text); !status.ok()) {
    return AtLine(name, 1, 0, status.error());
  }
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    file.lines_.emplace_back(line);
    if (const Status status = file.ParseLine(line); !status.ok()) {
      return AtLine(name, file.lines_.size(), 0, status.error());
    }
  }
  return file;
}

Status KeysFile::ParseLine(std::string_view line) {
  line = Trim(line);
  if (line.empty() || line.front() == '#') {
    return Ok();
  }
  const std::string_view id_text = TakeWord(&line);
  const auto id = ParseNumber(id_text, 10);
  if (!id || *id == 0 || *id > kMaxRobot) {
    // A key that stands first is not repeated.
    return Error{"found " +
                 (id_text.size() > 4 ? "a word of " + std::to_string(id_text.size()) + " characters"
                                     : Quoted(id_text, 4)) +
                 " as ID, expected a whole number from 1 to 254"};
  }
  const std::string_view digits = TakeWord(&line);
  if (digits.empty()) {
    return Error{"robot " + std::to_string(*id) + " has no key, " + std::string(kLineExpected)};
  }
  PHEROMONE_TRY(const Key key, ParseKey(digits));
  for (const auto& [other, robot] : robots_) {
    if (other == *id || robot.key == key) {
      return Error{(other == *id ? "robot " + std::to_string(*id) + " again"
                                 : "the key of robot " + std::to_string(other) + " again") +
                   ", as in line " + std::to_string(robot.line) +
                   ", expected one line a robot, with a key of its own"};
    }
  }
  if (line.starts_with('#')) {
    line = Trim(line.substr(1));
  }
  robots_[*id] = {key, std::string(line), lines_.size()};
  return Ok();
}

Result<KeysFile> KeysFile::Read(const std::string& path) {
  PHEROMONE_TRY(const std::string text, ReadFile(path, kMaxBytes));
  struct stat status {};
  if (stat(path.c_str(), &status) != 0 || (status.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    return Error{path + ": others than its owner may read it or change it, expected mode 0600: " +
                 "chmod 600 " + path};
  }
  return Parse(text, path);
}

Status KeysFile::Change(const std::string& path, IfMissing if_missing,
                        const std::function<Status(KeysFile*)>& change) {
  PHEROMONE_TRY(const Descriptor lock, LockFolderOf(path));
  std::error_code error;
  const bool is_begun = if_missing == IfMissing::kBegin &&
                        !std::filesystem::exists(std::filesystem::symlink_status(path, error));
  PHEROMONE_TRY(KeysFile file, is_begun ? KeysFile() : Read(path));
  PHEROMONE_TRY_STATUS(change(&file));
  return WriteSecretFile(path, file.text());
}

Keys KeysFile::keys() const {
  Keys keys;
  for (const auto& [id, robot] : robots_) {
    keys[id] = robot.key;
  }
  return keys;
}

std::string KeysFile::text() const {
  std::string text;
  for (const std::string& line : lines_) {
    text += line + '\n';
  }
  return text;
}

bool KeysFile::Add(uint8_t id, const Key& key) {
  if (robots_.contains(id)) {
    return false;
  }
  lines_.push_back(std::to_string(id) + ' ' + HexText(key));
  robots_[id] = {key, "", lines_.size()};
  return true;
}

bool KeysFile::Remove(uint8_t id) {
  const auto removed = robots_.find(id);
  if (removed == robots_.end()) {
    return false;
  }
  const size_t line = removed->second.line;
  lines_.erase(lines_.begin() + static_cast<std::ptrdiff_t>(line - 1));
  robots_.erase(removed);
  for (auto& [other, robot] : robots_) {
    robot.line -= robot.line > line ? 1 : 0;
  }
  return true;
}

}  // namespace pheromone::signing
