#include "server/operators/ctl/keys/keys_commands.h"

#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <system_error>
#include <utility>

#include "server/base/file.h"
#include "server/base/random.h"
#include "server/operators/ctl/keys/key_formats.h"
#include "server/operators/ctl/server_call.h"
#include "server/operators/ctl/table.h"
#include "server/robots/signing/keys_file.h"

namespace pheromone::ctl {
namespace {

using signing::Key;
using signing::KeysFile;

constexpr const char* kReload = "a running server takes it with: pheromonectl reload\n";

bool Exists(const std::string& path) {
  std::error_code error;
  return std::filesystem::exists(std::filesystem::symlink_status(path, error));
}

Result<KeysFile> ReadOrBegin(const std::string& path) {
  return Exists(path) ? KeysFile::Read(path) : KeysFile();
}

Status MakeThem(const KeysOptions& options) {
  PHEROMONE_TRY(KeysFile file, ReadOrBegin(options.file));
  for (const int id : options.ids) {
    Key key{};
    FillRandom(key);
    if (!file.Add(static_cast<uint8_t>(id), key)) {
      return Error{
          fmt::format("{}:{}: robot {} has a key, expected a robot without: revoke it "
                      "first for another",
                      options.file, file.robots().at(static_cast<uint8_t>(id)).line, id)};
    }
  }
  return file.Write(options.file);
}

Error HasNoKey(const std::string& file, int id) {
  return Error{
      fmt::format("{}: robot {} has no key, expected one of those of pheromonectl keys "
                  "list --file {}",
                  file, id, file)};
}

Status RevokeThem(const KeysOptions& options) {
  PHEROMONE_TRY(KeysFile file, KeysFile::Read(options.file));
  for (const int id : options.ids) {
    if (!file.Remove(static_cast<uint8_t>(id))) {
      return HasNoKey(options.file, id);
    }
  }
  return file.Write(options.file);
}

Status Export(const KeyExport& options) {
  PHEROMONE_TRY(const KeysFile file, KeysFile::Read(options.file));
  const auto id = static_cast<uint8_t>(options.id);
  const auto robot = file.robots().find(id);
  if (robot == file.robots().end()) {
    return HasNoKey(options.file, options.id);
  }
  const Key& key = robot->second.key;
  const std::pair<std::string, std::string> outputs[] = {{options.robot, KeyAsHex(key)},
                                                         {options.eeprom, KeyAsIntelHex(key)},
                                                         {options.header, KeyAsHeader(id, key)}};
  for (const auto& [path, text] : outputs) {
    if (!path.empty()) {
      PHEROMONE_TRY_STATUS(WriteSecretFile(path, text));
    }
  }
  return Ok();
}

int Report(const Status& status, const std::string& good) {
  if (!status.ok()) {
    return Fail(kFailed, status.error());
  }
  std::cout << good;
  return 0;
}

}  // namespace

int MakeKeys(const KeysOptions& options) {
  return Report(MakeThem(options),
                fmt::format("{} new in {}; {}", options.ids.size(), options.file, kReload));
}

int ListKeys(const std::string& file) {
  const Result<KeysFile> keys = KeysFile::Read(file);
  if (!keys.ok()) {
    return Fail(kFailed, keys.error());
  }
  std::vector<std::vector<std::string>> rows = {{"ID", "COMMENT"}};
  for (const auto& [id, robot] : keys.value().robots()) {
    rows.push_back({std::to_string(id), robot.comment});
  }
  PrintTable(std::move(rows));
  return 0;
}

int RevokeKeys(const KeysOptions& options) {
  return Report(RevokeThem(options),
                fmt::format("{} revoked in {}; {}", options.ids.size(), options.file, kReload));
}

int ExportKey(const KeyExport& options) {
  return Report(Export(options), "");
}

}  // namespace pheromone::ctl
