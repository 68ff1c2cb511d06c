// One viewer's connection: a WebSocket, and what waits to be sent to it. Internal to this folder.
//
// A viewer never has more than one write under way. Of each channel it keeps the latest frame only,
// shared with all other viewers; of events the last kMaxEvents; and answers to what it sent, for
// which it is not read while many of them wait. Small messages are sent together
// (gathering_socket.h). So a viewer that does not read costs a frame per channel, two buffers of
// GatheringSocket::kMaxKept and that of its socket, and is disconnected when a write takes longer
// than `write_patience`.
//
// Everything runs on the stream's thread.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket/stream.hpp>

#include "server/operators/control/stream_counters.h"
#include "server/operators/web/stream/conversation.h"
#include "server/operators/web/stream/gathering_socket.h"
#include "server/operators/web/stream/hub.h"
#include "server/operators/web/upgrade.h"

namespace pheromone::web {

class Viewer : public std::enable_shared_from_this<Viewer> {
 public:
  static constexpr size_t kMaxEvents = 256;
  static constexpr size_t kMaxAnswers = 64;
  static constexpr size_t kMaxAnswerBytes = size_t{1} << 20;
  static constexpr size_t kMaxChanges = 16;  // under way
  static constexpr int kMessagesPerTick = 20;
  static constexpr int kMaxMessages = 100;  // that may be saved up

  struct Parts {
    Hub* hub = nullptr;
    StreamCounters* counters = nullptr;
    std::function<void(StreamChange, Respond)> change;  ///< `respond` on the stream's thread
    std::function<void(const std::shared_ptr<Viewer>&)> leave;
    std::chrono::milliseconds write_patience{30'000};
    std::function<void(PlaybackRequest)> play = {};  ///< of a recording; null: there is none
  };

  /// From `now_ms` on its time is what Offer and Tick say.
  Viewer(Connection connection, Place place, Parts parts, std::string refusal, std::string warning,
         uint64_t now_ms);

  /// Performs the handshake, and then reads.
  void Start(const boost::beast::http::request<boost::beast::http::string_body>& request,
             const std::string& subprotocol);
  void Close();
  /// Closes it on its thread when the server stops.
  void CloseWithServer();

  /// Once the handshake is done and there is a catalogue.
  void Greet(const std::shared_ptr<const Catalogue>& catalogue);
  bool awaits_greeting() const { return is_open_ && conversation_ == nullptr; }
  void ChangeCatalogue(const std::shared_ptr<const Catalogue>& catalogue);
  /// Once it was greeted: a message besides those of the channels.
  void Send(StreamMessage message);

  /// A frame of a channel, or null of tiles, if it has subscribed to that.
  void Offer(const Update& update, uint64_t now_ms);
  /// About ten times a second. What it has to send is sent at once, or with what will be offered
  /// soon, if `more_follows`.
  void Tick(uint64_t now_ms, uint64_t unix_ns, bool more_follows);
  /// Sends what waits, unless something is being sent.
  void Pump();

 private:
  struct Slot {
    uint32_t channel = 0;
    Keeping keeping = Keeping::kLatest;
    bool is_picture = false;
    FramePtr latest;
    std::deque<FramePtr> all;
    uint64_t lost = 0;       // of all, since it was last told
    bool has_tiles = false;  // that it did not get
    uint64_t since = 0;      // the version of the tiles that it has
    uint64_t next_ms = 0;    // for its own rate of pictures
  };

  void Read();
  void HandleMessage();
  void Apply(Heard heard);
  bool PumpSlot(uint32_t subscription, Slot* slot);
  template <typename Buffers>
  void Write(const Buffers& buffers, bool is_binary);
  void WriteFrame(uint32_t subscription, FramePtr frame);
  void MakeHeader(uint8_t op, std::optional<uint32_t> subscription, uint64_t time_ns);
  bool MayRead() const;

  boost::beast::websocket::stream<GatheringSocket, false> socket_;
  Place place_;
  const Parts parts_;
  const std::string refusal_;
  const std::string warning_;
  std::unique_ptr<Conversation> conversation_;
  bool is_open_ = false;
  bool is_closed_ = false;
  bool is_reading_ = false;
  bool is_writing_ = false;
  uint64_t write_began_ms_ = 0;
  uint64_t now_ms_;
  uint64_t unix_ns_ = 0;
  uint64_t time_ns_ = 0;  // to be sent; 0: nothing
  int messages_left_ = kMaxMessages;
  size_t changes_ = 0;
  boost::beast::flat_buffer heard_{kMaxInboundBytes};
  std::deque<StreamMessage> answers_;
  size_t answer_bytes_ = 0;
  std::map<uint32_t, Slot> slots_;  // by subscription
  uint32_t turn_ = 0;               // the subscription from which the next frame is taken
  std::array<char, 13> header_{};
  size_t header_size_ = 0;
  FramePtr writing_frame_;
  StreamMessage writing_answer_;
};

}  // namespace pheromone::web
