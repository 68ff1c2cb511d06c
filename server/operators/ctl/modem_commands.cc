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
#include <optional>
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
constexpr size_t kMoreExchanges = 30;  // where frames are lost
constexpr double kGoodAir = 0.8;       // the share of exchanges of which both frames arrive
constexpr double kPoorAir = 0.25;      // too few to say what else an answer was lost to
constexpr size_t kFirstFrames = 5;     // if none of them arrives, none will
constexpr int64_t kPatienceMs = 300;   // longer than any modem that fits
constexpr unsigned kPauseMs = 60;      // until everybody listens again
// More from frame to frame, so that they are not in step with an adapter that delivers at every
// tick of a clock of its own, of up to 255 ms.
constexpr unsigned kPauseStepMs = 7;
constexpr double kMostNoiseMs = 3000;
constexpr double kSlowAir = 1.1;  // times the ports' own time
constexpr double kSurelySlowMs = 100;
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
    last_frame_ = {};
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
        if (const uint32_t number = NumberOf(decoder_.message()); number != 0) {
          numbers_.insert(number);
          last_frame_ = {number, chunks_.back()};
        }
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
  // The last of our frames, and what was read with its end; 0: none.
  const std::pair<uint32_t, Chunk>& last_frame() const { return last_frame_; }
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
  std::pair<uint32_t, Chunk> last_frame_;
};

struct Way {
  size_t one_by_one = 0;
  size_t inserted = 0;  // bytes that came before frames
  size_t streamed = 0;
  size_t exchanges = 0;              // that this way began, with answers at once
  size_t answered = 0;               // of them
  std::optional<unsigned> pause_ms;  // before answers, with which they are heard
  size_t bytes_of_frames = 0;
  double bytes_per_s = 0;
  double slower = 1;  // than the ports, by this factor; of small differences nothing is told
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
  // The share of exchanges whose two frames arrive, as frames did one by one.
  double Arrive() const {
    return static_cast<double>(ways_[0].one_by_one * ways_[1].one_by_one) /
           static_cast<double>(kOneByOne * kOneByOne);
  }
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

  // Until nothing has come for this time.
  Status ListenOn(double quiet_ms, double at_most_ms) {
    const Clock::time_point end = Clock::now() + OfMs(at_most_ms);
    size_t before = 0;
    do {
      before = sides_[0].bytes() + sides_[1].bytes();
      PHEROMONE_TRY_STATUS(Listen(Clock::now() + OfMs(quiet_ms)));
    } while (before != sides_[0].bytes() + sides_[1].bytes() && Clock::now() < end);
    return Ok();
  }

  // Until nobody sends. What comes now was sent by nobody, or is late, or comes back to who sent.
  Status BeQuiet(unsigned pause_ms = kPauseMs) {
    const size_t before = sides_[1 - sender_].bytes();
    PHEROMONE_TRY_STATUS(ListenOn(pause_ms, kMostNoiseMs));
    const Side& sender = sides_[sender_];
    (sender.Has(number_) ? echoed_ : noise_) += sender.bytes();
    noise_ += sides_[1 - sender_].bytes() - before;
    Expect();
    return Ok();
  }

