#include "server/robots/links/udp_link.h"

#include <netdb.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include <boost/asio/ip/udp.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "protocol/decoder.h"
#include "protocol/frame.h"
#include "protocol/frame_parser.h"
#include "protocol/opcodes.h"
#include "server/net/endpoint.h"
#include "server/robots/links/datagrams.h"
#include "server/robots/links/listening_link.h"

namespace pheromone::links {
namespace {

namespace asio = boost::asio;
using asio::ip::udp;
using boost::system::error_code;

// The size of the kernel's buffer while the engine is busy with others; the system may grant less.
constexpr int kBufferBytes = 4 << 20;
// The largest batch: others wait for the engine meanwhile.
constexpr size_t kMaxBatch = 256;
// Each datagram begins with a new decoder: no frame spans two datagrams.
const protocol::FrameDecoder kNewDecoder(protocol::kNoGapTimeout);
// After this many system calls, other links of the thread are served.
constexpr int kCallsInARow = 16;
// A robot that moves to another address does not return so soon: two robots have the same ID.
constexpr int64_t kReturnNs = 2'000'000'000;
constexpr int64_t kBetweenWarningsNs = 60'000'000'000;

// ADDRESS:PORT.
std::string TextOf(const PeerAddress& address) {
  std::array<char, INET6_ADDRSTRLEN + 16> host{};
  std::array<char, 6> port{};
  const int error = getnameinfo(reinterpret_cast<const sockaddr*>(&address.socket_address),
                                address.size, host.data(), host.size(), port.data(), port.size(),
                                NI_NUMERICHOST | NI_NUMERICSERV);
  return error != 0 ? "an unknown address"
                    : ToText(Endpoint{host.data(), static_cast<uint16_t>(std::atoi(port.data()))});
}

protocol::Message MessageOf(const protocol::FrameParser& parser) {
  constexpr size_t kHead = 2;
  constexpr size_t kCrc = 2;
  protocol::Message message;
  message.id = parser.body()[0];
  message.opcode = parser.body()[1];
  message.length = static_cast<uint8_t>(parser.size() - kHead - kCrc);
  std::copy_n(parser.body() + kHead, message.length, message.data);
  return message;
}

engine::Asker AskerAt(const PeerAddress& from, std::chrono::steady_clock::time_point now) {
  engine::Asker asker;
  asker.asked_ns = std::chrono::nanoseconds(now.time_since_epoch()).count();
  static_assert(sizeof from.socket_address == sizeof asker.address);
  std::memcpy(asker.address.data(), &from.socket_address, sizeof from.socket_address);
  asker.address_size = from.size;
  return asker;
}

PeerAddress AddressOf(const engine::Asker& asker) {
  PeerAddress address;
  std::memcpy(&address.socket_address, asker.address.data(), sizeof address.socket_address);
  address.size = asker.address_size;
  return address;
}

// Everything except the record belongs to the strand.
class UdpLink final : public ListeningLink<udp::socket> {
 public:
  UdpLink(asio::io_context& io, const LinkConfig& config, LinkContext context)
      : ListeningLink(io, config, std::move(context), "udp") {}

 private:
  void Prepare() override {
    error_code ignored;
    socket().set_option(asio::socket_base::receive_buffer_size(kBufferBytes), ignored);
    socket().set_option(asio::socket_base::send_buffer_size(kBufferBytes), ignored);
  }

  void OnListening() override {
    dropped_ = 0;
    tapped_ = NextLine();
    record()->Count([](LinkCounters& counters) { ++counters.opened; });
  }

  asio::awaitable<bool> Receive() override {
    error_code error;
    co_await socket().async_wait(udp::socket::wait_read,
                                 asio::redirect_error(asio::use_awaitable, error));
    co_return !error && TryToTakeWhatIsThere();
  }

  // False if it threw: then the bytes read are lost, and the link is down until it listens again.
  bool TryToTakeWhatIsThere() {
    try {
      TakeWhatIsThere();
      return true;
    } catch (...) {
      error_code ignored;
      socket().close(ignored);
      parser_ = {};
      batch_.clear();
      askers_.clear();
      ReportDown(InternalError(std::current_exception()));
      return false;
    }
  }

