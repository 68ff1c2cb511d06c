#include "server/daemon/revocations.h"

#include <fmt/format.h>

#include <set>

#include "server/robots/signing/fingerprint.h"

namespace pheromone::daemon {
namespace {

Error HasNoKey(const LinkKeys& keys, uint8_t robot) {
  std::set<int> others;
  for (const auto& [link, its] : keys) {
    for (const auto& [id, key] : its) {
      others.insert(id);
    }
  }
  const std::string expected =
      others.empty() ? "and no link has keys, expected security = \"require\" in [[link]]"
                     : fmt::format("expected one of {}", fmt::join(others, ", "));
  return Error{
      fmt::format("no link has a key of robot {}, {}; a key in a file only: pheromonectl keys "
                  "revoke {} --file FILE",
                  robot, expected, robot)};
}

}  // namespace

Result<Revocation> FindKeys(const LinkKeys& keys, std::span<const uint8_t> robots) {
  std::set<engine::RevokedKey> found;  // links may share a file
  std::set<std::string> links;
  for (const uint8_t robot : robots) {
    bool has_key = false;
    for (const auto& [link, its] : keys) {
      if (const auto key = its.find(robot); key != its.end()) {
        found.insert({robot, signing::FingerprintOf(key->second)});
        links.insert(link);
        has_key = true;
      }
    }
    if (!has_key) {
      return HasNoKey(keys, robot);
    }
  }
  return Revocation{{found.begin(), found.end()}, {links.begin(), links.end()}};
}

SiftedKeys Sift(const signing::Keys& keys, const engine::RevokedKeys& revoked) {
  SiftedKeys sifted{keys, {}};
  std::set<uint8_t> robots;
  for (const engine::RevokedKey& it : revoked.keys()) {
    robots.insert(it.id);
  }
  for (const uint8_t robot : robots) {
    const auto key = keys.find(robot);
    if (key != keys.end() && revoked.Contains({robot, signing::FingerprintOf(key->second)})) {
      sifted.valid.erase(robot);
      sifted.revoked.push_back(robot);
    }
  }
  return sifted;
}

}  // namespace pheromone::daemon