  Status Send(size_t from, std::span<const uint8_t> frame) {
    sender_ = from;
    return sides_[from].Write(frame);
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
      PHEROMONE_TRY_STATUS(BeQuiet(kPauseMs + kPauseStepMs * static_cast<unsigned>(i)));
      const std::vector<uint8_t> frame = FrameOf(++number_);
      PHEROMONE_TRY_STATUS(Send(from, frame));
      PHEROMONE_TRY_STATUS(Listen(Clock::now() + OfMs(AirMs(frame.size()) + kPatienceMs),
                                  [&] { return to.Has(number_); }));
      if (to.Has(number_)) {
        ++way.one_by_one;
        const size_t inserted = to.bytes() - frame.size();
        way.inserted += inserted;
        AddDelays(to.chunks(), inserted, &delays);
      }
      way.bytes_of_frames = std::max(way.bytes_of_frames, frame.size());
      if (i + 1 == kFirstFrames && way.one_by_one == 0) {
        return NothingArrives(from, frame.size());
      }
    }
    way.delays = DelaysOf(std::move(delays));
    return Ok();
  }

  // Of a frame before which so many bytes were inserted.
  void AddDelays(const std::vector<Chunk>& chunks, size_t inserted,
                 std::vector<double>* delays) const {
    size_t before = 0;
    for (const Chunk& chunk : chunks) {
      if (chunk.bytes_read > inserted) {
        const size_t read = chunk.bytes_read - inserted;
        delays->push_back(DelayMs({chunk.at_ms, read}, options_.baud));
        delays->push_back(DelayMs({chunk.at_ms, before + 1}, options_.baud));
        before = read;
      }
    }
  }

  Error NothingArrives(size_t from, size_t frame_bytes) const {
    const size_t bytes = sides_[1 - from].bytes();
    std::string text = fmt::format(
        "nothing whole of {} frames from {} arrived at {} ({} bytes of the last one's {}); ",
        kFirstFrames, options_.ports[from], options_.ports[1 - from], bytes, frame_bytes);
    if (bytes != 0 && bytes < frame_bytes) {
      text += "a modem that cuts the first bytes needs a lead before them (PTT); ";
    }
    text += from == 1 ? fmt::format(
                            "frames the other way arrive, so look at what {} sends with "
                            "and {} receives with",
                            options_.ports[from], options_.ports[1 - from])
                      : fmt::format(
                            "expected modems that pass bytes through, on the same "
                            "frequency, and {} baud on both sides",
                            options_.baud);
    return Error{std::move(text)};
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
      PHEROMONE_TRY_STATUS(Send(from, frame));
      bytes += frame.size();
    }
    PHEROMONE_TRY_STATUS(ListenOn(kPatienceMs, kMostNoiseMs + 3 * AirMs(bytes)));
    for (uint32_t number = first; number <= number_; ++number) {
      way.streamed += to.Has(number);
    }
    if (to.chunks().empty()) {
      return Error{
          fmt::format("nothing of {} frames without a pause from {} arrived at {}, where {} "
                      "of {} had arrived one by one: a modem has fallen silent",
                      options_.frames, options_.ports[from], options_.ports[1 - from],
                      way.one_by_one, kOneByOne)};
    }
    const auto& [last, end] = to.last_frame();
    if (last >= first) {  // else the last one was late, of before
      const double took_ms = std::max(end.at_ms - way.delays.least_ms, 1.0);
      way.bytes_per_s = 1000 * static_cast<double>(end.bytes_read) / took_ms;
      const double air_ms =
          AirMs(bytes) * (last + 1 - first) / static_cast<double>(options_.frames);
      const double surely_ms = took_ms - way.delays.varies_ms;
      way.slower = surely_ms > air_ms + kSurelySlowMs ? surely_ms / air_ms : 1;
    }
    return Ok();
  }

  // As a server answers: a byte's time after the request. If that is too early for the modem of who
  // asks, with longer pauses.
  Status Exchange(size_t from) {
    Way& way = ways_[from];
    if (Arrive() < kPoorAir) {
      return Ok();
    }
    way.exchanges = Arrive() < kGoodAir ? kMoreExchanges : kExchanges;
    for (const unsigned pause_ms : kPausesMs) {
      way.first_byte_ms.clear();
      for (size_t i = 0; i < way.exchanges; ++i) {
        if (i == kFirstFrames && way.first_byte_ms.empty() && Arrive() >= kGoodAir) {
          break;
        }
        PHEROMONE_TRY_STATUS(ExchangeOne(from, pause_ms));
      }
      if (pause_ms == 0) {
        way.answered = way.first_byte_ms.size();
      }
      // Of few that arrive, so many more are lost by chance.
      const double least = Arrive() < kGoodAir ? Arrive() / 3 : 0.5;
      if (static_cast<double>(way.first_byte_ms.size()) >
          least * static_cast<double>(way.exchanges)) {
        way.pause_ms = pause_ms;
        break;
      }
    }
    return Ok();
  }

  Status ExchangeOne(size_t from, unsigned pause_ms) {
    Side& asking = sides_[from];
    Side& answering = sides_[1 - from];
    PHEROMONE_TRY_STATUS(BeQuiet(kPauseMs + pause_ms));
    const std::vector<uint8_t> request = FrameOf(++number_);
    const Clock::time_point begin = Clock::now();
    PHEROMONE_TRY_STATUS(Send(from, request));
    PHEROMONE_TRY_STATUS(Listen(begin + OfMs(AirMs(request.size()) + kPatienceMs),
                                [&] { return answering.Has(number_); }));
    if (!answering.Has(number_)) {
      return Ok();
    }
    PHEROMONE_TRY_STATUS(Listen(Clock::now() + OfMs(AirMs(1) + pause_ms)));
    const std::vector<uint8_t> answer = FrameOf(++number_);
    Expect();
    const Clock::time_point answered = Clock::now();
    PHEROMONE_TRY_STATUS(Send(1 - from, answer));
    PHEROMONE_TRY_STATUS(Listen(answered + OfMs(AirMs(answer.size()) + kPatienceMs),
                                [&] { return asking.Has(number_); }));
    if (asking.Has(number_)) {
      ways_[from].first_byte_ms.push_back(Milliseconds(answered - begin).count() +
                                          asking.chunks().front().at_ms - AirMs(request.size()));
    }
    return Ok();
  }

  const ModemTestOptions& options_;
  std::array<Side, 2> sides_;
  std::array<Way, 2> ways_;
  uint32_t number_ = 0;  // of the last frame
  size_t sender_ = 0;    // who sent it
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
    return way.exchanges == 0 ? std::string("-")
                              : fmt::format("{} of {}", way.answered, way.exchanges);
  });
  PrintRow(test, "  first byte, at most", [](const Way& way) {
    return way.first_byte_ms.empty()
               ? std::string("-")
               : fmt::format("{:.1f} ms",
                             *std::max_element(way.first_byte_ms.begin(), way.first_byte_ms.end()));
  });
}

