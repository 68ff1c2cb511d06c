#include "server/operators/ctl/keys/key_formats.h"

#include <fmt/format.h>

#include <vector>

#include "protocol/crc16.h"
#include "server/base/hex.h"

namespace pheromone::ctl {

std::string KeyAsHex(const signing::Key& key) {
  return HexText(key) + '\n';
}

std::string KeyAsIntelHex(const signing::Key& key) {
  std::vector<uint8_t> record = {0, kKeyInEeprom >> 8, kKeyInEeprom & 0xFF, 0};  // a record of data
  record.insert(record.end(), key.begin(), key.end());
  const uint16_t check = protocol::Check(key.data(), key.size());
  record.push_back(static_cast<uint8_t>(check & 0xFF));
  record.push_back(static_cast<uint8_t>(check >> 8));
  record[0] = static_cast<uint8_t>(record.size() - 4);
  std::string text = ":";
  unsigned sum = 0;
  for (const uint8_t byte : record) {
    text += fmt::format("{:02X}", byte);
    sum += byte;
  }
  return text + fmt::format("{:02X}\n:00000001FF\n", -sum & 0xFF);
}

std::string KeyAsHeader(uint8_t id, const signing::Key& key) {
  std::string bytes;
  for (size_t i = 0; i < key.size(); ++i) {
    bytes += fmt::format("{}0x{:02x},", i % 8 == 0 ? "\n    " : " ", key[i]);
  }
  return fmt::format(
      "/* The key of robot {}: a secret. Made by pheromonectl keys export. */\n"
      "#ifndef PHEROMONE_KEY_H\n#define PHEROMONE_KEY_H\n\n#include <stdint.h>\n\n"
      "static const uint8_t pheromone_key[16] = {{{}\n}};\n\n#endif\n",
      id, bytes);
}

}  // namespace pheromone::ctl
