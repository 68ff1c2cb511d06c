#include "server/operators/web/stream/viewer.h"

#include <algorithm>
#include <utility>

#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/http/field.hpp>

#include "server/operators/control/json_text.h"

namespace pheromone::web {
namespace {

namespace asio = boost::asio;
namespace websocket = boost::beast::websocket;
using boost::beast::error_code;

constexpr int kSendBufferBytes = 1 << 19;
constexpr std::chrono::seconds kHandshakePatience{10};
constexpr std::chrono::seconds kIdlePatience{60};
constexpr uint8_t kMessageOp = 1;
constexpr uint8_t kTimeOp = 2;

}  // namespace

Viewer::Viewer(Connection connection, Place place, Parts parts, std::string refusal,
               std::string warning, uint64_t now_ms)
    : socket_(std::move(connection)),
      place_(std::move(place)),
      parts_(std::move(parts)),
      refusal_(std::move(refusal)),
      warning_(std::move(warning)),
      now_ms_(now_ms) {
  ++parts_.counters->viewers;
}

void Viewer::Start(const boost::beast::http::request<boost::beast::http::string_body>& request,
                   const std::string& subprotocol) {
  // What is in the buffer is old when a slow viewer gets it, and costs memory.
  socket_.next_layer().next_layer().SetSendBuffer(kSendBufferBytes);
  socket_.set_option(websocket::stream_base::timeout{kHandshakePatience, kIdlePatience, true});
  socket_.set_option(
      websocket::stream_base::decorator([subprotocol](websocket::response_type& response) {
        response.set(boost::beast::http::field::sec_websocket_protocol, subprotocol);
        response.set(boost::beast::http::field::server, "pheromoned");
      }));
  socket_.read_message_max(kMaxInboundBytes);
  socket_.auto_fragment(false);  // a frame is written from where it is, not copied
  socket_.async_accept(request, [self = shared_from_this()](error_code error) {
    if (error) {
      self->Close();
      return;
    }
    self->is_open_ = true;
    ++self->parts_.counters->accepted;
  });
}

void Viewer::Close() {
  if (is_closed_) {
    return;
  }
  is_closed_ = true;
  is_open_ = false;
  --parts_.counters->viewers;
  for (const auto& [subscription, slot] : slots_) {
    parts_.hub->RemoveSubscriber(slot.channel);
  }
  slots_.clear();
  answers_.clear();
  socket_.next_layer().Close();
  parts_.leave(shared_from_this());
}

void Viewer::CloseWithServer() {
  place_.OnStop([weak = weak_from_this(), executor = socket_.get_executor()] {
    asio::post(executor, [weak] {
      if (const auto self = weak.lock()) {
        self->Close();
      }
    });
  });
}

void Viewer::Greet(const std::shared_ptr<const Catalogue>& catalogue) {
  conversation_ = std::make_unique<Conversation>(catalogue, refusal_);
  for (StreamMessage& message : conversation_->Greet()) {
    Send(std::move(message));
  }
  if (!warning_.empty()) {
    Send({ToText(boost::json::object{{"op", "status"}, {"level", 1}, {"message", warning_}}),
          false});
  }
  Read();
}

void Viewer::ChangeCatalogue(const std::shared_ptr<const Catalogue>& catalogue) {
  if (conversation_ != nullptr && !is_closed_) {
    Apply(conversation_->Change(catalogue));
  }
}

// Not while it has more to answer for than it reads, nor faster than is permitted.
bool Viewer::MayRead() const {
  return !is_closed_ && !is_reading_ && conversation_ != nullptr && messages_left_ > 0 &&
         answers_.size() < kMaxAnswers && answer_bytes_ < kMaxAnswerBytes && changes_ < kMaxChanges;
}

void Viewer::Read() {
  if (!MayRead()) {
    return;
  }
  is_reading_ = true;
  socket_.async_read(heard_, [self = shared_from_this()](error_code error, size_t /*bytes*/) {
    self->is_reading_ = false;
    if (error || self->is_closed_) {
      self->Close();
      return;
    }
    self->HandleMessage();
    self->Read();
  });
}

void Viewer::HandleMessage() {
  --messages_left_;
  const auto bytes = heard_.data();
  Apply(conversation_->Hear({static_cast<const char*>(bytes.data()), bytes.size()},
                            socket_.got_binary()));
  heard_.consume(heard_.size());
}

void Viewer::Apply(Heard heard) {
  for (const uint32_t subscription : heard.unsubscribed) {
    if (const auto found = slots_.find(subscription); found != slots_.end()) {
      parts_.hub->RemoveSubscriber(found->second.channel);
      slots_.erase(found);
    }
  }
  for (const auto& [subscription, channel] : heard.subscribed) {
    Slot& slot = slots_[subscription];
    slot.channel = channel;
    slot.keeping = parts_.hub->KeepingOf(channel);
    slot.is_picture = parts_.hub->IsPicture(channel);
    if (slot.keeping == Keeping::kAll) {
      for (const FramePtr& frame : parts_.hub->RecentEvents()) {
        slot.all.push_back(frame);
      }
    }
    parts_.hub->AddSubscriber(channel);
  }
  for (StreamMessage& answer : heard.answers) {
    Send(std::move(answer));
  }
  if (heard.playback && parts_.play) {
    parts_.play(*std::move(heard.playback));
  }
  for (StreamChange& change : heard.changes) {
    ++changes_;
    const StreamChange kept = {.target = {},
                               .body = {},
                               .name = change.name,
                               .is_call = change.is_call,
                               .service = change.service,
                               .call = change.call,
                               .parameter = change.parameter,
                               .request_id = change.request_id};
    parts_.change(std::move(change), [weak = weak_from_this(), kept](const Response& response) {
      const auto self = weak.lock();
      if (self != nullptr && !self->is_closed_) {
        --self->changes_;
        if (Conversation::NeedsAnswer(kept, response)) {
          self->Send(self->conversation_->Answer(kept, response));
        }
        self->Read();
      }
    });
  }
  Pump();
}

void Viewer::Send(StreamMessage message) {
  answer_bytes_ += message.bytes.size();
  answers_.push_back(std::move(message));
  Pump();
}

void Viewer::Offer(const Update& update, uint64_t now_ms) {
  now_ms_ = now_ms;
  for (auto& [subscription, slot] : slots_) {
    if (slot.channel != update.channel) {
      continue;
    }
    switch (slot.keeping) {
      case Keeping::kTiles:
        parts_.counters->dropped_frames += slot.has_tiles ? 1 : 0;
        slot.has_tiles = true;
        break;
      case Keeping::kLatest:
        parts_.counters->dropped_frames += slot.latest != nullptr ? 1 : 0;
        slot.latest = update.frame;
        break;
      case Keeping::kAll:
        slot.all.push_back(update.frame);
        if (slot.all.size() > kMaxEvents) {
          slot.all.pop_front();
          ++slot.lost;
          ++parts_.counters->dropped_frames;
        }
    }
    Pump();
  }
}

void Viewer::Tick(uint64_t now_ms, uint64_t unix_ns, bool more_follows) {
  now_ms_ = now_ms;
  unix_ns_ = unix_ns;
  if (is_closed_) {
    return;
  }
  if (is_writing_ && now_ms > write_began_ms_ &&
      now_ms - write_began_ms_ > static_cast<uint64_t>(parts_.write_patience.count())) {
    ++parts_.counters->stalled;
    Close();
    return;
  }
  messages_left_ = std::min(messages_left_ + kMessagesPerTick, kMaxMessages);
  if (conversation_ != nullptr) {
    time_ns_ = unix_ns;
    Read();
    if (!more_follows) {
      Pump();
    }
  }
}

// Answers first; then the time and the channels, in turn.
void Viewer::Pump() {
  if (is_writing_ || is_closed_ || conversation_ == nullptr) {
    return;
  }
  if (!answers_.empty()) {
    writing_answer_ = std::move(answers_.front());
    answers_.pop_front();
    answer_bytes_ -= writing_answer_.bytes.size();
    Write(std::array{asio::const_buffer(asio::buffer(writing_answer_.bytes))},
          writing_answer_.is_binary);
    return;
  }
  if (time_ns_ != 0) {
    MakeHeader(kTimeOp, std::nullopt, std::exchange(time_ns_, 0));
    Write(std::array{asio::const_buffer(header_.data(), header_size_)}, true);
    return;
  }
  auto slot = slots_.upper_bound(turn_);
  for (size_t i = 0; i < slots_.size(); ++i, ++slot) {
    if (slot == slots_.end()) {
      slot = slots_.begin();
    }
    if (PumpSlot(slot->first, &slot->second)) {
      turn_ = slot->first;
      return;
    }
  }
}

// Whether something of it is being sent now.
bool Viewer::PumpSlot(uint32_t subscription, Slot* slot) {
  if (slot->is_picture && (slot->latest != nullptr || slot->has_tiles)) {
    if (now_ms_ < slot->next_ms) {
      return false;
    }
    // A little less, so that a tick that is early does not halve the rate.
    slot->next_ms = now_ms_ + static_cast<uint64_t>(900 / conversation_->grid_hz());
  }
  if (slot->has_tiles) {
    slot->has_tiles = false;
    Hub::Tiles tiles = parts_.hub->TilesSince(slot->channel, slot->since, unix_ns_);
    slot->since = tiles.version;
    if (tiles.frame != nullptr) {
      WriteFrame(subscription, std::move(tiles.frame));
      return true;
    }
  }
  if (slot->latest != nullptr) {
    WriteFrame(subscription, std::exchange(slot->latest, nullptr));
    return true;
  }
  if (!slot->all.empty()) {
    if (slot->lost != 0) {
      const std::string text = std::to_string(std::exchange(slot->lost, 0)) +
                               " events were dropped, since this viewer was too slow";
      answers_.push_back(
          {ToText(boost::json::object{{"op", "status"}, {"level", 1}, {"message", text}}), false});
      answer_bytes_ += answers_.back().bytes.size();
    }
    FramePtr frame = std::move(slot->all.front());
    slot->all.pop_front();
    WriteFrame(subscription, std::move(frame));
    return true;
  }
  return false;
}

void Viewer::MakeHeader(uint8_t op, std::optional<uint32_t> subscription, uint64_t time_ns) {
  header_size_ = 0;
  const auto put = [this](uint64_t value, size_t bytes) {
    for (size_t i = 0; i < bytes; ++i) {
      header_[header_size_++] = static_cast<char>(value >> (8 * i));
    }
  };
  put(op, 1);
  if (subscription) {
    put(*subscription, 4);
  }
  put(time_ns, 8);
}

void Viewer::WriteFrame(uint32_t subscription, FramePtr frame) {
  writing_frame_ = std::move(frame);
  MakeHeader(kMessageOp, subscription, writing_frame_->time_ns);
  ++parts_.counters->sent_frames;
  Write(std::array{asio::const_buffer(header_.data(), header_size_),
                   asio::const_buffer(asio::buffer(writing_frame_->payload))},
        true);
}

template <typename Buffers>
void Viewer::Write(const Buffers& buffers, bool is_binary) {
  is_writing_ = true;
  write_began_ms_ = now_ms_;
  parts_.counters->sent_bytes += asio::buffer_size(buffers);
  socket_.binary(is_binary);
  socket_.async_write(buffers, [self = shared_from_this()](error_code error, size_t /*bytes*/) {
    self->is_writing_ = false;
    self->writing_frame_ = nullptr;
    self->writing_answer_ = {};
    if (error || self->is_closed_) {
      self->Close();
      return;
    }
    self->Pump();
    self->Read();  // fewer answers wait than before
  });
}

}  // namespace pheromone::web
