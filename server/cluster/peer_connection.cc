#include "server/cluster/peer_connection.h"

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <utility>
#include <variant>

#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/socket_base.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/asio/write.hpp>

#include "server/net/endpoint.h"

namespace pheromone::cluster {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

// What is sent at once, so that a heartbeat does not wait for more than this and one frame: the
// socket's own buffer is not larger, either.
constexpr size_t kBatchBytes = size_t{32} << 10;
constexpr int kSendBufferBytes = 64 << 10;

std::string Milliseconds(std::chrono::milliseconds time) {
  return std::to_string(time.count()) + " ms";
}

std::string AddressOf(const tcp::socket& socket) {
  error_code error;
  const tcp::endpoint from = socket.remote_endpoint(error);
  return error ? "" : ToText(Endpoint{from.address().to_string(), from.port()});
}

// Of what is in the way of a text that others read.
std::string Printable(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text.substr(0, 128);
}

}  // namespace

Lane LaneOf(const PeerMessage& message) {
  if (std::holds_alternative<Heartbeat>(message)) {
    return Lane::kHeartbeat;
  }
  if (std::holds_alternative<HaltAll>(message) || std::holds_alternative<Greeting>(message)) {
    return Lane::kUrgent;
  }
  return std::holds_alternative<StatePortion>(message) ? Lane::kPortions : Lane::kNormal;
}

PeerConnection::PeerConnection(Socket socket, std::shared_ptr<const PeerTls> tls, std::string dials)
    : tls_(std::move(tls)),
      side_{.tls = tls_.get(), .dials = std::move(dials)},
      address_(AddressOf(socket)),
      stream_(std::move(socket), tls_->Make(&side_)),
      flushed_(stream_.get_executor()) {}

asio::awaitable<Status> PeerConnection::ShakeHands() {
  error_code error;
  stage_ = "TLS handshake";
  socket().set_option(tcp::no_delay(true), error);
  socket().set_option(asio::socket_base::send_buffer_size(kSendBufferBytes), error);
  error.clear();
  co_await stream_.async_handshake(
      dials() ? asio::ssl::stream_base::client : asio::ssl::stream_base::server, ErrorTo(&error));
  if (is_closed_) {
    co_return Error{why_};
  }
  if (error || !PeerTls::IsAuthenticated(stream_.native_handle())) {
    co_return Error{HandshakeError(error)};
  }
  is_secure_ = true;
  node_ = dials() ? side_.dials : side_.from;
  stage_ = "greeting";
  heard_ = Clock::now();
  co_return Ok();
}

// A stranger's words are told only if it asked for a key of this cluster's form.
std::string PeerConnection::HandshakeError(const error_code& error) const {
  std::string text = "no TLS handshake: " + (error ? error.message() : "without the secret");
  if (!dials() && !side_.identity.empty() && side_.from.empty()) {
    return text + "; found a node that dials as \"" + Printable(side_.identity) +
           "\", expected \"" + tls_->IdentityOf("NODE", tls_->node()) +
           "\" with a node before this one";
  }
  return text + "; expected a node of this cluster that has the same secret";
}

asio::awaitable<Result<PeerMessage>> PeerConnection::Receive() {
  while (!is_closed_) {
    Result<std::optional<PeerMessage>> next = frames_.Next();
    if (!next.ok()) {
      co_return next.error();
    }
    if (next.value()) {
      co_return *std::move(next.value());
    }
    error_code error;
    const size_t size = co_await stream_.async_read_some(asio::buffer(input_), ErrorTo(&error));
    if (!error) {
      heard_ = Clock::now();
      frames_.Add(std::string_view(input_.data(), size));
    } else if (!is_closed_) {
      const bool is_end = error == asio::error::eof || error == asio::ssl::error::stream_truncated;
      co_return Error{is_end ? "the other side has closed the connection" : error.message()};
    }
  }
  co_return Error{why_};
}

bool PeerConnection::Send(std::string frame, Lane lane) {
  if (is_closed_ || (lane == Lane::kPortions && portions_.size() >= Peers::kMaxPortions)) {
    return false;
  }
  if (queued_bytes_ + frame.size() > Peers::kMaxQueuedBytes) {
    Close("the other side does not read: " + std::to_string(queued_bytes_) +
          " bytes wait to be sent");
    return false;
  }
  queued_bytes_ += frame.size();
  switch (lane) {
    case Lane::kHeartbeat:
      queued_bytes_ -= beat_ ? beat_->size() : 0;
      beat_ = std::move(frame);
      break;
    case Lane::kUrgent:
      urgent_.push_back(std::move(frame));
      break;
    case Lane::kNormal:
      normal_.push_back(std::move(frame));
      break;
    case Lane::kPortions:
      portions_.push_back(std::move(frame));
      break;
  }
  WriteNext();
  return true;
}

void PeerConnection::WriteNext() {
  if (is_writing_ || is_closed_) {
    return;
  }
  output_.clear();
  if (beat_) {
    output_ += *beat_;
    beat_.reset();
  }
  Gather(&urgent_, SIZE_MAX, SIZE_MAX);
  Gather(&normal_, kBatchBytes, SIZE_MAX);
  Gather(&portions_, kBatchBytes, 1);  // none while others wait: they have filled the output
  if (output_.empty()) {
    flushed_.cancel();
    return;
  }
  is_writing_ = true;
  write_began_ = Clock::now();
  asio::async_write(stream_, asio::buffer(output_),
                    [self = shared_from_this()](const error_code& error, size_t /*size*/) {
                      self->is_writing_ = false;
                      self->queued_bytes_ -= self->output_.size();
                      if (error) {
                        self->Close("cannot send: " + error.message());
                      }
                      self->WriteNext();
                    });
}

// Moves frames to the output, while that has fewer bytes.
void PeerConnection::Gather(std::deque<std::string>* lane, size_t bytes, size_t most_frames) {
  for (; !lane->empty() && output_.size() < bytes && most_frames > 0; --most_frames) {
    output_ += lane->front();
    lane->pop_front();
  }
}

asio::awaitable<void> PeerConnection::Flush() {
  while (is_writing_ && !is_closed_) {
    error_code ignored;
    flushed_.expires_at(Clock::time_point::max());
    co_await flushed_.async_wait(ErrorTo(&ignored));
  }
  error_code ignored;
  socket().shutdown(tcp::socket::shutdown_send, ignored);
}

void PeerConnection::Close(const std::string& why) {
  if (is_closed_) {
    return;
  }
  error_code ignored;
  is_closed_ = true;
  why_ = why;
  socket().close(ignored);
  flushed_.cancel();
}

void PeerConnection::SetUp() {
  is_up_ = true;
  heard_ = Clock::now();
}

void PeerConnection::CheckTimes(Clock::time_point now, const PeerTimes& times) {
  if (!is_up_ && now - began_ >= times.open) {
    Close("no " + stage_ + " within " + Milliseconds(times.open));
  } else if (is_up_ && now - heard_ >= times.silence) {
    Close("silent for " + Milliseconds(times.silence));
  } else if (is_up_ && is_writing_ && now - write_began_ >= times.stuck) {
    Close("the other side does not read: nothing can be sent for " + Milliseconds(times.stuck));
  }
}

}  // namespace pheromone::cluster
