// What viewers send: any sequence of text and binary messages. Each message is a byte, of which bit
// 0 says that it is binary, its length in two bytes, and itself; bit 3 of the first one says that a
// recording is replayed. Nothing may be changed without the right to it, and what a viewer makes
// the server keep is bounded.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "proto_tests/fuzz/require.h"
#include "server/operators/web/stream/conversation.h"

namespace {

using pheromone::fuzz::Require;
using namespace pheromone::web;  // NOLINT(google-build-using-namespace)
namespace playback = pheromone::playback;

std::shared_ptr<const Catalogue> MakeCatalogue(bool other, bool replays) {
  auto catalogue = std::make_shared<Catalogue>();
  catalogue->click_pheromone = "trail";
  if (replays) {
    catalogue->recording = {"lab.pcapng", 1, 2};
  }
  catalogue->channels = {
      {1, "/robots", "protobuf", "foxglove.SceneUpdate", "", "protobuf"},
      {other ? 3u : 2u, "/status", "json", "pheromone.status", "", "jsonschema"}};
  catalogue->parameters = {{"/pheromone/trail/tau_s", other ? 60.0 : 30.0}};
  return catalogue;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  std::string_view input(reinterpret_cast<const char*>(data), size);
  const bool may_change = !input.empty() && (input[0] & 2) != 0;
  const bool replays = !input.empty() && (input[0] & 8) != 0;
  Conversation conversation(MakeCatalogue(false, replays), may_change ? "" : "not permitted");
  size_t subscriptions = 0;
  size_t ended = 0;
  constexpr size_t kHeader = 3;
  while (input.size() >= kHeader) {
    const bool is_binary = (input[0] & 1) != 0;
    const bool reconfigure = (input[0] & 4) != 0;
    const size_t length =
        static_cast<unsigned char>(input[1]) | size_t{static_cast<unsigned char>(input[2])} << 8;
    input.remove_prefix(kHeader);
    const std::string_view message = input.substr(0, length);
    input.remove_prefix(message.size());
    if (reconfigure) {
      ended += conversation.Change(MakeCatalogue(length % 2 != 0, replays)).unsubscribed.size();
    }
    const Heard heard = conversation.Hear(message, is_binary);
    Require(may_change || heard.changes.empty());
    Require(heard.changes.size() <= Conversation::kMaxChanges);
    Require(heard.complaints == 0 || !heard.answers.empty());
    Require(heard.answers.size() <= Conversation::kMaxComplaints + 3);
    if (heard.playback) {
      const playback::Request& request = heard.playback->request;
      Require(replays && heard.playback->id.size() <= kMaxPlaybackId);
      Require(request.speed >= playback::kMinSpeed && request.speed <= playback::kMaxSpeed);
    }
    subscriptions += heard.subscribed.size();
    ended += heard.unsubscribed.size();
    Require(subscriptions - ended <= 2);  // each of two channels once
    for (const StreamChange& change : heard.changes) {
      Require(change.target.starts_with("/api/v1/"));
      conversation.Answer(change, {.body = change.body});
      conversation.Answer(change, {.status = 400, .body = change.body});
    }
  }
  return 0;
}
