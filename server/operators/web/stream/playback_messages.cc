#include "server/operators/web/stream/playback_messages.h"

#include <bit>

#include "server/base/bytes.h"

namespace pheromone::web {

std::variant<PlaybackRequest, std::string> ParsePlaybackRequest(std::string_view bytes) {
  ByteReader reader(bytes);
  const uint8_t command = reader.U8();
  const auto speed = std::bit_cast<float>(reader.U32());
  const bool seeks = reader.U8() != 0;
  const uint64_t time_ns = reader.U64();
  const uint32_t length = reader.U32();
  constexpr size_t kHeader = 18;
  if (!reader.ok() || length > bytes.size() - kHeader) {
    return "truncated playback request";
  }
  if (command > 1) {
    return "playback: found command " + std::to_string(command) +
           ", expected 0 (play) or 1 (pause)";
  }
  if (!(speed >= playback::kMinSpeed && speed <= playback::kMaxSpeed)) {
    return "playback: found speed " + std::to_string(speed) + ", expected 0.01 to 1000";
  }
  if (length > kMaxPlaybackId) {
    return "playback: an ID of " + std::to_string(length) + " bytes, expected at most " +
           std::to_string(kMaxPlaybackId);
  }
  PlaybackRequest parsed;
  parsed.request.play = command == 0;
  parsed.request.speed = speed;
  if (seeks) {
    parsed.request.seek_ns = time_ns;
  }
  parsed.id = bytes.substr(kHeader, length);
  return parsed;
}

std::string EncodePlaybackState(const playback::State& state, std::string_view id) {
  ByteWriter writer;
  writer.U8(kPlaybackStateOp);
  writer.U8(static_cast<uint8_t>(state.phase));
  writer.U64(state.time_ns);
  writer.U32(std::bit_cast<uint32_t>(state.speed));
  writer.Flag(state.did_seek);
  writer.Text(id);
  return writer.Take();
}

}  // namespace pheromone::web
