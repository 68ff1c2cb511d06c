#include "server/operators/ctl/modem_commands.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "protocol/decoder.h"
#include "protocol/frame.h"
#include "protocol/messages.h"
#include "server/base/descriptor.h"
#include "server/base/result.h"
#include "server/operators/ctl/modem_figures.h"
#include "server/operators/ctl/server_call.h"
#include "server/robots/links/port.h"

namespace pheromone::ctl {
namespace {

using Clock = std::chrono::steady_clock;
using Milliseconds = std::chrono::duration<double, std::milli>;

constexpr uint8_t kId = 254;      // of the PINGs; no server listens to these ports
constexpr size_t kOneByOne = 30;  // frames with a pause before each
constexpr size_t kExchanges = 10;
constexpr size_t kFirstFrames = 5;    // if none of them arrives, none will
constexpr int64_t kPatienceMs = 300;  // longer than any modem that fits
constexpr unsigned kPauseMs = 60;     // until everybody listens again
constexpr std::array kPausesMs = {0u, 8u, 32u, 128u};

Clock::duration OfMs(double ms) {
  return std::chrono::duration_cast<Clock::duration>(Milliseconds(ms));
}

using Payload = std::array<uint8_t, protocol::kMaxPing>;

// Tells a frame from others by its number; the rest are bytes of all kinds.
Payload PayloadOf(uint32_t number) {
  Payload payload{};
  for (size_t i = 0; i < payload.size(); ++i) {
    payload[i] = static_cast<uint8_t>(i < sizeof number ? number >> (8 * i) : number * 31 + 37 * i);
  }
  return payload;
}

std::vector<uint8_t> FrameOf(uint32_t number) {
  protocol::Ping ping;
  ping.id = kId;
  ping.length = protocol::kMaxPing;
  std::ranges::copy(PayloadOf(number), ping.payload);
  protocol::Message message;
  std::vector<uint8_t> wire(protocol::kMaxFrame);
  Encode(ping, &message);
  wire.resize(protocol::EncodeFrame(message, wire.data(), wire.size()));
  return wire;
}

// 0, which no frame has, if it is none of FrameOf.
uint32_t NumberOf(const protocol::Message& frame) {
  protocol::Ping ping;
  if (!Decode(frame, &ping) || ping.length != protocol::kMaxPing) {
    return 0;
  }
  uint32_t number = 0;
  for (size_t i = 0; i < sizeof number; ++i) {
    number |= uint32_t{ping.payload[i]} << (8 * i);
  }
  return std::ranges::equal(PayloadOf(number), ping.payload) ? number : 0;
}

// A port, and what came in through it since Expect.
class Side {
 public:
  Side(std::string path, unsigned baud)
      : path_(std::move(path)),
        port_(links::MakeSerialPort(
            {.name = path_,
             .find_path = [path = path_] { return Result<std::string>(path); },
             .baud = baud,
             .lines = {}})) {}

  Status Open() {
    PHEROMONE_TRY(line_, port_->Open());
    return Ok();
  }

  void Expect() {
    begin_ = Clock::now();
    decoder_ = protocol::FrameDecoder(protocol::kNoGapTimeout);
    bytes_ = 0;
    chunks_.clear();
    numbers_.clear();
  }

  Status Read() {
    std::array<uint8_t, 4096> buffer{};
    const ssize_t size = read(line_.get(), buffer.data(), buffer.size());
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) {
      return Ok();
    }
    if (size <= 0) {
      return size == 0 ? Error{path_ + ": the port is gone"} : SystemError(path_);
    }
    bytes_ += static_cast<size_t>(size);
    chunks_.push_back({Milliseconds(Clock::now() - begin_).count(), bytes_});
    for (const uint8_t byte : std::span(buffer).first(static_cast<size_t>(size))) {
      if (decoder_.Push(byte, 0)) {
        numbers_.insert(NumberOf(decoder_.message()));
      }
    }
    return Ok();
  }

  // All of it: a frame fits into the buffer of any driver.
  Status Write(std::span<const uint8_t> bytes) {
    while (!bytes.empty()) {
      const ssize_t size = write(line_.get(), bytes.data(), bytes.size());
      if (size < 0 && errno != EAGAIN && errno != EINTR) {
        return SystemError(path_);
      }
      if (size > 0) {
        bytes = bytes.subspan(static_cast<size_t>(size));
      } else {
        pollfd writable{line_.get(), POLLOUT, 0};
        if (poll(&writable, 1, 1000) == 0) {
          return Error{path_ + ": took no byte for 1 s"};
        }
      }
    }
    return Ok();
  }

