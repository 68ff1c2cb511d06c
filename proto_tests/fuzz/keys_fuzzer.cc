// Any bytes as a file with keys: it is understood, or there is an error that names a line and shows
// no key. What is understood is a key for each robot, and stays so through changes.

#include <cctype>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "proto_tests/fuzz/require.h"
#include "server/robots/signing/keys_file.h"

namespace {

using pheromone::fuzz::Require;
using pheromone::signing::Key;
using pheromone::signing::Keys;
using pheromone::signing::KeysFile;

// Longer than any ID or word of hexadecimal digits in a message.
constexpr size_t kLongRun = 8;

bool ShowsAKey(std::string_view message) {
  size_t run = 0;
  for (const char c : message) {
    run = std::isxdigit(static_cast<unsigned char>(c)) != 0 ? run + 1 : 0;
    if (run == kLongRun) {
      return true;
    }
  }
  return false;
}

void RequireSameAfterWriting(const KeysFile& file) {
  const auto again = KeysFile::Parse(file.text(), "k");
  Require(again.ok());
  Require(again.value().keys() == file.keys());
  Require(again.value().text() == file.text());
  for (const auto& [id, robot] : file.robots()) {
    Require(again.value().robots().at(id).line == robot.line);
    Require(again.value().robots().at(id).comment == robot.comment);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  auto parsed = KeysFile::Parse(std::string_view(reinterpret_cast<const char*>(data), size), "k");
  if (!parsed.ok()) {
    Require(parsed.error().starts_with("k:") && !ShowsAKey(parsed.error()));
    return 0;
  }
  KeysFile& file = parsed.value();
  const Keys keys = file.keys();
  RequireSameAfterWriting(file);
  for (const auto& [id, key] : keys) {
    Require(id >= 1 && id <= pheromone::signing::kMaxRobot);
    Require(!file.Add(id, Key{}));
    Require(file.Remove(id) && !file.Remove(id));
    Require(file.Add(id, key));
    RequireSameAfterWriting(file);
  }
  Require(file.keys() == keys);
  return 0;
}
