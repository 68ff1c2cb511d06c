// The conversation with one viewer in Foxglove's WebSocket protocol, version 1, without a socket:
// messages go in, and messages and requests come out.
//
//   Conversation conversation(catalogue, may_change);
//   for (const std::string& text : conversation.Greet()) { send }
//   const Heard heard = conversation.Hear(bytes, is_binary);
//   ... send heard.texts, add and remove heard.subscribed and heard.unsubscribed,
//   ... hand heard.changes to the API, and send conversation.Answer(change, response)
//
// Everything that a viewer sends may be wrong: it is answered with a status, and nothing happens.
// Changes are requests to the HTTP API (POST /api/v1/...), with the same bodies and the same
// errors; without the right to change anything, each is answered with an error.
//
// One thread at a time.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <boost/json/object.hpp>

#include "server/operators/web/http.h"
#include "server/operators/web/stream/catalogue.h"
#include "server/operators/web/stream/playback_messages.h"

namespace pheromone::web {

constexpr std::string_view kSubprotocols[] = {"foxglove.websocket.v1", "foxglove.sdk.v1"};
constexpr size_t kMaxInboundBytes = size_t{64} << 10;

/// The subprotocol to be used, of those in a header Sec-WebSocket-Protocol; empty: none is known.
std::string_view ChooseSubprotocol(std::string_view header);

/// A request to the API.
struct StreamChange {
  std::string target;  ///< "/api/v1/erase"
  std::string body;
  std::string name;  ///< of the service or topic
  bool is_call = false;
  uint32_t service = 0;  ///< of a call
  uint32_t call = 0;
  std::string parameter = {};  ///< its name, if the change is that of a parameter
  std::string request_id = {};
};

struct StreamMessage {
  std::string bytes;
  bool is_binary = false;
};

/// What became of a message.
struct Heard {
  std::vector<StreamMessage> answers;
  std::vector<std::pair<uint32_t, uint32_t>> subscribed;  ///< subscription and channel
  std::vector<uint32_t> unsubscribed;                     ///< subscriptions
  std::vector<StreamChange> changes;
  std::optional<PlaybackRequest> playback;  ///< of a recording
  size_t complaints = 0;                    ///< of which the first kMaxComplaints are answers
};

class Conversation {
 public:
  static constexpr size_t kMaxSubscriptions = 256;
  static constexpr size_t kMaxClientChannels = 16;
  static constexpr size_t kMaxComplaints = 8;  ///< about one message; then they are counted
  static constexpr size_t kMaxChanges = 16;    ///< by one message
  static constexpr double kDefaultGridHz = 5;

  /// `refusal` is why the viewer may not change anything; empty: it may.
  Conversation(std::shared_ptr<const Catalogue> catalogue, std::string refusal)
      : catalogue_(std::move(catalogue)), refusal_(std::move(refusal)) {}

  std::vector<StreamMessage> Greet() const;
  Heard Hear(std::string_view message, bool is_binary);
  StreamMessage Answer(const StreamChange& change, const Response& response) const;

  /// Whether anything is to be sent in answer: what was published is only reported if it failed.
  static bool NeedsAnswer(const StreamChange& change, const Response& response) {
    return change.is_call || !change.parameter.empty() || response.status != 200;
  }

  /// Another catalogue: subscriptions of channels that are gone end.
  Heard Change(std::shared_ptr<const Catalogue> catalogue);

  /// How often the viewer wants pictures of the map, at most.
  double grid_hz() const { return grid_hz_; }

 private:
  void HearText(std::string_view text, Heard* heard);
  void HearBinary(std::string_view bytes, Heard* heard);
  void Subscribe(const boost::json::object& message, Heard* heard);
  void Unsubscribe(const boost::json::object& message, Heard* heard);
  void Advertise(const boost::json::object& message, Heard* heard);
  void Unadvertise(const boost::json::object& message, Heard* heard);
  void GetParameters(const boost::json::object& message, Heard* heard) const;
  void SetParameters(const boost::json::object& message, Heard* heard);
  void WatchParameters(const boost::json::object& message, bool watch, Heard* heard);
  void Publish(uint32_t channel, std::string_view payload, Heard* heard);
  void Call(std::string_view bytes, Heard* heard);
  void Play(std::string_view bytes, Heard* heard) const;
  const Channel* FindChannel(uint32_t id) const;
  std::optional<boost::json::value> ValueOf(const std::string& parameter) const;
  static StreamMessage ParameterChanged(const StreamChange& change, const Response& response);
  StreamMessage ParameterValues(const std::vector<std::string>& names,
                                const boost::json::value* id) const;

  std::shared_ptr<const Catalogue> catalogue_;
  const std::string refusal_;
  std::map<uint32_t, uint32_t> subscriptions_;     // channel by subscription
  std::map<uint32_t, std::string> client_topics_;  // by the viewer's channel
  std::set<std::string> watched_;                  // parameters
  double grid_hz_ = kDefaultGridHz;
};

}  // namespace pheromone::web
