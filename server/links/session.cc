#include "server/links/session.h"

#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>
#include <variant>

#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>

#include "protocol/messages.h"

namespace pheromone::links {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

// How often the carrier is checked while something waits to be sent.
constexpr std::chrono::milliseconds kBetweenLooks{1};

// Whether a reported end of the line is real. A kernel may report the end for a terminal that is
// merely idle: Linux 6.18 once in some thousand reads on a busy machine, and any kernel if VMIN is
// 0.
bool IsHungUp(int descriptor) {
  pollfd line = {descriptor, POLLRDHUP, 0};
  return poll(&line, 1, 0) < 0 || (line.revents & (POLLHUP | POLLRDHUP)) != 0;
}

uint32_t Milliseconds(Clock::time_point at) {
  const auto since = std::chrono::duration_cast<std::chrono::milliseconds>(at.time_since_epoch());
  return static_cast<uint32_t>(since.count());  // it may wrap
}

}  // namespace

Session::Session(const asio::any_io_executor& strand, const ConversationOptions& options,
                 OnBatch on_batch, LinkRecord* record, const TappedLine& tapped)
    : options_(options),
      on_batch_(std::move(on_batch)),
      record_(record),
      tapped_(tapped),
      stream_(strand),
      wake_(strand),
      pause_(strand),
      decoder_(options.gap_timeout_ms),
      last_read_(Clock::now()),
      line_free_at_(last_read_) {}

Session::~Session() {
  for (const Frame& frame : queue_) {
    LeaveOut(frame.bytes);
  }
}

asio::awaitable<std::string> Session::Run(Descriptor descriptor) {
  using asio::experimental::awaitable_operators::operator||;
  error_code error;
  if (closed_) {
    co_return "closed";
  }
  const int handle = descriptor.get();
  stream_.assign(handle, error);  // NOLINT(bugprone-unused-return-value)
  if (error) {
    co_return "cannot wait for data: " + error.message();
  }
  descriptor.release();
  const auto reason = co_await (ToTheEnd(&Session::Read) || ToTheEnd(&Session::Write));
  stream_.close(error);
  if (exception_) {
    std::rethrow_exception(exception_);
  }
  co_return std::visit([](const std::string& why) { return why; }, reason);
}

void Session::Close() {
  error_code ignored;
  closed_ = true;
  stream_.close(ignored);
  wake_.cancel();
  pause_.cancel();
}

// When reading or writing ends, so does the other. This includes an exception, which by itself
// would not stop the other one.
asio::awaitable<std::string> Session::ToTheEnd(asio::awaitable<std::string> (Session::*loop)()) {
  std::string why;
  try {
    why = co_await (this->*loop)();
  } catch (...) {
    if (!ended_) {  // otherwise the exception is due to the end of the other one
      exception_ = std::current_exception();
    }
  }
  ended_ = true;
  co_return why;
}

asio::awaitable<std::string> Session::Read() {
  std::array<uint8_t, 4096> buffer;  // NOLINT: filled by the read
  while (true) {
    error_code error;
    const size_t size = co_await stream_.async_read_some(
        asio::buffer(buffer), asio::redirect_error(asio::use_awaitable, error));
    if (error == asio::error::eof && !IsHungUp(stream_.native_handle())) {
      co_await stream_.async_wait(asio::posix::stream_descriptor::wait_read,
                                  asio::redirect_error(asio::use_awaitable, error));
      if (!error) {
        continue;
      }
    }
    // There are two ways in which the end of a line is reported.
    if (error == asio::error::eof || error.value() == EIO) {
      co_return "the other side hung up";
    }
    if (error) {
      co_return error.message();
    }
    TakeBytes({buffer.data(), size});
  }
}