// What is to be known beside the figures.
void PrintRemarks(const ModemTest& test, const ModemTestOptions& options) {
  if (test.echoed() != 0) {
    fmt::print("The modems return what is sent to them: the server and the robots ignore that.\n");
  }
  if (test.noise() != 0) {
    fmt::print("{} bytes came while nobody sent.\n", test.noise());
  }
  for (const size_t from : {size_t{0}, size_t{1}}) {
    const Way& way = test.way(from);
    if (way.inserted != 0) {
      fmt::print("{} bytes came before frames at {}: the server and the robots ignore them.\n",
                 way.inserted, 2 - from);
    }
    if (way.slower > kSlowAir) {
      fmt::print(
          "From {} to {} the air takes {:.2f} times as long as the ports: set modems and ports to "
          "at most {:.0f} baud.\n",
          1 + from, 2 - from, way.slower, options.baud / way.slower);
    }
  }
}

// Whether a server can have such modems.
bool PrintLink(const ModemTest& test, const ModemTestOptions& options) {
  const unsigned turnaround_ms =
      RoundedUpMs(std::max(test.way(0).delays.least_ms, test.way(1).delays.least_ms));
  const std::string link = LinkText(options.ports[0], options.baud, turnaround_ms,
                                    RoundedUpMs(test.way(1).delays.varies_ms));
  fmt::print("\nFor a server at 1, with such modems on all robots:\n\n{}", link);
  const std::string problems = LinkProblems(link);
  if (!problems.empty()) {
    fmt::print("\nA server does not take it, so these modems do not fit:\n{}\n", problems);
  }
  if (test.Arrive() < kPoorAir) {
    fmt::print(
        "\nThe air loses too many frames for a link, and to tell whether answers may come at once: "
        "look at aerials, power and frequency.\n");
    return false;
  }
  bool fits = problems.empty();
  for (const size_t from : {size_t{0}, size_t{1}}) {
    const Way& way = test.way(from);
    fits = fits && way.pause_ms == 0u;
    if (!way.pause_ms) {
      fmt::print(
          "\nHardly any answer to {} was heard, not even after a pause of {} ms: these modems do "
          "not fit.\n",
          from + 1, kPausesMs.back());
    } else if (*way.pause_ms != 0) {
      fmt::print(
          "\nThe modem of {} heard answers only after a pause of {} ms. No setting makes a server "
          "wait, other than ptt_lead_ms for a modem that is keyed.\n",
          from + 1, *way.pause_ms);
    }
  }
  return fits;
}

}  // namespace

int TestModems(const ModemTestOptions& options) {
  const size_t bytes = FrameOf(1).size();
  const size_t frames = kOneByOne + kExchanges + options.frames;
  const size_t pauses_ms =
      2 * ((kOneByOne + kExchanges) * kPauseMs + kOneByOne * (kOneByOne - 1) / 2 * kPauseStepMs);
  fmt::print("1: {}, 2: {}, {} baud, {} frames of about {} bytes each way: {} s or longer\n",
             options.ports[0], options.ports[1], options.baud, frames, bytes,
             2 * frames * bytes * 10 / options.baud + pauses_ms / 1000);
  static_cast<void>(std::fflush(stdout));
  ModemTest test(options);
  if (const Status run = test.Run(); !run.ok()) {
    return Fail(kFailed, run.error());
  }
  PrintFigures(test, options);
  PrintRemarks(test, options);
  return PrintLink(test, options) ? 0 : kFailed;
}

}  // namespace pheromone::ctl
