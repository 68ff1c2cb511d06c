// A link connects robots to the server. It decodes bytes into frames and encodes frames into bytes,
// passes the frames of one read to the engine as one batch, and sends the answers.
//
//   boost::asio::io_context io;
//   LinkRouter router(&service);
//   const LinkConfig config{.name = "radio-a", .path = "radio-a.pty"};
//   auto link = MakePtyLink(io, config, {.router = &router, .log = log});
//   router.Add(link.get());
//   const Status first_try = link->Start();   // keeps retrying if this failed
//   io.run();                                 // on any number of threads
//   ...
//   link->Stop();                             // io runs dry
//
// A link never ends the program: failures are logged (LinkLog), counted, and retried with capped,
// jittered back-off. Start is called once, before or while the io_context runs, and may wait for
// the driver of a port; the link outlives the run. All other functions are thread-safe. SIGPIPE
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

#include "server/base/result.h"
#include "server/core/engine/event.h"
#include "server/robots/links/admission.h"
#include "server/robots/links/backoff.h"
#include "server/robots/links/link_config.h"
#include "server/robots/links/link_counters.h"
#include "server/robots/links/send_permit.h"
#include "server/robots/links/tap.h"
#include "server/robots/links/usb_port.h"
#include "server/robots/radio/rounds.h"
#include "server/robots/signing/signing.h"

namespace pheromone::links {

enum class Severity { kInfo, kWarning };

/// What a link has to tell the operator.
struct LinkNotice {
  Severity severity = Severity::kWarning;
  std::string source;  ///< "link radio-a"
  std::string what;    ///< "up", "down", or what happened
  std::string why{};   ///< why it is down; where it is up
  std::string then{};  ///< what follows
};

/// One line: "link radio-a: down, the port is gone; retrying".
std::string ToText(const LinkNotice& notice);

/// Receives them. Called from any thread of the io_context.
using LinkLog = std::function<void(const LinkNotice&)>;

/// How long a robot is assumed to wait for an answer on links without a response window: on TCP, up
/// to one second (protocol/README.md, section 8).
constexpr std::chrono::seconds kLongestWait{1};

/// The text for an unexpected exception: "internal error: std::bad_alloc".
Error InternalError(const std::exception_ptr& thrown);

/// Counters and state, written by sessions and read by any thread.
class LinkRecord {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  struct State {
    bool up = false;
    std::string reason;        ///< why it is down, or where it is up
    std::string address{};     ///< while it is up and listens: ADDRESS:PORT
    std::string last_error{};  ///< why it was down last; empty if it never was
    /// When it last came up or went down.
    TimePoint since = std::chrono::steady_clock::now();
    uint64_t failed_attempts = 0;             ///< to open it since it was last up; 0 while up
    std::optional<TimePoint> next_attempt{};  ///< while it is down and waits to retry
    bool silent = false;                      ///< up, but silent for longer than expected
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
  /// Each returns whether to log this: the state changed, or has lasted longer than ten minutes.
  bool SetUp(const std::string& how, const std::string& address = "");
  bool SetDown(const std::string& why, bool attempt_failed = false);
  /// Has no effect while the link is up.
  void SetNextAttempt(TimePoint at);
  void SetSilent(bool silent);

 private:
  bool Set(bool up, const std::string& reason, const std::string& address = "");

  mutable std::mutex mutex_;
  LinkCounters counters_;
  State state_;
  TimePoint last_news_;
};

class LinkRouter;

/// Who sends on a link: this server; another one that has a modem there, too, for now; or always
/// another one.
enum class LinkRole { kServes, kStandby, kElsewhere };

/// What every link is given beside its configuration.
struct LinkContext {
  engine::LinkIndex index = 0;
  LinkRouter* router = nullptr;  ///< outlives the link
  LinkLog log{};
  Tap* tap = nullptr;  ///< outlives the link
  /// Of a port that another server has, too: outlives the link. Null: this server may always send.
  SendPermit* permit = nullptr;
  /// Of this link, on whose strand it is used; outlives the link. Null: nothing is signed.
  signing::Signing* signing = nullptr;
  /// The executor on which ports are opened and closed, which may take a driver seconds: it has one
  /// thread for each link with a port, so that none delays any other. Empty: ports are opened and
  /// closed on the link's own executor.
  boost::asio::any_io_executor aside = {};
  BackoffOptions backoff = {};