void Session::TakeBytes(std::span<const uint8_t> bytes) {
  last_read_ = Clock::now();
  const Tap::Reading reading(tapped_.tap);
  if (tapped_.tap != nullptr) {
    tapped_.tap->Read(&tapped_.line, bytes, Milliseconds(last_read_), decoder_);
  }
  const protocol::DecoderCounters before = decoder_.counters();
  batch_.clear();
  answers_.clear();
  decoder_.PushBlock(bytes.data(), bytes.size(), Milliseconds(last_read_),
                     [this](const protocol::Message& message) { batch_.push_back(message); });
  const protocol::DecoderCounters received = decoder_.counters() - before;
  record_->Count([&](LinkCounters& counters) {
    counters.bytes_in += bytes.size();
    counters.received += received;
    counters.heard = last_read_;
  });
  if (!batch_.empty()) {
    on_batch_(this, batch_, &answers_);
  }
  for (const engine::Outgoing& answer : answers_) {
    Enqueue(answer.message, last_read_);
  }
}

engine::Asker Session::asker() const {
  engine::Asker asker;
  asker.asked_ns = std::chrono::nanoseconds(last_read_.time_since_epoch()).count();
  asker.connection = connection();
  return asker;
}

void Session::Send(const engine::Outgoing& outgoing) {
  const Clock::time_point asked{std::chrono::nanoseconds(outgoing.asker.asked_ns)};
  Enqueue(outgoing.message, outgoing.asker.known() ? std::optional(asked) : std::nullopt);
}

void Session::Enqueue(const protocol::Message& message, std::optional<Clock::time_point> asked_at) {
  // On a shared line, ERRORs must not crowd out other answers.
  if (options_.medium_access && message.opcode == protocol::kError) {
    const auto now = Clock::now();
    if (last_error_ && now - *last_error_ < options_.response_window) {
      record_->Count([](LinkCounters& counters) { ++counters.withheld_errors; });
      if (tapped_.tap != nullptr) {
        tapped_.tap->Dropped(tapped_.line.link, message);
      }
      return;
    }
    last_error_ = now;
  }
  Frame frame{std::vector<uint8_t>(protocol::kMaxFrame), asked_at};
  frame.bytes.resize(protocol::EncodeFrame(message, frame.bytes.data(), frame.bytes.size()));
  queued_bytes_ += frame.bytes.size();
  // On a shared line, unsolicited messages wait for silence, and must not delay an answer for which
  // a robot's window is open.
  const auto place =
      options_.medium_access && asked_at
          ? std::find_if(queue_.begin(), queue_.end(), [](const Frame& it) { return !it.asked_at; })
          : queue_.end();
  queue_.insert(place, std::move(frame));
  while (queued_bytes_ > kMaxQueue) {
    queued_bytes_ -= queue_.front().bytes.size();
    LeaveOut(queue_.front().bytes);
    queue_.pop_front();
    record_->Count([](LinkCounters& counters) { ++counters.dropped_answers; });
  }
  wake_.cancel();
}

// Reports to the tap that these frames are dropped.
void Session::LeaveOut(std::span<const uint8_t> frames) const {
  if (tapped_.tap != nullptr) {
    protocol::FrameDecoder decoder(protocol::kNoGapTimeout);
    decoder.PushBlock(frames.data(), frames.size(), 0, [this](const protocol::Message& message) {
      tapped_.tap->Dropped(tapped_.line.link, message);
    });
  }
}

// When a frame may be sent. An answer is sent as soon as the robot listens again; other messages
// wait until the line is free.
Clock::time_point Session::EarliestStart(const Frame& frame) const {
  if (!options_.medium_access) {
    return Clock::time_point::min();
  }
  if (frame.asked_at) {
    return std::max(*frame.asked_at + options_.server_gap(), line_free_at_);
  }
  const Clock::duration gap = std::chrono::milliseconds(options_.gap_timeout_ms);
  const auto silence =
      decoder_.frame_open() ? std::max(gap, options_.idle_time()) : options_.idle_time();
  return std::max(last_read_ + silence, line_free_at_ + options_.idle_time());
}