  bool Has(uint32_t number) const { return numbers_.contains(number); }
  int descriptor() const { return line_.get(); }
  size_t bytes() const { return bytes_; }
  const std::vector<Chunk>& chunks() const { return chunks_; }

 private:
  std::string path_;
  std::unique_ptr<links::Port> port_;
  Descriptor line_;
  Clock::time_point begin_;
  protocol::FrameDecoder decoder_{protocol::kNoGapTimeout};
  size_t bytes_ = 0;
  std::vector<Chunk> chunks_;
  std::unordered_set<uint32_t> numbers_;  // of the frames
};

struct Way {
  size_t one_by_one = 0;
  size_t streamed = 0;
  size_t answered = 0;    // of exchanges that this way began
  unsigned pause_ms = 0;  // before its answers, for that
  size_t bytes_of_frames = 0;
  double bytes_per_s = 0;
  Delays delays;
  std::vector<double> first_byte_ms;  // of answers, after the request left
};

class ModemTest {
 public:
  explicit ModemTest(const ModemTestOptions& options)
      : options_(options),
        sides_{Side(options.ports[0], options.baud), Side(options.ports[1], options.baud)} {}

  Status Run() {
    for (Side& side : sides_) {
      PHEROMONE_TRY_STATUS(side.Open());
    }
    for (const size_t from : {size_t{0}, size_t{1}}) {
      PHEROMONE_TRY_STATUS(OneByOne(from));
    }
    for (const size_t from : {size_t{0}, size_t{1}}) {
      PHEROMONE_TRY_STATUS(WithoutPause(from));
    }
    for (const size_t from : {size_t{0}, size_t{1}}) {
      PHEROMONE_TRY_STATUS(Exchange(from));
    }
    return Ok();
  }

  const Way& way(size_t from) const { return ways_[from]; }
  size_t noise() const { return noise_; }
  size_t echoed() const { return echoed_; }

