// A link: a way for robots to reach the server. It turns bytes into frames and back, hands the
// frames of one read to the engine as one batch, and sends what comes back.
//
//   boost::asio::io_context io;
//   Switchboard switchboard(&service);
//   auto link = MakePtyLink(io, {.path = "radio-a.pty"}, {"radio-a", 0, &switchboard, log});
//   switchboard.Add(link.get());
//   const Status first_try = link->Start();   // goes on trying if this failed
//   io.run();                                 // on as many threads as you like
//   ...
//   link->Stop();                             // io runs dry
//
// A link never ends the program: what fails is told (LinkLog), counted, and tried again with
// capped, jittered back-off. Start is called once, before or while the io_context runs, and may
// wait for a port's driver; the link outlives the run. All other functions are thread-safe. SIGPIPE
// must be ignored.
#pragma once

#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <boost/asio/any_io_executor.hpp>

#include "protocol/decoder.h"
#include "server/base/result.h"
#include "server/engine/event.h"
#include "server/links/admission.h"
#include "server/links/modem_lines.h"
#include "server/links/tap.h"

namespace pheromone::links {

enum class Severity { kInfo, kWarning };

/// Where a link says what an operator should know. Called from any thread of the io_context.
using LinkLog = std::function<void(Severity, const std::string&)>;

struct LinkCounters {
  protocol::DecoderCounters received;  ///< what became of the bytes that came in
  LineErrors line;                     ///< serial ports whose driver counts them
  uint64_t bytes_in = 0;
  uint64_t bytes_out = 0;
  uint64_t frames_out = 0;
  uint64_t opened = 0;               ///< ports opened, connections accepted
  uint64_t late_answers = 0;         ///< not sent: nobody waits for them any longer
  uint64_t dropped_answers = 0;      ///< not sent: nobody read what was sent before
  uint64_t withheld_errors = 0;      ///< not sent: a second ERROR within a response window
  uint64_t undeliverable = 0;        ///< not sent: nobody is connected, or no longer
  uint64_t dropped_connections = 0;  ///< to make room for another
  uint64_t not_allowed = 0;          ///< messages of clients that this link does not serve
  uint64_t too_many = 0;             ///< messages beyond the limits of the request rate
  uint64_t datagrams_in = 0;         ///< UDP
  uint64_t oversize_datagrams = 0;   ///< of them: longer than what is taken, and discarded
  uint64_t dropped_datagrams = 0;    ///< thrown away by the system, as they came too fast
  /// When the last bytes came in; nothing: none did since the start.
  std::optional<std::chrono::steady_clock::time_point> heard{};
};

/// How long a robot is thought to wait for an answer where no response window says so: who is on
/// TCP may wait for a second (protocol/README.md, section 8).
constexpr std::chrono::seconds kLongestWait{1};

/// In words, what was not meant to be thrown: "internal error: std::bad_alloc".
Error InternalError(const std::exception_ptr& thrown);

/// Counters and state that conversations write and anyone reads.
class LinkRecord {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  struct State {
    bool up = false;
    std::string reason;        ///< why it is down, or how it is reached
    std::string last_error{};  ///< why it was down last; empty: it never was
    /// When it came up or went down.
    TimePoint since = std::chrono::steady_clock::now();
    uint64_t failed_attempts = 0;             ///< to come up, since it was up; 0 while it is
    std::optional<TimePoint> next_attempt{};  ///< while it is down and waits for it
    bool silent = false;                      ///< up, but suspiciously quiet
  };

  template <typename Change>
  void Count(Change&& change) {
    const std::lock_guard lock(mutex_);
    change(counters_);
  }
  LinkCounters counters() const {
    const std::lock_guard lock(mutex_);
    return counters_;
  }
  State state() const {
    const std::lock_guard lock(mutex_);
    return state_;
  }
  /// Each returns whether this is news: another state, or the same one for longer than ten minutes.
  bool SetUp(const std::string& how);
  bool SetDown(const std::string& why, bool attempt_failed = false);
  /// Nothing happens while it is up.
  void SetNextAttempt(TimePoint at);
  void SetSilent(bool silent);

 private:
  bool Set(bool up, const std::string& reason);

  mutable std::mutex mutex_;
  LinkCounters counters_;
  State state_;
  TimePoint last_news_;
};

class Switchboard;

/// What every link is given.
struct LinkContext {
  std::string name;
  engine::LinkIndex index = 0;
  Switchboard* switchboard = nullptr;  ///< outlives the link
  LinkLog log;
  Tap* tap = nullptr;  ///< outlives the link
  AdmissionOptions admission = {};
  /// Where ports are opened and closed, which may take a driver seconds: an executor that has a
  /// thread for each link with a port, so that none of them holds up anybody. Empty: it is done
  /// where the link's bytes are.
  boost::asio::any_io_executor aside = {};
};

class Link {
 public:
  explicit Link(LinkContext context)
      : context_(std::move(context)), admission_(context_.admission) {}
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  virtual ~Link() = default;

  /// Opens what is to be opened. An error tells why that failed; the link then tries again.
  virtual Status Start() = 0;

  /// Ends the conversations and everything else that keeps the io_context busy.
  virtual void Stop() = 0;

  /// Sends commands, to where their robot was heard last, and answers that had to wait, to who
  /// asked for them.
  virtual void Send(std::vector<engine::Outgoing> messages) = 0;

  /// Where it is reached: a path, or ADDRESS:PORT. Empty while that is not known.
  virtual std::string address() const = 0;

  const std::string& name() const { return context_.name; }
  LinkRecord::State state() const { return record_.state(); }
  LinkCounters counters() const { return record_.counters(); }

 protected:
  void ReportUp(const std::string& how);
  /// It was up and is no longer.
  void ReportDown(const std::string& why);
  /// It could not be brought up.
  void ReportFailure(const std::string& why);
  /// Something went wrong that is not the link's state, with this consequence.
  void ReportError(const Error& error, const std::string& consequence);

  /// Up, but nothing was heard for so long; or heard again.
  void ReportSilence(std::chrono::seconds since);
  void ReportHeardAgain();

  /// Hands a batch to the engine, without what the link does not let in. `askers`: one that is
  /// theirs, or one for each message. What can be answered at once is appended to `answers`. Not
  /// from two threads at once.
  void Handle(std::span<const protocol::Message> batch, std::span<const engine::Asker> askers,
              std::vector<engine::Outgoing>* answers);
  /// Whether an answer comes too late, on a link without a response window. Then it is counted.
  bool IsTooLate(const engine::Outgoing& outgoing);
  /// Whether the link serves this client.
  bool Allows(uint8_t id) const { return admission_.Allows(id); }

  /// For the next conversation.
  TappedLine NextLine() { return {context_.tap, {context_.index, ++lines_, 0}}; }
  /// Counts a message that cannot be sent to anyone.
  void CountUndeliverable(const protocol::Message& message);
  LinkRecord* record() { return &record_; }
  const boost::asio::any_io_executor& aside() const { return context_.aside; }

 private:
  void TurnAway(const protocol::Message& message, protocol::Reason answer);

  const LinkContext context_;
  Admission admission_;
  std::vector<protocol::Message> admitted_;
  std::vector<engine::Asker> askers_;  // of those
  LinkRecord record_;
  uint32_t lines_ = 0;
};

}  // namespace pheromone::links
