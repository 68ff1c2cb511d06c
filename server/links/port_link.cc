#include "server/links/port_link.h"

#include <optional>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/strand.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "server/links/conversation.h"
#include "server/links/port.h"

namespace pheromone::links {
namespace {

namespace asio = boost::asio;

class PortLink final : public Link {
 public:
  PortLink(asio::io_context& io, std::unique_ptr<Port> port, std::string path,
           const ConversationOptions& options, const BackoffOptions& backoff, LinkContext context)
      : Link(std::move(context)),
        strand_(asio::make_strand(io)),
        port_(std::move(port)),
        path_(std::move(path)),
        options_(options),
        backoff_(backoff),
        longest_wait_(backoff.longest),
        retry_(strand_) {}

  Status Start() override {
    Result<Descriptor> first = Open();
    Status status = first.ok() ? Ok() : Status(Error{first.error()});
    asio::co_spawn(strand_, Run(std::move(first)), asio::detached);
    return status;
  }

  void Stop() override {
    asio::post(strand_, [this] {
      stopping_ = true;
      retry_.cancel();
      if (conversation_) {
        conversation_->Close();
      }
    });
  }

  void Send(std::span<const protocol::Message> messages) override {
    asio::post(strand_, [this, copy = std::vector(messages.begin(), messages.end())] {
      for (const protocol::Message& message : copy) {
        if (conversation_) {
          conversation_->Send(message);
        } else {
          record()->Count([](LinkCounters& counters) { ++counters.undeliverable; });
        }
      }
    });
  }

  std::string address() const override { return path_; }

 private:
  Result<Descriptor> Open() {
    Result<Descriptor> opened = port_->Open();
    if (opened.ok()) {
      record()->Count([](LinkCounters& counters) { ++counters.opened; });
      ReportUp(port_->Describe());
    } else {
      ReportDown(opened.error() + "; trying again");
    }
    return opened;
  }

  asio::awaitable<void> Run(Result<Descriptor> opened) {
    while (!stopping_) {
      if (opened.ok()) {
        co_await Converse(std::move(opened).value());
      }
      if (stopping_) {
        break;
      }
      boost::system::error_code ignored;
      retry_.expires_after(backoff_.Next());
      co_await retry_.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
      if (stopping_) {
        break;
      }
      opened = Open();
    }
    port_->Close();
    record()->SetState({false, "stopped"});
  }

  asio::awaitable<void> Converse(Descriptor descriptor) {
    const auto begin = Clock::now();
    conversation_.emplace(
        strand_, options_,
        [this](auto* /*from*/, auto batch, auto* answers) { Handle(batch, answers); }, record());
    const std::string why = co_await conversation_->Run(std::move(descriptor));
    conversation_.reset();
    port_->Close();
    if (!stopping_) {
      ReportDown(why + "; trying again");
    }
    // A port that opens and dies at once is no better than one that does not open.
    if (Clock::now() - begin > longest_wait_) {
      backoff_.Reset();
    }
  }

  const asio::strand<asio::io_context::executor_type> strand_;
  const std::unique_ptr<Port> port_;
  const std::string path_;
  const ConversationOptions options_;
  Backoff backoff_;
  const Clock::duration longest_wait_;
  asio::steady_timer retry_;
  std::optional<Conversation> conversation_;  // while the port is open
  bool stopping_ = false;
};

}  // namespace

std::unique_ptr<Link> MakePtyLink(asio::io_context& io, const PtyOptions& options,
                                  LinkContext context) {
  ConversationOptions conversation;
  conversation.gap_timeout_ms = options.gap_timeout_ms;
  return std::make_unique<PortLink>(io, MakePtyPort(options.path), options.path, conversation,
                                    options.backoff, std::move(context));
}

std::unique_ptr<Link> MakeSerialLink(asio::io_context& io, const SerialOptions& options,
                                     LinkContext context) {
  using std::chrono::milliseconds;
  ConversationOptions conversation;
  conversation.gap_timeout_ms = options.gap_timeout_ms;
  conversation.medium_access = true;
  // Ten bits a byte, start and stop included.
  conversation.byte_time = std::chrono::nanoseconds(10'000'000'000 / int64_t{options.baud});
  conversation.turnaround = milliseconds(options.turnaround_ms);
  conversation.response_window = milliseconds(options.response_window_ms);
  return std::make_unique<PortLink>(io, MakeSerialPort(options.path, options.baud), options.path,
                                    conversation, options.backoff, std::move(context));
}

}  // namespace pheromone::links
