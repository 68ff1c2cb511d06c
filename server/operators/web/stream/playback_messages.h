// The messages by which viewers control the playback of a recording: the capability
// "playbackControl" of Foxglove's protocol. Little-endian, without padding:
//
//   request (client, op 3): u8 op, u8 command: 0 play, 1 pause, f32 speed, u8 whether it seeks, u64
//   time in ns, u32 length of its ID, ID
//   state (server, op 5): u8 op, u8 status: 0 playing, 1 paused, 2 buffering, 3 ended, u64 time in
//   ns, f32 speed, u8 whether it has sought, u32 length of the request's ID or 0, ID
//
// Values; any thread.
#pragma once

#include <string>
#include <string_view>
#include <variant>

#include "server/operators/playback/playback.h"

namespace pheromone::web {

constexpr uint8_t kPlaybackRequestOp = 3;
constexpr uint8_t kPlaybackStateOp = 5;
constexpr size_t kMaxPlaybackId = 256;

struct PlaybackRequest {
  playback::Request request;
  std::string id;  ///< of the answer
};

/// `bytes` begin after the op. Otherwise what is wrong with them.
std::variant<PlaybackRequest, std::string> ParsePlaybackRequest(std::string_view bytes);

/// `id` is that of the request that it answers; empty: it has changed by itself.
std::string EncodePlaybackState(const playback::State& state, std::string_view id);

}  // namespace pheromone::web