 private:
  double AirMs(size_t bytes) const { return static_cast<double>(bytes) * 10'000 / options_.baud; }

  // Reads at both ends until `end`, or until something came that satisfies `done`; what came before
  // a pause of this program counts, though it is late to read it.
  Status Listen(Clock::time_point end, const std::function<bool()>& done = nullptr) {
    while (!done || !done()) {
      const auto left = std::max(Clock::duration(0), end - Clock::now());
      std::array<pollfd, 2> lines{pollfd{sides_[0].descriptor(), POLLIN, 0},
                                  pollfd{sides_[1].descriptor(), POLLIN, 0}};
      const timespec wait{std::chrono::duration_cast<std::chrono::seconds>(left).count(),
                          (left % std::chrono::seconds(1)).count()};
      if (ppoll(lines.data(), lines.size(), &wait, nullptr) < 0 && errno != EINTR) {
        return SystemError("poll");
      }
      for (size_t i = 0; i < lines.size(); ++i) {
        if (lines[i].revents != 0) {
          PHEROMONE_TRY_STATUS(sides_[i].Read());
        }
      }
      if (left.count() == 0) {
        break;
      }
    }
    return Ok();
  }

  // Until nobody sends. What comes now was sent by nobody, or late.
  Status BeQuiet(unsigned pause_ms = kPauseMs) {
    Expect();
    PHEROMONE_TRY_STATUS(Listen(Clock::now() + OfMs(pause_ms)));
    noise_ += sides_[0].bytes() + sides_[1].bytes();
    Expect();
    return Ok();
  }

  void Expect() {
    for (Side& side : sides_) {
      side.Expect();
    }
  }

  Status OneByOne(size_t from) {
    Way& way = ways_[from];
    Side& to = sides_[1 - from];
    std::vector<double> delays;
    for (size_t i = 0; i < kOneByOne; ++i) {
      PHEROMONE_TRY_STATUS(BeQuiet());
      const std::vector<uint8_t> frame = FrameOf(++number_);
      PHEROMONE_TRY_STATUS(sides_[from].Write(frame));
      PHEROMONE_TRY_STATUS(Listen(Clock::now() + OfMs(AirMs(frame.size()) + kPatienceMs),
                                  [&] { return to.Has(number_); }));
      echoed_ += sides_[from].bytes();
      if (to.Has(number_) && to.bytes() == frame.size()) {
        size_t before = 0;
        for (const Chunk& chunk : to.chunks()) {
          delays.push_back(DelayMs(chunk, options_.baud));
          delays.push_back(DelayMs({chunk.at_ms, before + 1}, options_.baud));
          before = chunk.bytes_read;
        }
      }
      way.one_by_one += to.Has(number_);
      way.bytes_of_frames = std::max(way.bytes_of_frames, frame.size());
      if (i + 1 == kFirstFrames && delays.empty()) {
        return Error{fmt::format(
            "nothing whole of {} frames from {} arrived at {} ({} bytes in the last {} ms); "
            "expected "
            "modems that pass bytes through, on the same frequency, and {} baud on both sides",
            kFirstFrames, options_.ports[from], options_.ports[1 - from], to.bytes(), kPatienceMs,
            options_.baud)};
      }
    }
    way.delays = DelaysOf(std::move(delays));
    return Ok();
  }

  Status WithoutPause(size_t from) {
    Way& way = ways_[from];
    Side& to = sides_[1 - from];
    PHEROMONE_TRY_STATUS(BeQuiet());
    const Clock::time_point begin = Clock::now();
    const uint32_t first = number_ + 1;
    size_t bytes = 0;
    for (size_t i = 0; i < options_.frames; ++i) {
      const std::vector<uint8_t> frame = FrameOf(++number_);
      // One frame ahead of the UART, so that it never waits.
      PHEROMONE_TRY_STATUS(Listen(begin + OfMs(std::max(0.0, AirMs(bytes) - AirMs(frame.size())))));
      PHEROMONE_TRY_STATUS(sides_[from].Write(frame));
      bytes += frame.size();
    }
    PHEROMONE_TRY_STATUS(Listen(begin + OfMs(AirMs(bytes) + kPatienceMs + OneWayMs(way)),
                                [&] { return to.Has(number_); }));
    for (uint32_t number = first; number <= number_; ++number) {
      way.streamed += to.Has(number);
    }
    if (!to.chunks().empty()) {
      const double took_ms = to.chunks().back().at_ms - way.delays.least_ms;
      way.bytes_per_s = 1000 * static_cast<double>(to.bytes()) / std::max(took_ms, 1.0);
    }
    return Ok();
  }

  // As a server answers: a byte's time after the request. If that is too early for the modem of who
  // asks, with longer pauses.
  Status Exchange(size_t from) {
    Way& way = ways_[from];
    for (const unsigned pause_ms : kPausesMs) {
      way.answered = 0;
      way.first_byte_ms.clear();
      way.pause_ms = pause_ms;
      for (size_t i = 0; i < kExchanges && (i < kFirstFrames || way.answered != 0); ++i) {
        PHEROMONE_TRY_STATUS(ExchangeOne(from, pause_ms));
      }
      if (2 * way.answered > kExchanges) {
        break;
      }
    }
    return Ok();
  }

  Status ExchangeOne(size_t from, unsigned pause_ms) {
    Way& way = ways_[from];
    Side& asking = sides_[from];
    Side& answering = sides_[1 - from];
    PHEROMONE_TRY_STATUS(BeQuiet(kPauseMs + pause_ms));
    const std::vector<uint8_t> request = FrameOf(++number_);
    const Clock::time_point begin = Clock::now();
    PHEROMONE_TRY_STATUS(asking.Write(request));
    PHEROMONE_TRY_STATUS(Listen(begin + OfMs(AirMs(request.size()) + kPatienceMs),
                                [&] { return answering.Has(number_); }));
    if (!answering.Has(number_)) {
      return Ok();
    }
    PHEROMONE_TRY_STATUS(Listen(Clock::now() + OfMs(AirMs(1) + pause_ms)));
    const std::vector<uint8_t> answer = FrameOf(++number_);
    asking.Expect();
    const Clock::time_point answered = Clock::now();
    PHEROMONE_TRY_STATUS(answering.Write(answer));
    PHEROMONE_TRY_STATUS(Listen(answered + OfMs(AirMs(answer.size()) + kPatienceMs),
                                [&] { return asking.Has(number_); }));
    if (asking.Has(number_)) {
      ++way.answered;
      way.first_byte_ms.push_back(Milliseconds(answered - begin).count() +
                                  asking.chunks().front().at_ms - AirMs(request.size()));
    }
    return Ok();
  }

  static double OneWayMs(const Way& way) { return way.delays.least_ms + way.delays.varies_ms; }

  const ModemTestOptions& options_;
  std::array<Side, 2> sides_;
  std::array<Way, 2> ways_;
  uint32_t number_ = 0;
  size_t noise_ = 0;
  size_t echoed_ = 0;
};

std::string Damage(const Way& way, size_t frames) {
  const size_t sent = kOneByOne + frames;
  const size_t whole = way.one_by_one + way.streamed;
  return whole < sent
             ? fmt::format("{:.2f} %", 100 * DamagedBytes(whole, sent, way.bytes_of_frames))
             : fmt::format("less than {:.2f} %", 100 * UnnoticedDamage(sent, way.bytes_of_frames));
}

template <typename Text>
void PrintRow(const ModemTest& test, const char* what, Text&& text) {
  fmt::print("{:<26}{:<20}{}\n", what, text(test.way(0)), text(test.way(1)));
}

void PrintFigures(const ModemTest& test, const ModemTestOptions& options) {
  fmt::print("{:<26}{:<20}{}\n", "", "1 to 2", "2 to 1");
  PrintRow(test, "frames, one by one",
           [](const Way& way) { return fmt::format("{} of {}", way.one_by_one, kOneByOne); });
  PrintRow(test, "  delay, at least",
           [](const Way& way) { return fmt::format("{:.1f} ms", way.delays.least_ms); });
  PrintRow(test, "  late by, at most",
           [](const Way& way) { return fmt::format("{:.1f} ms", way.delays.varies_ms); });
  PrintRow(test, "frames, without a pause",
           [&](const Way& way) { return fmt::format("{} of {}", way.streamed, options.frames); });
  PrintRow(test, "  bytes a second",
           [](const Way& way) { return fmt::format("{:.0f}", way.bytes_per_s); });
  PrintRow(test, "damaged bytes", [&](const Way& way) { return Damage(way, options.frames); });
  PrintRow(test, "answers, at once", [](const Way& way) {
    return fmt::format("{} of {}", way.pause_ms == 0 ? way.answered : 0, kExchanges);
  });
  PrintRow(test, "  first byte, at most", [](const Way& way) {
    return way.first_byte_ms.empty()
               ? std::string("-")
               : fmt::format("{:.1f} ms",
                             *std::max_element(way.first_byte_ms.begin(), way.first_byte_ms.end()));
  });
}

void PrintLink(const ModemTest& test, const ModemTestOptions& options) {
  const unsigned turnaround_ms =
      RoundedUpMs(std::max(test.way(0).delays.least_ms, test.way(1).delays.least_ms));
  const std::string link = LinkText(options.ports[0], options.baud, turnaround_ms,
                                    RoundedUpMs(test.way(1).delays.varies_ms));
  fmt::print("\nFor a server at 1, with such modems on all robots:\n\n{}", link);
  if (const std::string problems = LinkProblems(link); !problems.empty()) {
    fmt::print("\nA server does not take it, so these modems do not fit:\n{}\n", problems);
  }
  for (const size_t from : {size_t{0}, size_t{1}}) {
    const Way& way = test.way(from);
    if (2 * way.answered <= kExchanges) {
      fmt::print(
          "\nHardly any answer to {} was heard, not even after a pause of {} ms: these modems do "
          "not fit.\n",
          from + 1, kPausesMs.back());
    } else if (way.pause_ms != 0) {
      fmt::print(
          "\nThe modem of {} heard answers only after a pause of {} ms. No setting makes a server "
          "wait, other than ptt_lead_ms for a modem that is keyed.\n",
          from + 1, way.pause_ms);
    }
  }
}

}  // namespace

int TestModems(const ModemTestOptions& options) {
  const size_t bytes = FrameOf(1).size();
  const size_t frames = kOneByOne + kExchanges + options.frames;
  fmt::print(
      "1: {}, 2: {}, {} baud, {} frames of about {} bytes each way: {} s or longer\n",
      options.ports[0], options.ports[1], options.baud, frames, bytes,
      2 * frames * bytes * 10 / options.baud + 2 * (kOneByOne + kExchanges) * kPauseMs / 1000);
  static_cast<void>(std::fflush(stdout));
  ModemTest test(options);
  if (const Status run = test.Run(); !run.ok()) {
    return Fail(kFailed, run.error());
  }
  PrintFigures(test, options);
  if (test.echoed() != 0) {
    fmt::print("The modems return what is sent to them: the server and the robots ignore that.\n");
  }
  if (test.noise() != 0) {
    fmt::print("{} bytes came while nobody sent.\n", test.noise());
  }
  PrintLink(test, options);
  return 0;
}

}  // namespace pheromone::ctl
