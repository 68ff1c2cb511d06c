// What the images (firmware.h) and the Arduino library (arduino/facade.h) do alike at start-up. The
// Board is that of firmware.h.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "client_fw/core/requests/request_memory.h"
#include "client_fw/core/steering/settings.h"

namespace pheromone {
namespace client {

struct Place {
  void* at;
};

/// Forgets all requests; Conversation seals that. Saving the settings once more gives a number that
/// no boot has used before: the nonce.
template <class Board>
void StartCold(Board* board, const Settings& settings, RequestMemory* requests) {
  *requests = RequestMemory();
  uint8_t packed[kSettingsSize];
  PackSettings(settings, packed);
  board->save_settings(packed, sizeof(packed));
  while (!board->saved()) {
    board->EndTurn();
  }
  requests->nonce = board->saves();
}

}  // namespace client
}  // namespace pheromone

/// Constructs an object in existing memory. (There is no <new> without a C++ library.)
inline void* operator new(size_t /*size*/, pheromone::client::Place place) noexcept {
  return place.at;
}
