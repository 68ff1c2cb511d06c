#include "server/robots/links/port_link.h"

#include <deque>
#include <optional>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/strand.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "protocol/messages.h"
#include "server/base/counters.h"
#include "server/core/engine/robots_part.h"
#include "server/robots/links/keep_running.h"
#include "server/robots/links/link_router.h"
#include "server/robots/links/port_calls.h"
#include "server/robots/links/session.h"

namespace pheromone::links {
namespace {

namespace asio = boost::asio;

// How often the driver's counters are read and silence is checked.
constexpr std::chrono::milliseconds kBetweenLooks{500};

// For how long after a halt of all one that was not sent is kept: longer than it takes another
// server to take over, and shorter than until somebody drives on by hand.
constexpr std::chrono::seconds kHaltKept{3};
constexpr size_t kMaxKeptHalts = engine::RobotsPart::kBroadcastTransmissions;

// How long what is on the air may take to its end when the link is stopped: several frames have
// that time at 1200 baud. A modem that takes no bytes any more must not hold up the end of the
// daemon.
constexpr std::chrono::seconds kLongestFinish{4};

using Timer = asio::basic_waitable_timer<Clock>;

bool IsHaltOfAll(const protocol::Message& message) {
  protocol::Command command;
  return message.id == protocol::kBroadcastId && protocol::Decode(message, &command) &&
         command.code == protocol::CommandCode::kHalt;
}

bool IsResume(const protocol::Message& message) {
  protocol::Command command;
  return protocol::Decode(message, &command) && command.code == protocol::CommandCode::kResume;
}

radio::ChannelOptions OptionsOf(const LinkConfig& config, const LinkContext& context) {
  using std::chrono::milliseconds;
  radio::ChannelOptions channel;
  channel.signing = context.signing;
  channel.gap_timeout_ms = config.gap_timeout_ms;
  channel.timing.byte = radio::ByteTime(config.baud);
  if (config.lines.ptt != Ptt::kNone) {  // by us, or by the driver
    channel.timing.keyed = true;
    channel.timing.lead = milliseconds(config.lines.ptt_lead_ms);
    channel.timing.tail = milliseconds(config.lines.ptt_tail_ms);
  }
  if (config.medium_access) {
    channel.half_duplex = true;
    channel.timing.turnaround = milliseconds(config.turnaround_ms);
    channel.timing.adapter = milliseconds(config.adapter_latency_ms);
    channel.timing.processing = milliseconds(config.server_delay_ms);
    channel.response_window = milliseconds(config.response_window_ms);
    channel.slot = milliseconds(config.slot_ms);
    channel.quiet_start = context.quiet_start;
  }
  return channel;
}

class PortLink final : public Link {
 public:
  PortLink(asio::io_context& io, std::unique_ptr<Port> port, std::string address,
           const LinkConfig& config, LinkContext context)
      : Link(config, std::move(context)),
        strand_(asio::make_strand(io)),
        port_(std::move(port), this->context().aside),
        address_(std::move(address)),
        options_{OptionsOf(config, this->context()), &port_, this->context().permit,
                 [this](const protocol::Message& message) { OnRefused(message); }},
        silence_(config.silence_s),
        backoff_(this->context().backoff),
        retry_(strand_),
        look_(strand_) {}

  Status Start() override {
    if (permit() != nullptr) {
      permit()->OnChange([this] { asio::post(strand_, [this] { FollowPermit(); }); });
    }
    opened_ = OpenAtFirst();
    Report(opened_);
    Status status = opened_.ok() ? Ok() : opened_.error();
    KeepRunning(
        strand_, [this] { return Run(); },
        [this](const Error& error) { ReportError(error, "the link continues"); });
    return status;
  }

  void Stop() override {
    asio::post(strand_, [this] {
      stopping_ = true;
      retry_.cancel();
      look_.cancel();
      if (session_) {
        session_->Finish();
        retry_.expires_after(kLongestFinish);
        retry_.async_wait([this](const boost::system::error_code& error) {
          if (!error && session_) {
            session_->Close();
          }
        });
      }
    });
  }

  void Send(std::vector<engine::Outgoing> messages) override {
    asio::post(strand_, [this, messages = std::move(messages)] {
      const bool is_standby = IsStandby();
      for (const engine::Outgoing& outgoing : messages) {
        FollowCommand(outgoing.message);
        if (is_standby) {
          LeaveToOwner(outgoing.message);
        } else if (!session_) {
          CountUndeliverable(outgoing.message);
        } else if (options_.channel.half_duplex || !IsTooLate(outgoing)) {
          session_->Send(outgoing);
        }
      }
    });
  }