  void TakeWhatIsThere() {
    for (int i = 0; i < kCallsInARow; ++i) {
      const int count = reader_.Receive(socket().native_handle());
      if (count < 0) {
        return;  // no more datagrams, or an error about an undelivered answer
      }
      ResetBackoff();
      Take(count);
      if (count == kDatagramBatch) {  // otherwise none can have been dropped
        CountDropped();
      }
    }
  }

  void CountDropped() {
    const uint32_t dropped = DroppedBySystem(socket().native_handle());
    const uint32_t more = dropped - dropped_;
    dropped_ = dropped;
    record()->Count([more](LinkCounters& counters) { counters.dropped_datagrams += more; });
  }

  // The frames of these datagrams are one batch for the engine.
  void Take(int datagrams) {
    const Tap::Reading reading(tapped_.tap);
    const auto now = std::chrono::steady_clock::now();
    protocol::DecoderCounters received = {};
    uint64_t bytes = 0;
    uint64_t cut = 0;
    for (int i = 0; i < datagrams; ++i) {
      const Datagram datagram = reader_.at(i);
      bytes += datagram.bytes.size();
      if (datagram.cut) {
        ++cut;
        continue;
      }
      if (tapped_.tap != nullptr) {
        tapped_.tap->Read(&tapped_.line, datagram.bytes, 0, kNewDecoder);
      }
      const engine::Asker asker = AskerAt(*datagram.from, now);
      for (const uint8_t byte : datagram.bytes) {
        const protocol::FrameParser::Result event = parser_.Push(byte);
        protocol::Tally(event, &received);
        if (event == protocol::FrameParser::kFrame) {
          Note(MessageOf(parser_), *datagram.from, asker);
        }
      }
      if (!parser_.idle()) {
        protocol::TimeOut(&parser_, &received);
      }
    }
    record()->Count([&](LinkCounters& counters) {
      counters.heard = now;
      counters.received += received;
      counters.bytes_in += bytes;
      counters.datagrams_in += static_cast<uint64_t>(datagrams);
      counters.oversize_datagrams += cut;
      if (context().signing != nullptr) {
        counters.signing = context().signing->counters();
      }
    });
    HandleBatch();
  }

  void Note(protocol::Message message, const PeerAddress& from, const engine::Asker& asker) {
    if (context().signing != nullptr && !Open(&message, from, asker)) {
      return;
    }
    if (!protocol::IsFromServer(message.opcode) && Allows(message.id)) {
      Locate(message.id, from, asker.asked_ns);
    }
    batch_.push_back(message);
    askers_.push_back(asker);
    if (batch_.size() == kMaxBatch) {
      HandleBatch();
    }
  }

  void Locate(uint8_t id, const PeerAddress& from, int64_t now_ns) {
    Place* const place = &places_[id];
    if (place->last == from) {
      return;
    }
    const bool returns = place->before == from && now_ns - place->moved_ns < kReturnNs;
    if (returns && (warned_ns_ == 0 || now_ns - warned_ns_ >= kBetweenWarningsNs)) {
      warned_ns_ = now_ns;
      ReportError(
          Error{"robot " + std::to_string(id) + " speaks from " + TextOf(from) + " and from " +
                TextOf(place->last)},
          "commands to this ID reach the one heard last, the halt of all reaches both; give each "
          "robot an ID of its own");
    }
    *place = {from, place->last, now_ns};
  }

  // Answers a first HELLO by itself. True: a message for the server.
  bool Open(protocol::Message* message, const PeerAddress& from, const engine::Asker& asker) {
    const protocol::Message received = *message;
    const signing::Opened opened =
        context().signing->Open(message, std::chrono::nanoseconds(asker.asked_ns));
    if (opened == signing::Opened::kMessage) {
      return true;
    }
    if (tapped_.tap != nullptr) {
      tapped_.tap->Rejected(tapped_.line.link, received, protocol::Reason::kNone);
    }
    if (opened == signing::Opened::kGreeting) {
      SendTo(from, *message);
      Flush();
    }
    return false;
  }

