// A robot's nonvolatile state: a number that changes with every start, and the settings changed
// over the radio. In any memory whose bytes can be written one at a time, such as an EEPROM.
//
//   Nonvolatile<Eeprom, sizeof(settings)> nonvolatile;
//   nonvolatile.Load(settings);            // false, and settings as they were, if none are there
//   nonvolatile.Save(settings);            // after a cold start: a new version, which is
//   while (!nonvolatile.saved()) {         // another nonce once it is stored
//     nonvolatile.Step();
//   }
//   nonce = nonvolatile.version();
//   ...
//   nonvolatile.Save(settings);            // begins, and returns at once
//   nonvolatile.Step();                    // each turn of the loop: writes a byte
//
// A record is version (u16), payload, complement of the CRC-16 of both. Version v goes to slot v
// mod 4, so the newest record is never the one being overwritten: after a loss of power at any
// moment the old or the new one is found (a half-written one is accepted with probability 1/65 536,
// that of the CRC). Bytes that are already correct are not written. Cells good for 100 000 writes
// are good for 400 000 starts and changes, as four slots share the wear. Versions repeat after 65
// 536 of both.
//
// Storage, all static:
//   uint8_t Read(uint8_t at);               may wait for a write to end
//   bool Ready();                           no write is in progress
//   void Write(uint8_t at, uint8_t value);  starts one; only when Ready
//
// One loop; not for interrupts. C++11 without its library.
#pragma once

#include <stdint.h>

#include "protocol/crc16.h"

namespace pheromone {
namespace client {

template <class Storage, uint8_t kPayloadSize>
class Nonvolatile {
 public:
  /// To be called first, once: finds the newest record, and its payload if there is one.
  bool Load(uint8_t* to) {
    bool found = false;
    for (uint8_t slot = 0; slot < kSlots; ++slot) {
      Record candidate = {};
      uint8_t* const bytes = reinterpret_cast<uint8_t*>(&candidate);
      for (uint8_t i = 0; i < kRecordSize; ++i) {
        bytes[i] = Storage::Read(At(slot, i));
      }
      if (candidate.check == CheckOf(candidate) &&
          (!found || static_cast<int16_t>(candidate.version - record_.version) > 0)) {
        found = true;
        record_ = candidate;
        for (uint8_t i = 0; i < kPayloadSize; ++i) {
          to[i] = candidate.payload[i];
        }
      }
    }
    return found;
  }

  /// If Load has found nothing: the version before the first one, which is 0 otherwise.
  void BeginBehind(uint16_t version) { record_.version = version; }

  /// Copies the payload and begins to write it; a write in progress is abandoned.
  void Save(const uint8_t* from) {
    if (left_ == 0) {
      ++record_.version;  // otherwise this version's slot is already invalid, and no other may be
                          // touched
    }
    for (uint8_t i = 0; i < kPayloadSize; ++i) {
      record_.payload[i] = from[i];
    }
    record_.check = CheckOf(record_);
    left_ = kRecordSize;
  }

  /// Writes the next byte, if the storage is ready.
  void Step() {
    if (left_ != 0 && Storage::Ready()) {
      --left_;
      const uint8_t at = At(record_.version & (kSlots - 1), left_);
      const uint8_t byte = reinterpret_cast<const uint8_t*>(&record_)[left_];
      if (Storage::Read(at) != byte) {
        Storage::Write(at, byte);
      }
    }
  }

  /// Whether there is nothing left to write, and the last write has ended.
  bool saved() const { return left_ == 0 && Storage::Ready(); }

  /// Of the newest record; while one is being written, its version.
  uint16_t version() const { return record_.version; }

 private:
  // In the layout of the chip, which is the only reader.
  struct Record {
    uint16_t version;
    uint8_t payload[kPayloadSize];
    uint16_t check;
  };
  static constexpr uint8_t kSlots = 4;
  static constexpr uint8_t kRecordSize = kPayloadSize + 4;
  static_assert(sizeof(Record) == kRecordSize, "the payload's size has to be even");
  static_assert(kRecordSize <= 252 / kSlots, "the payload is too large");

  static uint8_t At(uint8_t slot, uint8_t offset) {
    return static_cast<uint8_t>(slot * kRecordSize + offset);
  }

  static uint16_t CheckOf(const Record& record) {
    return protocol::Check(&record, kRecordSize - 2);
  }

  Record record_ = {};
  uint8_t left_ = 0;  // bytes of record_ still to be written, the first ones
};

}  // namespace client
}  // namespace pheromone