  void SetKeys(signing::Keys keys) override {
    asio::post(strand_, [this, keys = std::move(keys)] { ApplyKeys(keys); });
  }

  std::string address() const override { return address_; }

 private:
  SendPermit* permit() const { return context().permit; }

  void ReportOpen() {
    std::string how = port_.port().Describe();
    if (IsStandby()) {
      how += owner().empty() ? "; standby" : "; standby: node " + owner() + " sends";
    }
    ReportUp(how);
  }

  // The port of a standby is open, so that it is known whether it can be used; what is heard there
  // is left to the server that sends.
  void FollowPermit() {
    if (!session_ || stopping_) {
      return;
    }
    const bool was_standby = std::exchange(is_standby_, IsStandby());
    if (was_standby && !is_standby_) {
      TakeOver();
    }
    ReportOpen();
  }

  void TakeOver() {
    session_->TakeOver(context().router->MembersOfRounds(context().index, Clock::now()));
    SendKeptHalt();
  }

  void FollowCommand(const protocol::Message& message) {
    if (IsHaltOfAll(message)) {
      halted_at_ = Clock::now();
    } else if (IsResume(message)) {
      halted_at_.reset();
      DropKeptHalts(0);
    }
  }

  // The server that sends here has it, too. But if there is none at this moment, nobody repeats a
  // halt of all: whoever sends here next sends it.
  void LeaveToOwner(const protocol::Message& message) {
    if (IsHaltOfAll(message)) {
      KeepHalt(message);
    } else {
      Drop(message);
    }
  }

  void OnRefused(const protocol::Message& message) {
    if (IsHaltOfAll(message)) {
      KeepHalt(message);
    } else {
      CountUndeliverable(message);
    }
  }

  void KeepHalt(const protocol::Message& halt) {
    kept_halts_.push_back(halt);
    DropKeptHalts(halted_at_ ? kMaxKeptHalts : 0);
  }

  void DropKeptHalts(size_t most) {
    while (kept_halts_.size() > most) {
      Drop(kept_halts_.front());
      kept_halts_.pop_front();
    }
  }

  // One at a time: when it takes over, and whenever it looks.
  void SendKeptHalt() {
    if (halted_at_ && *halted_at_ + kHaltKept < Clock::now()) {
      DropKeptHalts(0);
    }
    if (!kept_halts_.empty() && session_ && !IsStandby()) {
      session_->Send({context().index, 0, kept_halts_.front()});
      kept_halts_.pop_front();
    }
  }

  Result<Descriptor> OpenAtFirst() {
    try {
      return port_.port().Open();
    } catch (...) {
      return InternalError(std::current_exception());
    }
  }

  void Report(const Result<Descriptor>& opened) {
    if (opened.ok()) {
      record()->Count([](LinkCounters& counters) { ++counters.opened; });
      ReportOpen();
    } else {
      ReportFailure(opened.error());
    }
  }

  asio::awaitable<void> ClosePort() {
    co_await port_.Make([](Port& port) { port.Close(); });
    if (permit() != nullptr) {
      permit()->Release();
    }
  }

  // After any exception, the link continues with a closed port.
  asio::awaitable<void> Run() {
    while (!stopping_) {
      std::optional<Error> failure;
      try {
        co_await ConverseAndOpenAgain();
      } catch (...) {
        failure = InternalError(std::current_exception());
      }
      if (failure) {
        look_.cancel();
        retry_.cancel();
        session_.reset();
        ReportDown(*failure);
        opened_ = *failure;
        co_await CloseAfterFailure();
      }
    }
    opened_ = Error{"stopped"};
    co_await CloseAfterFailure();
    record()->SetDown("stopped");
  }

  asio::awaitable<void> CloseAfterFailure() {
    try {
      co_await ClosePort();
    } catch (...) {
      ReportError(InternalError(std::current_exception()), "the port may still be open");
    }
  }

  asio::awaitable<void> ConverseAndOpenAgain() {
    if (opened_.ok()) {
      Descriptor descriptor = std::move(opened_).value();
      opened_ = Error{"closed"};
      co_await Converse(std::move(descriptor));
    }
    if (stopping_) {
      co_return;
    }
    boost::system::error_code ignored;
    retry_.expires_after(backoff_.Next());
    record()->SetNextAttempt(retry_.expiry());
    co_await retry_.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
    if (stopping_) {
      co_return;
    }
    opened_ = co_await port_.Make([](Port& port) { return port.Open(); });
    if (!stopping_) {
      Report(opened_);
    }
  }

