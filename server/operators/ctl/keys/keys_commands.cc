#include "server/operators/ctl/keys/keys_commands.h"

#include <fmt/format.h>

#include <iostream>
#include <utility>
#include <vector>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/serialize.hpp>

#include "server/base/file.h"
#include "server/base/random.h"
#include "server/operators/ctl/json_read.h"
#include "server/operators/ctl/keys/key_formats.h"
#include "server/operators/ctl/server_call.h"
#include "server/operators/ctl/table.h"
#include "server/robots/signing/keys_file.h"

namespace pheromone::ctl {
namespace {

namespace json = boost::json;
using signing::Key;
using signing::KeysFile;

constexpr const char* kReload = "a running server takes it with: pheromonectl reload\n";

Status Make(const KeysOptions& options, KeysFile* file) {
  for (const int id : options.ids) {
    Key key{};
    FillRandom(key);
    if (!file->Add(static_cast<uint8_t>(id), key)) {
      return Error{
          fmt::format("{}:{}: robot {} has a key, expected a robot without: revoke it "
                      "first for another",
                      options.file, file->robots().at(static_cast<uint8_t>(id)).line, id)};
    }
  }
  return Ok();
}

Error HasNoKey(const std::string& file, int id) {
  return Error{
      fmt::format("{}: robot {} has no key, expected one of those of pheromonectl keys "
                  "list --file {}",
                  file, id, file)};
}

Status Revoke(const KeysOptions& options, KeysFile* file) {
  for (const int id : options.ids) {
    if (!file->Remove(static_cast<uint8_t>(id))) {
      return HasNoKey(options.file, id);
    }
  }
  return Ok();
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
  return Report(KeysFile::Change(options.file, KeysFile::IfMissing::kBegin,
                                 [&](KeysFile* file) { return Make(options, file); }),
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

int RevokeKeysInFile(const KeysOptions& options) {
  return Report(KeysFile::Change(options.file, KeysFile::IfMissing::kError,
                                 [&](KeysFile* file) { return Revoke(options, file); }),
                fmt::format("{} revoked in {}; {}", options.ids.size(), options.file, kReload));
}

int RevokeKeysAtServer(const ServerOptions& server, const std::vector<int>& ids) {
  const json::object body{{"ids", json::array(ids.begin(), ids.end())}};
  const JsonReply reply = CallJson(server, "POST", "/api/v1/revoke", json::serialize(body));
  if (IsDone(server, reply)) {
    return reply.exit_status;
  }
  std::vector<std::string> links;
  for (const json::value& link : ItemsAt(reply.value, "links")) {
    links.emplace_back(TextOf(link));
  }
  fmt::print("revoked: robot {}, on {}; {}\n", fmt::join(ids, ", "), fmt::join(links, ", "),
             FlagAt(reply.value, "kept")
                 ? "for good, whatever the keys file has"
                 : "not kept: no journal; take it out of the keys file, too, with --file");
  return 0;
}

int ExportKey(const KeyExport& options) {
  for (const std::string& path : {options.robot, options.eeprom, options.header}) {
    if (const Status other = CheckOutput(path, {options.file}); !other.ok()) {
      return Fail(kUsage, other.error());
    }
  }
  return Report(Export(options), "");
}

}  // namespace pheromone::ctl
