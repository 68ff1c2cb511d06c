#include "client_fw/core/requests/request_memory.h"

#include <stddef.h>

#include "protocol/crc16.h"

namespace pheromone {
namespace client {
namespace {

static_assert(sizeof(RequestMemory) < offsetof(RequestMemory, crc) + 2 + alignof(RequestMemory),
              "nothing is behind the CRC but padding");

uint16_t CheckOf(const RequestMemory& memory) {
  return protocol::Check(&memory, offsetof(RequestMemory, crc));
}

}  // namespace

void Seal(RequestMemory* memory) {
  memory->crc = CheckOf(*memory);
}

bool Trusted(const RequestMemory& memory) {
  return memory.crc == CheckOf(memory);
}

}  // namespace client
}  // namespace pheromone
