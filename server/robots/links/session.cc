#include "server/robots/links/session.h"

#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>
#include <span>
#include <utility>
#include <variant>

#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>

#include "protocol/decoder.h"
#include "protocol/messages.h"
#include "server/base/counters.h"

namespace pheromone::links {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

// How often the carrier is checked while something waits to be sent.
constexpr std::chrono::milliseconds kBetweenLooks{1};
// And whether this server may send, while it may not.
constexpr std::chrono::milliseconds kBetweenAsking{100};

// Whether a reported end of the line is real. A kernel may report the end for a terminal that is
// merely idle: Linux 6.18 once in some thousand reads on a busy machine, and any kernel if VMIN is
// 0.
bool IsHungUp(int descriptor) {
  pollfd line = {descriptor, POLLRDHUP, 0};
  return poll(&line, 1, 0) < 0 || (line.revents & (POLLHUP | POLLRDHUP)) != 0;
}

bool HasUnread(int descriptor) {
  pollfd line = {descriptor, POLLIN, 0};
  return poll(&line, 1, 0) != 0;
}

radio::Time At(Clock::time_point point) {
  return point.time_since_epoch();
}

Clock::time_point PointAt(radio::Time at) {
  return Clock::time_point(at);
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
      last_read_(Clock::now()),
      all_read_(last_read_) {
  MakeChannel();
}

void Session::MakeChannel() {
  channel_.emplace(options_.channel, [this](const protocol::Message& message) {
    if (is_refusing_) {
      options_.on_refused(message);
    } else {
      Drop(message);
    }
  });
  counted_ = {};
}

void Session::Drop(const protocol::Message& message) {
  if (tapped_.tap != nullptr) {
    tapped_.tap->Dropped(tapped_.line.link, message);
  }
}

void Session::RefuseAll() {
  is_refusing_ = true;
  channel_->DropAll();
  is_refusing_ = false;
}

void Session::TakeOver(const std::vector<radio::RoundMember>& members) {
  RefuseAll();
  CountWhatHappened();
  MakeChannel();
  channel_->Resume(members, At(Clock::now()));
  Wake();
}

Session::~Session() {
  channel_->DropAll();
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

void Session::Finish() {
  finishing_ = true;
  wake_.cancel();
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
  const protocol::FrameDecoder& decoder = channel_->decoder();
  if (tapped_.tap != nullptr) {
    tapped_.tap->Read(&tapped_.line, bytes, radio::Channel::DecoderTime(At(last_read_)), decoder);
  }
  const protocol::DecoderCounters before = decoder.counters();
  batch_.clear();
  answers_.clear();
  channel_->Hear(bytes, At(last_read_), At(all_read_), &batch_);
  for (const protocol::Message& message : channel_->refused()) {
    if (tapped_.tap != nullptr) {
      tapped_.tap->Rejected(tapped_.line.link, message, protocol::Reason::kNone);
    }
  }
  const protocol::DecoderCounters received = decoder.counters() - before;
  record_->Count([&](LinkCounters& counters) {
    counters.bytes_in += bytes.size();
    counters.received += received;
    counters.heard = last_read_;
    if (options_.channel.signing != nullptr) {
      counters.signing = options_.channel.signing->counters();  // of the link's other sessions, too
    }
  });
  if (!batch_.empty()) {
    on_batch_(this, batch_, &answers_);
  }
  for (const engine::Outgoing& it : answers_) {
    Queue(it.message, At(last_read_));
  }
  Wake();
}

engine::Asker Session::asker() const {
  engine::Asker asker;
  asker.asked_ns = At(last_read_).count();
  asker.connection = connection();
  return asker;
}

void Session::Send(const engine::Outgoing& outgoing) {
  std::optional<radio::Time> asked_at;
  if (outgoing.asker.known()) {
    asked_at = radio::Time(outgoing.asker.asked_ns);
  }
  Queue(outgoing.message, asked_at);
  Wake();
}

// A request may lead to a COMMAND, which is not its answer.
void Session::Queue(const protocol::Message& message, std::optional<radio::Time> asked_at) {
  if (asked_at && message.opcode != protocol::kCommand) {
    channel_->Answer(message, *asked_at, At(Clock::now()));
  } else {
    channel_->Send(message);
  }
}

// Something may be due earlier than before.
void Session::Wake() {
  CountWhatHappened();
  wake_.cancel();
}

void Session::CountWhatHappened() {
  const radio::ChannelCounters now = channel_->counters();
  if (now != counted_) {
    record_->Count([&](radio::ChannelCounters& counters) {
      counters = SumOf(counters, DifferenceOf(now, counted_));
    });
    counted_ = now;
  }
}

// From the keying of the transmitter to the end of its tail, at most.
radio::Duration Session::OnTheAir(size_t bytes) const {
  const radio::Timing& timing = options_.channel.timing;
  return std::max(timing.lead, timing.turnaround) + static_cast<int64_t>(bytes) * timing.byte +
         std::max(timing.tail, timing.turnaround);
}

bool Session::IsPermitted(size_t bytes) const {
  return options_.permit == nullptr || options_.permit->Allows(OnTheAir(bytes));
}

bool Session::Claim(size_t bytes) {
  return options_.permit == nullptr || options_.permit->Claim(OnTheAir(bytes));
}

// Claims directly before each call of the driver; all of it, since the driver may still have what
// it took before. What is not permitted is not sent: nothing at all, or less than all.
asio::awaitable<error_code> Session::WritePermitted(std::span<const uint8_t> bytes, size_t* size) {
  error_code error;
  stream_.non_blocking(true, error);  // NOLINT(bugprone-unused-return-value)
  while (!error && *size < bytes.size() && Claim(bytes.size())) {
    *size += stream_.write_some(asio::buffer(bytes.data() + *size, bytes.size() - *size), error);
    if (error == asio::error::would_block) {
      error.clear();
      co_await stream_.async_wait(asio::posix::stream_descriptor::wait_write,
                                  asio::redirect_error(asio::use_awaitable, error));
    }
  }
  co_return error;
}

asio::awaitable<void> Session::PauseUntil(Clock::time_point end) {
  error_code error;
  pause_.expires_at(end);
  co_await pause_.async_wait(asio::redirect_error(asio::use_awaitable, error));
}

asio::awaitable<std::string> Session::Write() {
  error_code error;
  const bool senses = options_.port != nullptr && options_.port->port().senses_carrier();
  const bool keyed = options_.port != nullptr && options_.port->port().is_keyed();
  while (!ended_ && !closed_ && !finishing_) {
    const Clock::time_point now = Clock::now();
    if (!HasUnread(stream_.native_handle())) {
      all_read_ = now;
    }
    if (!IsPermitted(0)) {
      RefuseAll();
      wake_.expires_at(now + kBetweenAsking);
      co_await wake_.async_wait(asio::redirect_error(asio::use_awaitable, error));
      continue;
    }
    const radio::Time start = channel_->NextStart(At(now));
    CountWhatHappened();
    if (start > At(now)) {
      const radio::Time look = channel_->LookAt();
      const radio::Time wake = look > At(now) ? std::min(start, look) : start;
      wake_.expires_at(wake == radio::kNever ? Clock::time_point::max() : PointAt(wake));
      co_await wake_.async_wait(asio::redirect_error(asio::use_awaitable, error));
      continue;
    }
    // Messages stay in the channel until they are written: the driver may be slow, and the
    // situation may have changed by then.
    if (senses) {
      const bool carrier = co_await options_.port->Make([](Port& port) { return port.carrier(); });
      const bool clear = channel_->IsClear(carrier, At(Clock::now()));
      if (ended_ || closed_ || finishing_) {
        break;
      }
      if (!clear) {
        co_await PauseUntil(Clock::now() + kBetweenLooks);
      }
      if (!clear || channel_->NextStart(At(Clock::now())) > At(Clock::now())) {
        continue;
      }
    }
    Clock::time_point begin = Clock::now();
    if (keyed) {
      if (!co_await KeyUp()) {
        continue;
      }
      begin = Clock::now();
      if (options_.channel.timing.lead != radio::Duration::zero() && !ended_ && !closed_) {
        co_await PauseUntil(begin + options_.channel.timing.lead);
      }
      if (ended_ || closed_) {
        break;
      }
    }
    const std::string why = co_await Transmit(channel_->Begin(At(begin)));
    if (!why.empty()) {
      co_return why;
    }
    CountWhatHappened();
    if (keyed && !ended_ && !closed_) {
      co_await KeyDown();
    }
  }
  if (!ended_ && !closed_) {
    co_await PauseUntil(PointAt(channel_->sent_at()));
  }
  co_return "closed";
}

// False: it is not permitted. The permit is held until KeyDown, since a driver may take its time.
asio::awaitable<bool> Session::KeyUp() {
  if (options_.permit != nullptr) {
    options_.permit->Hold();
    if (!Claim(0)) {
      options_.permit->Release();
      co_return false;
    }
  }
  co_await options_.port->Make([](Port& port) { port.Key(true); });
  co_return true;
}

asio::awaitable<void> Session::KeyDown() {
  co_await options_.port->Make([](Port& port) { port.Key(false); });
  if (options_.permit != nullptr) {
    options_.permit->Release();
  }
}

// Returns why it failed; empty if it did not. With a line to key, returns when the last bit has
// left and the tail is over. When it has left, the driver tells; but some tell too early, so it is
// not before the bytes have had their time either.
asio::awaitable<std::string> Session::Transmit(radio::Transmission out) {
  if (out.bytes.empty()) {
    co_return "";
  }
  size_t pad = 0;
  size_t size = 0;
  error_code error;
  if (options_.permit == nullptr) {
    size = co_await asio::async_write(stream_, asio::buffer(out.bytes),
                                      asio::redirect_error(asio::use_awaitable, error));
  } else {
    const ptrdiff_t pads = is_cut_ ? 1 : 0;  // protocol/README.md, "The pad byte"
    out.bytes.insert(out.bytes.begin(), static_cast<size_t>(pads), 0);
    error = co_await WritePermitted(out.bytes, &size);
    out.bytes.erase(out.bytes.begin(), out.bytes.begin() + pads);
    pad = std::min(size, static_cast<size_t>(pads));
    size -= pad;
  }
  const auto cut = std::upper_bound(out.frame_ends.begin(), out.frame_ends.end(), size);
  const auto frames = static_cast<size_t>(cut - out.frame_ends.begin());
  is_cut_ = (is_cut_ && pad == 0) || size != (frames == 0 ? 0 : out.frame_ends[frames - 1]);
  record_->Count([&](LinkCounters& counters) {
    counters.bytes_out += pad + size;
    counters.frames_out += frames;
  });
  if (frames != 0 && tapped_.tap != nullptr) {
    tapped_.tap->Wrote(tapped_.line, {out.bytes.data(), out.frame_ends[frames - 1]});
  }
  for (const radio::Transmission::Part& part : out.parts) {
    if (part.end > size) {
      options_.on_refused(part.message);
    }
  }
  if (size == 0 && !error) {
    co_return "";
  }
  if (error) {
    co_return error.value() == EIO ? "the other side hung up" : error.message();
  }
  const radio::Duration duration = static_cast<int64_t>(size) * options_.channel.timing.byte;
  channel_->OnSent(std::max(channel_->sent_at(), At(Clock::now()) + duration));
  if (options_.port != nullptr && options_.port->port().is_keyed()) {
    co_await options_.port->Make([](Port& port) { port.WaitUntilSent(); });
    if (const radio::Time now = At(Clock::now()); now > channel_->sent_at()) {
      channel_->OnSent(now);
    }
    if (!ended_ && !closed_) {
      co_await PauseUntil(PointAt(channel_->sent_at() + options_.channel.timing.tail));
    }
  }
  co_return "";
}

}  // namespace pheromone::links
