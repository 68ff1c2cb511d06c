#include "proto_tests/exchange_bench/steady_robots.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <random>
#include <utility>

#include "proto_tests/exchange_bench/fail.h"
#include "proto_tests/exchange_bench/given_up.h"
#include "proto_tests/exchange_bench/open_pty.h"
#include "protocol/decoder.h"
#include "protocol/messages.h"

namespace pheromone::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPeriod{20};
constexpr std::chrono::milliseconds kFailSafe{500};  // protocol/README.md, section 8
constexpr int kPatienceMs = 10'000;                  // for the answer to HELLO

int ConnectUdp(uint16_t port) {
  const int handle = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  if (connect(handle, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    Fail("cannot connect a UDP socket");
  }
  return handle;
}

}  // namespace

// One request under way at a time, one a period; all but the constructor under the owner's lock.
class SteadyRobots::Robot {
 public:
  Robot(const Arena& arena, std::string name, int handle, uint8_t id, bool trace)
      : arena_(arena),
        name_(std::move(name)),
        handle_(handle),
        id_(id),
        trace_(trace),
        random_(id) {
    result_.robot = name_;
    protocol::Message hello;
    std::random_device other;
    protocol::Encode(protocol::HelloRequest{id_, static_cast<uint16_t>(other()), 1, 0}, &hello);
    Send(hello);
    bool greeted = false;
    while (!greeted) {
      pollfd answer{handle_, POLLIN, 0};
      if (poll(&answer, 1, kPatienceMs) != 1) {
        Fail("no answer to HELLO for " + name_);
      }
      Read([&](const protocol::Message& message) {
        protocol::HelloAnswer welcome;
        if (message.id == id_ && protocol::Decode(message, &welcome)) {
          greeted = true;
          seq_ = welcome.last_seq;  // the server may know this robot
        }
      });
    }
    last_right_ = Clock::now();
    next_ = last_right_;
  }
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;
  ~Robot() { close(handle_); }

  int handle() const { return handle_; }
  Clock::time_point next() const { return next_; }

  void Act(Clock::time_point now) {
    if (now < next_) {
      return;
    }
    if (awaits_) {
      if (now < asked_at_ + kFailSafe) {
        next_ = asked_at_ + kFailSafe;
        return;
      }
      ++result_.lost;
      given_up_.Add({pose_, seq_});
      ++seq_;
    }
    Ask(now);
  }

  void ReadAnswers() {
    Read([this](const protocol::Message& answer) { Take(answer); });
  }

  /// The last request that has a right answer was made at this time or later.
  Clock::time_point answered() const { return answered_; }

  SteadyResult Result() {
    const auto now = Clock::now();
    if (unanswered_ && now - first_asked_at_ > kFailSafe) {
      AddTime(now - first_asked_at_);
    }
    if (now - last_right_ > kFailSafe) {
      ++result_.stops;
    }
    return std::exchange(result_, SteadyResult{name_});
  }

 private:
  template <typename Take>
  void Read(Take&& take) {
    std::array<uint8_t, 2048> bytes{};
    for (ssize_t size = 0; (size = read(handle_, bytes.data(), bytes.size())) > 0;) {
      decoder_.PushBlock(bytes.data(), static_cast<size_t>(size), 0, take);
    }
  }

  void Ask(Clock::time_point now) {
    pose_ = random_() % arena_.poses.size();
    asked_at_ = now;
    if (!unanswered_) {
      first_asked_at_ = now;
    }
    awaits_ = unanswered_ = true;
    Send(trace_ ? arena_.Trace(id_, pose_, seq_) : arena_.Sense(id_, pose_));
    next_ = now + kPeriod;
  }

  void Send(const protocol::Message& message) {
    std::array<uint8_t, protocol::kMaxFrame> frame{};
    const size_t size = protocol::EncodeFrame(message, frame.data(), frame.size());
    static_cast<void>(!write(handle_, frame.data(), size));  // a full line loses it
  }

