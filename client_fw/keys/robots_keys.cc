#include "client_fw/keys/robots_keys.h"

#include <fmt/format.h>

#include "client_fw/keys/start_count.h"
#include "server/robots/signing/keys_file.h"

namespace pheromone::keys {

Result<RobotsKeys> TakeKeys(const std::string& path, const std::set<uint8_t>& ids,
                            uint16_t starts) {
  PHEROMONE_TRY(const signing::KeysFile file, signing::KeysFile::Read(path));
  for (const uint8_t id : ids) {
    if (!file.robots().contains(id)) {
      return Error{
          fmt::format("{}: robot {} has no key, expected a line \"{} KEY\"", path, id, id)};
    }
  }
  PHEROMONE_TRY(const uint16_t first, CountStarts(path, starts));
  return RobotsKeys{file.keys(), first};
}

}  // namespace pheromone::keys