// The bytes of one write: one whole frame on a shared line; otherwise the whole queue.
std::vector<uint8_t> Session::NextBlock(size_t* frames) {
  std::vector<uint8_t> block;
  for (*frames = 0; !queue_.empty() && (*frames == 0 || !options_.medium_access); ++*frames) {
    const std::vector<uint8_t>& bytes = queue_.front().bytes;
    block.insert(block.end(), bytes.begin(), bytes.end());
    queued_bytes_ -= bytes.size();
    queue_.pop_front();
  }
  return block;
}

// Drops the first message of the queue if `start` is too late for the robot that waits for it.
bool Session::DropLate(Clock::time_point start) {
  const Frame& frame = queue_.front();
  if (!options_.medium_access || !frame.asked_at ||
      start + options_.lead <= *frame.asked_at + options_.response_window) {
    return false;
  }
  queued_bytes_ -= frame.bytes.size();
  LeaveOut(frame.bytes);
  queue_.pop_front();
  record_->Count([](LinkCounters& counters) { ++counters.late_answers; });
  return true;
}

// Whether the first message of the queue may be sent now. Messages that are too late are dropped.
bool Session::IsReady(Clock::time_point now) {
  return !queue_.empty() && EarliestStart(queue_.front()) <= now && !DropLate(now);
}

asio::awaitable<std::string> Session::Write() {
  error_code error;
  const bool senses = options_.port != nullptr && options_.port->port().senses_carrier();
  const bool keyed = options_.port != nullptr && options_.port->port().is_keyed();
  while (true) {
    const Clock::time_point now = Clock::now();
    const Clock::time_point start =
        queue_.empty() ? Clock::time_point::max() : EarliestStart(queue_.front());
    if (!queue_.empty() && DropLate(std::max(start, now))) {
      continue;
    }
    if (start > now) {
      wake_.expires_at(start);
      co_await wake_.async_wait(asio::redirect_error(asio::use_awaitable, error));
      continue;
    }
    // Messages stay in the queue until they are written: the driver may be slow, and the situation
    // may have changed by then.
    if (senses) {
      const bool busy = co_await options_.port->Make([](Port& port) { return port.carrier(); });
      if (ended_ || closed_) {
        co_return "closed";
      }
      if (busy) {
        pause_.expires_after(kBetweenLooks);
        co_await pause_.async_wait(asio::redirect_error(asio::use_awaitable, error));
      }
      if (busy || !IsReady(Clock::now())) {
        continue;
      }
    }
    bool ready = true;
    if (keyed) {
      co_await options_.port->Make([](Port& port) { port.Key(true); });
      const Clock::time_point keyed_at = Clock::now();
      if (options_.lead != Clock::duration::zero() && !ended_ && !closed_) {
        pause_.expires_at(keyed_at + options_.lead);
        co_await pause_.async_wait(asio::redirect_error(asio::use_awaitable, error));
      }
      if (ended_ || closed_) {
        co_return "closed";
      }
      ready = IsReady(keyed_at);
    }
    if (ready) {
      size_t frames = 0;
      const std::vector<uint8_t> block = NextBlock(&frames);
      if (tapped_.tap != nullptr) {
        tapped_.tap->Wrote(tapped_.line, block);
      }
      line_free_at_ = Clock::now() + static_cast<int64_t>(block.size()) * options_.byte_time;
      const size_t size = co_await asio::async_write(
          stream_, asio::buffer(block), asio::redirect_error(asio::use_awaitable, error));
      record_->Count([&](LinkCounters& counters) {
        counters.bytes_out += size;
        counters.frames_out += error ? 0 : frames;
      });
      if (error) {
        co_return error.value() == EIO ? "the other side hung up" : error.message();
      }
      if (options_.tail != Clock::duration::zero()) {
        line_free_at_ += options_.tail;
        pause_.expires_at(line_free_at_);
        co_await pause_.async_wait(asio::redirect_error(asio::use_awaitable, error));
      }
    }
    if (ended_ || closed_) {
      co_return "closed";
    }
    if (keyed) {
      co_await options_.port->Make([](Port& port) { port.Key(false); });
    }
  }
}

}  // namespace pheromone::links