  asio::awaitable<void> Converse(Descriptor descriptor) {
    const auto begin = Clock::now();
    const uint32_t frames = record()->counters().received.frames;
    session_.emplace(
        strand_, options_,
        [this](Session* from, auto batch, auto* answers) {
          if (!IsStandby()) {
            const engine::Asker asker = from->asker();
            Handle(batch, {&asker, 1}, answers);
          }
        },
        record(), NextLine());
    silent_ = false;
    line_errors_ = {};
    is_standby_ = IsStandby();
    if (permit() != nullptr && !is_standby_) {
      TakeOver();
    }
    Look();
    const std::string why = co_await session_->Run(std::move(descriptor));
    session_.reset();
    retry_.cancel();
    look_.cancel();
    co_await CountLineErrors();
    if (!stopping_) {
      ReportDown(why);
    }
    // A port that fails right after opening is treated like one that does not open; after a port
    // that has received a message, the delay is reset.
    if (Clock::now() - begin > context().backoff.longest ||
        record()->counters().received.frames != frames) {
      backoff_.Reset();
    }
    co_await ClosePort();
  }

  // Called periodically while the port is open.
  void Look() {
    look_.expires_after(kBetweenLooks);
    look_.async_wait([this](const boost::system::error_code& error) {
      if (!error && session_ && !stopping_) {
        LookForSilence(Clock::now());
        SendKeptHalt();
        asio::co_spawn(strand_, LookAtTheDriver(),
                       [this](const std::exception_ptr& failure) { EndOnException(failure); });
      }
    });
  }

  void EndOnException(const std::exception_ptr& thrown) {
    if (thrown) {
      ReportError(InternalError(thrown), "the port is reopened");
      if (session_) {
        session_->Close();
      }
    }
  }

  // The port's calls keep their order: it is closed after the last of these has returned.
  asio::awaitable<void> LookAtTheDriver() {
    co_await CountLineErrors();
    if (session_ && !stopping_) {
      Look();
    }
  }

  asio::awaitable<void> CountLineErrors() {
    const std::optional<LineErrors> now =
        co_await port_.Make([](Port& port) { return port.errors(); });
    if (now && *now != line_errors_) {
      const LineErrors more = DifferenceOf(*now, line_errors_);
      line_errors_ = *now;
      record()->Count(
          [&more](LinkCounters& counters) { counters.line = SumOf(counters.line, more); });
    }
  }

  // A modem without power looks like an idle line. Reported once.
  void LookForSilence(Clock::time_point now) {
    if (silence_ == std::chrono::seconds::zero()) {
      return;
    }
    const bool silent = now - session_->last_read() > silence_;
    if (silent && !silent_) {
      ReportSilence(silence_);
    } else if (!silent && silent_) {
      ReportHeardAgain();
    }
    silent_ = silent;
  }

  const asio::strand<asio::io_context::executor_type> strand_;
  PortCalls port_;
  Result<Descriptor> opened_ = Error{"not opened yet"};
  const std::string address_;
  const ConversationOptions options_;
  const std::chrono::seconds silence_;
  Backoff backoff_;
  Timer retry_;
  Timer look_;
  LineErrors line_errors_;  // as counted so far, since the port was opened
  bool silent_ = false;
  bool is_standby_ = false;
  // When the last halt of all came here; empty: somebody was to resume after it.
  std::optional<Clock::time_point> halted_at_;
  std::deque<protocol::Message> kept_halts_;
  std::optional<Session> session_;  // while the port is open
  bool stopping_ = false;
};

}  // namespace

std::unique_ptr<Link> MakePortLink(asio::io_context& io, std::unique_ptr<Port> port,
                                   const std::string& address, const LinkConfig& config,
                                   LinkContext context) {
  return std::make_unique<PortLink>(io, std::move(port), address, config, std::move(context));
}

std::unique_ptr<Link> MakePtyLink(asio::io_context& io, const LinkConfig& config,
                                  LinkContext context) {
  return MakePortLink(io, MakePtyPort(config.path), config.path, config, std::move(context));
}

std::unique_ptr<Link> MakeSerialLink(asio::io_context& io, const LinkConfig& config,
                                     LinkContext context) {
  SerialPortOptions port;
  port.name = config.usb ? "USB " + ToText(*config.usb) : config.path;
  port.baud = config.baud;
  port.lines = config.lines;
  port.find_path = [path = config.path, usb = config.usb,
                    list = context.list_usb_ports]() -> Result<std::string> {
    return usb ? ChooseUsbPort(*usb, list()) : Result<std::string>(path);
  };
  const std::string name = port.name;
  return MakePortLink(io, MakeSerialPort(std::move(port)), name, config, std::move(context));
}

}  // namespace pheromone::links