  void Take(const protocol::Message& answer) {
    const auto is_answer_to = [&](const Asked& asked) {
      return trace_ ? arena_.IsTraceAnswer(answer, id_, asked.pose, asked.seq)
                    : arena_.IsSenseAnswer(answer, id_, asked.pose);
    };
    const auto now = Clock::now();
    protocol::ErrorAnswer error;
    if (protocol::Decode(answer, &error) && answer.id == id_) {
      ++result_.refused;
      if (error.seq == (trace_ ? seq_ : 0) && awaits_) {
        // Nothing repeats frames here, and a robot that counts on may be behind (section 7).
        const bool used =
            error.reason != protocol::Reason::kBusy && error.reason != protocol::Reason::kReadOnly;
        seq_ = static_cast<uint8_t>(seq_ + (used ? 1 : 0));
        awaits_ = false;
        next_ = std::max(now, asked_at_ + kPeriod);
      }
    } else if (!awaits_ || !is_answer_to({pose_, seq_})) {
      ++(given_up_.Take(is_answer_to) ? result_.late : result_.wrong);
    } else {
      ++result_.right;
      AddTime(now - first_asked_at_);
      result_.stops += now - last_right_ > kFailSafe ? 1u : 0u;
      last_right_ = now;
      answered_ = asked_at_;
      awaits_ = unanswered_ = false;
      ++seq_;
      next_ = std::max(now, asked_at_ + kPeriod);
    }
  }

  // Of a request, and of those that would have been made while it waited.
  void AddTime(Clock::duration time) {
    result_.times.Add(time);
    for (time -= kPeriod; time > Clock::duration::zero(); time -= kPeriod) {
      result_.times.Add(time);
    }
  }

  const Arena& arena_;
  const std::string name_;
  const int handle_;
  const uint8_t id_;
  const bool trace_;
  std::minstd_rand random_;
  protocol::FrameDecoder decoder_{protocol::kNoGapTimeout};
  bool awaits_ = false;      // an answer to what was asked last
  bool unanswered_ = false;  // no right answer since first_asked_at_
  size_t pose_ = 0;
  uint8_t seq_ = 1;
  GivenUp given_up_;
  Clock::time_point next_;  // when there is something to do
  Clock::time_point asked_at_;
  Clock::time_point first_asked_at_;
  Clock::time_point last_right_;
  Clock::time_point answered_;
  SteadyResult result_;
};

SteadyRobots::SteadyRobots(const Arena& arena, const std::array<std::string, 2>& ptys,
                           uint16_t udp_port) {
  for (const bool trace : {false, true}) {
    const std::string kind = trace ? "TRACE" : "SENSE";
    const uint8_t id = trace ? 2 : 1;
    robots_.push_back(std::make_unique<Robot>(arena, kind + " over a pty",
                                              OpenPty(ptys[trace ? 1 : 0]), id, trace));
    robots_.push_back(
        std::make_unique<Robot>(arena, kind + " over UDP", ConnectUdp(udp_port), id, trace));
  }
  thread_ = std::thread([this] { Run(); });
}

SteadyRobots::~SteadyRobots() {
  stopping_ = true;
  thread_.join();
}

void SteadyRobots::Run() {
  prctl(PR_SET_TIMERSLACK, 1);
  std::vector<pollfd> polled;
  for (const auto& robot : robots_) {
    polled.push_back({robot->handle(), POLLIN, 0});
  }
  while (!stopping_) {
    auto next = Clock::now() + kPeriod;
    {
      const std::lock_guard lock(mutex_);
      for (const auto& robot : robots_) {
        robot->Act(Clock::now());
        next = std::min(next, robot->next());
      }
    }
    const auto wait = std::max(Clock::duration::zero(), next - Clock::now());
    const timespec patience{0, static_cast<long>(wait.count())};
    if (ppoll(polled.data(), polled.size(), &patience, nullptr) > 0) {
      const std::lock_guard lock(mutex_);
      for (const auto& robot : robots_) {
        robot->ReadAnswers();
      }
    }
  }
}

std::vector<SteadyResult> SteadyRobots::Take() {
  std::vector<SteadyResult> results;
  const std::lock_guard lock(mutex_);
  for (const auto& robot : robots_) {
    results.push_back(robot->Result());
  }
  return results;
}

bool SteadyRobots::AwaitAnswers(std::chrono::milliseconds patience) {
  const auto begin = Clock::now();
  while (Clock::now() < begin + patience) {
    {
      const std::lock_guard lock(mutex_);
      if (std::all_of(robots_.begin(), robots_.end(),
                      [begin](const auto& robot) { return robot->answered() >= begin; })) {
        return true;
      }
    }
    std::this_thread::sleep_for(kPeriod);
  }
  return false;
}

}  // namespace pheromone::bench