  void HandleBatch() {
    if (batch_.empty()) {
      return;
    }
    answers_.clear();
    Handle(batch_, askers_, &answers_);
    batch_.clear();
    askers_.clear();
    for (const engine::Outgoing& answer : answers_) {
      Route(answer);
    }
    Flush();
  }

  void Route(const engine::Outgoing& outgoing) override {
    const protocol::Message& message = outgoing.message;
    if (!socket().is_open()) {
      CountUndeliverable(message);
    } else if (outgoing.asker.known()) {
      SendTo(AddressOf(outgoing.asker), message);
    } else if (message.id == protocol::kBroadcastId) {
      SendToAll(message);
    } else if (places_[message.id].last.known()) {
      SendTo(places_[message.id].last, message);
    } else {
      CountUndeliverable(message);
    }
  }

  // The same bytes for everybody: with a counter for each address, somebody could play to a robot
  // what was for another one, after it has obeyed its own.
  void SendToAll(const protocol::Message& message) {
    protocol::Message sealed = message;
    if (!Seal(&sealed)) {
      return;
    }
    // Robots behind one address receive it once; two with the same ID both receive it.
    std::vector<PeerAddress> told;
    for (const Place& place : places_) {
      for (const PeerAddress& address : {place.last, place.before}) {
        if (address.known() && std::ranges::find(told, address) == told.end()) {
          told.push_back(address);
          Add(sealed, address);
        }
      }
    }
  }

  void SendTo(const PeerAddress& peer, const protocol::Message& message) {
    protocol::Message sealed = message;
    if (Seal(&sealed)) {
      Add(sealed, peer);
    }
  }

  // Signs it, if the link does. Counts what cannot be signed.
  bool Seal(protocol::Message* message) {
    if (context().signing == nullptr || context().signing->Sign(message)) {
      return true;
    }
    CountUndeliverable(*message);
    return false;
  }

  void Add(const protocol::Message& sealed, const PeerAddress& peer) {
    if (writer_.full()) {
      Flush();
    }
    writer_.Add(sealed, peer);
  }

  void Flush() override {
    const auto tell = [this](std::span<const uint8_t> datagram, bool is_sent) {
      if (is_sent) {
        tapped_.tap->Wrote(tapped_.line, datagram);
        return;
      }
      protocol::FrameDecoder frame(protocol::kNoGapTimeout);
      frame.PushBlock(datagram.data(), datagram.size(), 0,
                      [this](const protocol::Message& message) { Drop(message); });
    };
    const DatagramWriter::Outcome outcome = writer_.Flush(
        socket().native_handle(), tapped_.tap != nullptr ? DatagramWriter::OnDone(tell) : nullptr);
    record()->Count([&](LinkCounters& counters) {
      counters.frames_out += outcome.frames;
      counters.bytes_out += outcome.bytes;
      counters.dropped_answers += outcome.dropped;
      counters.undeliverable += outcome.undeliverable;
    });
  }

  DatagramReader reader_;
  DatagramWriter writer_;
  protocol::FrameParser parser_;
  struct Place {
    PeerAddress last{};
    PeerAddress before{};  // another one
    int64_t moved_ns = 0;  // from it
  };
  std::array<Place, 256> places_{};  // by client ID
  int64_t warned_ns_ = 0;            // of two robots with one ID
  std::vector<protocol::Message> batch_;
  std::vector<engine::Asker> askers_;  // of the batch
  std::vector<engine::Outgoing> answers_;
  TappedLine tapped_;
  uint32_t dropped_ = 0;  // by the system, as counted so far
};

}  // namespace

std::unique_ptr<Link> MakeUdpLink(asio::io_context& io, const LinkConfig& config,
                                  LinkContext context) {
  return std::make_unique<UdpLink>(io, config, std::move(context));
}

}  // namespace pheromone::links
