#include "client_fw/boards/cortex_m/semihosted_eeprom.h"

#include "protocol/byte_order.h"
#include "protocol/crc16.h"

namespace pheromone {
namespace client {
namespace {

// The operations, and modes of SYS_OPEN as those of fopen.
enum Operation : uint32_t { kOpen = 0x01, kWrite = 0x05, kRead = 0x06, kSeek = 0x0A };
constexpr uint32_t kUpdate = 3;  // "r+b"
constexpr uint32_t kCreate = 7;  // "w+b"

// At most three arguments, of a word each.
int32_t Call(Operation operation, uint32_t first, uint32_t second, uint32_t third = 0) {
  const uint32_t arguments[3] = {first, second, third};
  register uint32_t result __asm("r0") = operation;
  register const uint32_t* block __asm("r1") = arguments;
  __asm volatile("bkpt 0xAB" : "+r"(result) : "r"(block) : "memory");
  return static_cast<int32_t>(result);
}

uint32_t Address(const void* at) {
  return reinterpret_cast<uint32_t>(at);
}

int32_t Open(uint32_t mode) {
  static const char kName[] = "eeprom.bin";
  return Call(kOpen, Address(kName), mode, sizeof(kName) - 1);
}

}  // namespace

uint8_t SemihostedEeprom::bytes_[kSize];
int32_t SemihostedEeprom::file_;
bool SemihostedEeprom::failed_;

void SemihostedEeprom::Begin() {
  for (uint8_t& byte : bytes_) {
    byte = 0xFF;
  }
  file_ = Open(kUpdate);
  if (file_ < 0) {
    file_ = Open(kCreate);
  }
  failed_ = file_ < 0;
  if (Call(kRead, static_cast<uint32_t>(file_), Address(bytes_), kSize) != 0) {
    Store(0, kSize);  // it was shorter
  }
}

void SemihostedEeprom::Write(uint8_t at, uint8_t value) {
  bytes_[at] = value;
  Store(at, 1);
}

void SemihostedEeprom::Store(uint16_t at, uint16_t size) {
  const uint32_t file = static_cast<uint32_t>(file_);
  failed_ =
      failed_ || Call(kSeek, file, at) != 0 || Call(kWrite, file, Address(bytes_ + at), size) != 0;
}

bool SemihostedEeprom::LoadKey(uint8_t* to) {
  const uint8_t* const record = bytes_ + kKeyAddress;
  for (uint8_t i = 0; i < protocol::kAesBlock; ++i) {
    to[i] = record[i];
  }
  return !failed_ && protocol::GetU16(record + protocol::kAesBlock) ==
                         protocol::Check(record, protocol::kAesBlock);
}

}  // namespace client
}  // namespace pheromone
