#include "client_fw/core/requests/request_memory.h"

#include "client_fw/core/base/outlined.h"
#include "protocol/crc16.h"

namespace pheromone {
namespace client {
namespace {

constexpr uint8_t kValuesSize = sizeof(RequestValues);

PHEROMONE_OUTLINED uint16_t CheckOf(const RequestValues& values) {
  return protocol::Check(&values, kValuesSize);
}

// With the padding, of which the CRC is too; not before what is above it, nor after what follows.
void Copy(const RequestValues& from, RequestValues* to) {
  __atomic_signal_fence(__ATOMIC_SEQ_CST);
  for (uint8_t i = 0; i < kValuesSize; ++i) {
    reinterpret_cast<uint8_t*>(to)[i] = reinterpret_cast<const uint8_t*>(&from)[i];
  }
  __atomic_signal_fence(__ATOMIC_SEQ_CST);
}

}  // namespace

void Seal(RequestMemory* memory) {
  memory->crc = CheckOf(*memory);
  Copy(*memory, &memory->sealed);
}

bool Trusted(const RequestMemory& memory) {
  return memory.crc == CheckOf(memory);
}

bool Restore(RequestMemory* memory) {
  if (!Trusted(*memory)) {
    Copy(memory->sealed, memory);
  }
  return Trusted(*memory);
}

}  // namespace client
}  // namespace pheromone
