#include "proto_tests/exchange_bench/pty_load.h"

#include <poll.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <deque>
#include <optional>
#include <random>

#include "proto_tests/exchange_bench/given_up.h"
#include "proto_tests/exchange_bench/open_pty.h"
#include "protocol/decoder.h"
#include "protocol/messages.h"
#include "server/daemon/scheduling.h"

namespace pheromone::bench {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kLostAfter{1000};
// The load sleeps at least this long unless an answer comes, so that one turn writes bytes of
// several robots. Without sleep it keeps threads of the kernel and of the server waiting, which
// robots elsewhere would not do.
constexpr std::chrono::microseconds kLeastSleep{40};

// One robot: sends byte after byte, or some at a time, then waits for the answer, then for the
// line.
class Robot {
 public:
  Robot(const Arena& arena, const PtyLoadOptions& options, const std::string& pty, uint32_t seed)
      : arena_(arena),
        options_(options),
        byte_time_(std::chrono::nanoseconds(10'000'000'000 / int64_t{options.baud})),
        random_(seed),
        handle_(OpenPty(pty)) {
    // Robots do not begin at the same moment.
    next_ = Clock::now() + byte_time_ * static_cast<int64_t>(random_() % 32);
    if (options.trace) {
      protocol::Message hello;
      std::random_device other;
      protocol::Encode(protocol::HelloRequest{1, static_cast<uint16_t>(other()), 1, 0}, &hello);
      Begin(hello);
      greeting_ = true;
    } else {
      Ask();
    }
  }
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;
  ~Robot() { close(handle_); }

  int handle() const { return handle_; }
  Clock::time_point next() const { return next_; }

  /// Sends what is due; gives up an answer that does not come.
  void Act(Clock::time_point now, PtyLoadResult* result) {
    while (!done_ && now >= next_ && sent_ < size_) {
      const size_t count = Together();
      if (sent_ + count == size_) {
        asked_at_ = Clock::now();
      }
      static_cast<void>(!write(handle_, &request_[sent_], count));
      sent_ += count;
      next_ += sent_ == size_ ? Clock::duration(kLostAfter)
                              : byte_time_ * static_cast<int64_t>(Together());
    }
    if (!done_ && now >= next_) {
      ++result->lost;
      given_up_.Add({pose_, seq_});
      next_ = now;
      Ask();
    }
  }

  /// Asks no more; done() once what is under way has been answered or lost.
  void Finish() { finishing_ = true; }
  bool done() const { return done_; }

  void Read(PtyLoadResult* result) {
    const auto now = Clock::now();
    std::array<uint8_t, 256> bytes{};
    const ssize_t size = read(handle_, bytes.data(), bytes.size());
    if (size <= 0) {
      return;
    }
    read_at_ = now;
    if (!first_byte_at_) {
      first_byte_at_ = now;
    }
    decoder_.PushBlock(bytes.data(), static_cast<size_t>(size), 0,
                       [&](const protocol::Message& answer) { Take(answer, result); });
  }

 private:
  void Take(const protocol::Message& answer, PtyLoadResult* result) {
    const auto is_answer_to = [&](const Asked& asked) {
      return options_.trace ? arena_.IsTraceAnswer(answer, 1, asked.pose, asked.seq)
                            : arena_.IsSenseAnswer(answer, 1, asked.pose);
    };
    protocol::HelloAnswer hello;
    const bool is_awaited =
        greeting_ ? protocol::Decode(answer, &hello) : is_answer_to({pose_, seq_});
    if (sent_ < size_ || !is_awaited) {
      ++(given_up_.Take(is_answer_to) ? result->late : result->wrong);
      first_byte_at_.reset();  // it was not that of the answer that is awaited
      return;
    }
    const Clock::time_point first_byte_at = first_byte_at_.value_or(read_at_);
    if (greeting_) {
      seq_ = hello.last_seq;  // the server may know this robot
    } else {
      result->times.Add(first_byte_at - asked_at_);
    }
    greeting_ = false;
    std::array<uint8_t, protocol::kMaxFrame> wire{};
    const size_t length = protocol::EncodeFrame(answer, wire.data(), wire.size());
    next_ = first_byte_at + byte_time_ * static_cast<int64_t>(length + 1);
    Ask();
  }

  void Ask() {
    if (finishing_) {
      done_ = true;
      next_ = Clock::time_point::max();
      return;
    }
    pose_ = random_() % arena_.poses.size();
    ++seq_;
    Begin(options_.trace ? arena_.Trace(1, pose_, seq_) : arena_.Sense(1, pose_));
  }

  void Begin(const protocol::Message& message) {
    size_ = protocol::EncodeFrame(message, request_.data(), request_.size());
    sent_ = 0;
    first_byte_at_.reset();
    next_ += byte_time_ * static_cast<int64_t>(Together() - 1);
  }

  size_t Together() const { return std::min(options_.bytes_at_once, size_ - sent_); }

  const Arena& arena_;
  const PtyLoadOptions& options_;
  const Clock::duration byte_time_;
  std::minstd_rand random_;
  const int handle_;
  protocol::FrameDecoder decoder_{protocol::kNoGapTimeout};
  std::array<uint8_t, protocol::kMaxFrame> request_{};
  size_t size_ = 0;
  size_t sent_ = 0;
  size_t pose_ = 0;
  uint8_t seq_ = 0;
  bool greeting_ = false;
  bool finishing_ = false;
  bool done_ = false;
  Clock::time_point next_;  // when there is something to do
  Clock::time_point asked_at_;
  Clock::time_point read_at_;
  GivenUp given_up_;
  std::optional<Clock::time_point> first_byte_at_;
};

}  // namespace

PtyLoadResult RunPtyLoad(const Arena& arena, const PtyLoadOptions& options) {
  daemon::TakeShortTurns();  // robots are on other machines: they do not keep the server's waiting
  prctl(PR_SET_TIMERSLACK, 1);  // bytes are less than 0.1 ms apart
  PtyLoadResult result;
  std::deque<Robot> robots;
  std::vector<pollfd> polled;
  for (const std::string& pty : options.ptys) {
    robots.emplace_back(arena, options, pty, static_cast<uint32_t>(robots.size() + 1));
    polled.push_back({robots.back().handle(), POLLIN, 0});
  }
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(options.seconds));
  while (!std::all_of(robots.begin(), robots.end(), [](const Robot& it) { return it.done(); })) {
    const auto now = Clock::now();
    auto next = now + kLostAfter;
    for (Robot& robot : robots) {
      if (now >= end) {
        robot.Finish();
      }
      robot.Act(now, &result);
      next = std::min(next, robot.next());
    }
    const auto wait = std::max<Clock::duration>(kLeastSleep, next - Clock::now());
    const timespec patience{static_cast<time_t>(wait / std::chrono::seconds(1)),
                            static_cast<long>((wait % std::chrono::seconds(1)).count())};
    if (ppoll(polled.data(), polled.size(), &patience, nullptr) <= 0) {
      continue;
    }
    for (size_t i = 0; i < robots.size(); ++i) {
      if (polled[i].revents != 0) {
        robots[i].Read(&result);
      }
    }
  }
  return result;
}

}  // namespace pheromone::bench