  // Tests change these.
  std::function<std::vector<UsbPort>()> list_usb_ports = ListUsbPorts;
  /// From the first HELLO on a shared channel to the first ROUND: radio::ChannelOptions.
  radio::Duration quiet_start = radio::kAwaitedRound;
};

class Link {
 public:
  Link(LinkConfig config, LinkContext context)
      : config_(std::move(config)), context_(std::move(context)), admission_(config_.admission) {}
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  virtual ~Link() = default;

  /// Opens the link. Returns an error if that failed; the link then keeps retrying.
  virtual Status Start() = 0;

  /// Ends the sessions and all other work on the io_context.
  virtual void Stop() = 0;

  /// Sends commands to where their robot was last heard, and deferred answers to their requesters.
  virtual void Send(std::vector<engine::Outgoing> messages) = 0;

  /// Takes other keys, on the link's strand. Without effect on a link that is not signed.
  virtual void SetKeys(signing::Keys keys) = 0;

  /// The address: a path, or ADDRESS:PORT. Empty while it is not known.
  virtual std::string address() const { return state().address; }

  const std::string& name() const { return config_.name; }
  LinkRecord::State state() const { return record_.state(); }
  virtual LinkRole role() const;
  /// The node of a cluster that sends here, if it is known.
  std::string owner() const;
  LinkCounters counters() const { return record_.counters(); }

 protected:
  void ReportUp(const std::string& how, const std::string& address = "");
  /// The link was up and has failed.
  void ReportDown(const std::string& why);
  /// The link could not be opened.
  void ReportFailure(const std::string& why);
  /// Reports an error that does not change the state of the link, with its consequence.
  void ReportError(const Error& error, const std::string& consequence);

  /// The link is up but has received nothing for this long, or receives again.
  void ReportSilence(std::chrono::seconds since);
  void ReportHeardAgain();

  /// Passes the admitted messages of a batch to the engine. `askers`: one for all messages, or one
  /// for each. Immediate answers are appended to `answers`. Not from two threads at once.
  void Handle(std::span<const protocol::Message> batch, std::span<const engine::Asker> askers,
              std::vector<engine::Outgoing>* answers);
  /// Whether an answer is too late, on a link without a response window; if so, counts it.
  bool IsTooLate(const engine::Outgoing& outgoing);
  /// Whether the link serves this client.
  bool Allows(uint8_t id) const { return admission_.Allows(id); }

  /// For the next session.
  TappedLine NextLine() { return {context_.tap, {context_.index, ++lines_, 0}}; }
  bool IsStandby() const { return role() == LinkRole::kStandby; }
  /// Of a message that is not sent.
  void Drop(const protocol::Message& message);
  /// The same, and counts it as one that cannot be delivered.
  void CountUndeliverable(const protocol::Message& message);
  void ApplyKeys(const signing::Keys& keys) const {
    if (context_.signing != nullptr) {
      context_.signing->SetKeys(keys);
    }
  }
  LinkRecord* record() { return &record_; }
  const LinkConfig& config() const { return config_; }
  const LinkContext& context() const { return context_; }

 private:
  void Tell(Severity severity, const std::string& what, const std::string& why,
            const std::string& then) const;
  void TurnAway(const protocol::Message& message, protocol::Reason answer);

  const LinkConfig config_;
  const LinkContext context_;
  Admission admission_;
  std::vector<protocol::Message> admitted_;
  std::vector<engine::Asker> askers_;  // of those
  LinkRecord record_;
  uint32_t lines_ = 0;
};

}  // namespace pheromone::links
