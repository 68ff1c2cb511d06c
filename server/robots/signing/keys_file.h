// The file with the robots' keys: a line a robot,
//
//   # ID KEY [COMMENT]
//   7 000102030405060708090a0b0c0d0e0f the red one
//
// ID from 1 to 254, KEY 32 hexadecimal digits; what follows a # is a comment. Only its owner may
// read it.
//
//   PHEROMONE_TRY_STATUS(KeysFile::Change("robots.keys", kBegin, [&](KeysFile* file) {
//     file->Add(8, key);                  // comments and order of all other lines are kept
//     return Ok();
//   }));
//
// Errors are FILE:LINE: what was found, what was expected; no message contains a key.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/robots/signing/keys.h"

namespace pheromone::signing {

constexpr int kMaxRobot = 254;  ///< the last ID of a robot; the first is 1

class KeysFile {
 public:
  struct Robot {
    Key key{};
    std::string comment{};  ///< as it was written: escape it where it is shown
    size_t line = 0;        ///< in the file, from 1
  };

  /// What a new file begins with.
  KeysFile();

  /// Errors: a line is wrong, or two robots have one ID or one key. `name` is the file's.
  static Result<KeysFile> Parse(std::string_view text, const std::string& name);
  /// Errors: those of Parse; it cannot be read, or not by its owner only.
  static Result<KeysFile> Read(const std::string& path);

  /// Replaces a file by what `change` makes of it, with mode 0600 (WriteSecretFile,
  /// server/base/file.h). If there is none, one is begun, or it is an error. Waits for other
  /// changes in this folder, by whatever process: none is lost. Errors: those of Read and of
  /// `change`; then the file is unchanged.
  enum class IfMissing { kBegin, kError };
  static Status Change(const std::string& path, IfMissing if_missing,
                       const std::function<Status(KeysFile*)>& change);

  const std::map<uint8_t, Robot>& robots() const { return robots_; }
  Keys keys() const;
  std::string text() const;

  /// A line at the end. False if the robot has a key.
  bool Add(uint8_t id, const Key& key);
  /// Removes the robot's line, comment included. False if there is none.
  bool Remove(uint8_t id);

 private:
  Status ParseLine(std::string_view line);

  std::vector<std::string> lines_;
  std::map<uint8_t, Robot> robots_;
};

}  // namespace pheromone::signing
