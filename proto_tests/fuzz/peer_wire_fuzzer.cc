// Any bytes as what a peer sends: the first byte is how many arrive at once, less one. Each message
// is written back as the same bytes, for there is one way to write it, except a greeting of another
// version, of which only a part is read; what is wrong has words.

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

#include "proto_tests/fuzz/require.h"
#include "server/cluster/peer_wire.h"

namespace {

using namespace pheromone::cluster;  // NOLINT(google-build-using-namespace)
using pheromone::fuzz::Require;

// Whether the rest of the stream is where its bytes end.
bool IsWhole(const PeerMessage& message, std::string_view* stream) {
  if (const auto* greeting = std::get_if<Greeting>(&message)) {
    const bool is_accepted = CheckGreeting({.node = "a"}, *greeting).ok();
    if (greeting->versions.peers != kPeerVersion) {
      Require(!is_accepted);
      return false;
    }
  }
  const auto frame = EncodePeerMessage(message);
  Require(frame.ok() && stream->starts_with(frame.value()));
  stream->remove_prefix(frame.value().size());
  return true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) {
    return 0;
  }
  const size_t at_once = size_t{1} + data[0];
  std::string_view stream(reinterpret_cast<const char*>(data) + 1, size - 1);
  std::string_view rest = stream;
  PeerFrames frames;
  for (size_t at = 0; at < stream.size(); at += at_once) {
    frames.Add(stream.substr(at, at_once));
    for (auto next = frames.Next(); !next.ok() || next.value(); next = frames.Next()) {
      if (!next.ok()) {
        Require(!next.error().empty());
        return 0;
      }
      if (!IsWhole(*next.value(), &rest)) {
        return 0;
      }
    }
  }
  return 0;
}
