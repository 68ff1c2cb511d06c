// One connection of the HTTP server: requests one after the other, until either side hangs up.
// Internal to this folder; server.h is what others use.
//
//   auto session = std::make_shared<Session>(std::move(connection), traits, handle);
//   asio::co_spawn(session->executor(), session->Run(), ...);
//
// Everything runs on the connection's executor, a strand. Close, and what tells how idle the
// session is, may be called from any thread.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>

#include "server/operators/web/api/pending_response.h"
#include "server/operators/web/connection.h"
#include "server/operators/web/http.h"
#include "server/operators/web/long_answers.h"
#include "server/operators/web/server.h"
#include "server/operators/web/upgrade.h"

namespace pheromone::web {

/// The status for a parser's error; 0: none, since the client has disconnected.
int StatusOf(const boost::beast::error_code& error);

using Message = boost::beast::http::request<boost::beast::http::string_body>;
using Answer = boost::beast::http::response<boost::beast::http::string_body>;

/// Checks the headers of a complete message: a header that decides about access must not be
/// repeated.
std::optional<Problem> ProblemOf(const Message& message);

/// Of RFC 6455, section 4.2.1, what does not depend on the path.
std::optional<Response> CheckHandshake(const Message& message);

/// Ready to be written. Of the answer to HEAD, the header alone is written.
Answer ToAnswer(Response response, unsigned version, bool keep_alive);

/// The properties of a session.
struct SessionTraits {
  bool local = false;
  bool encrypted = false;
  bool once = false;  ///< closes the connection after the first answer
  std::chrono::milliseconds patience{0};
  std::string client = {};  ///< as in Request
  std::shared_ptr<LongAnswers> long_answers;
};

Request ToRequest(const Message& message, const SessionTraits& traits);

class SessionBase {
 public:
  SessionBase() = default;
  SessionBase(const SessionBase&) = delete;
  SessionBase& operator=(const SessionBase&) = delete;
  virtual ~SessionBase() = default;

  /// Ends the session, after answering a request that was passed to the handler; a client that
  /// does not read the answer has a short while.
  virtual void Close() = 0;

  /// A number that increases with the time since which the session is idle; empty while a request
  /// that has come in whole is in progress.
  std::optional<uint64_t> idle_since() const {
    const uint64_t since = idle_since_;
    return since > kClaimed ? std::optional(since) : std::nullopt;
  }

  /// Whether it still waits as `since` says; then it takes no further request, and can be closed.
  bool Claim(uint64_t since) { return idle_since_.compare_exchange_strong(since, kClaimed); }

 protected:
  /// False if it was claimed: there is no request any more.
  bool BeginRequest() {
    uint64_t since = idle_since_;
    return since > kClaimed && idle_since_.compare_exchange_strong(since, kBusy);
  }
  void EndRequest() { idle_since_ = NextTime(); }
  /// It is heard: others have been idle for longer.
  void Touch() {
    uint64_t since = idle_since_;
    if (since > kClaimed) {
      idle_since_.compare_exchange_strong(since, NextTime());
    }
  }

 private:
  static constexpr uint64_t kBusy = 0;
  static constexpr uint64_t kClaimed = 1;

  static uint64_t NextTime() {
    static std::atomic<uint64_t> last{kClaimed};
    return ++last;
  }

  std::atomic<uint64_t> idle_since_{NextTime()};
};

/// Handlers of upgraded connections, by path (Server::OnUpgrade).
using Upgrades = std::map<std::string, UpgradeHandler>;

class Session final : public SessionBase, public std::enable_shared_from_this<Session> {
 public:
  /// `upgrades` outlives the session; null: none.
  Session(Connection connection, SessionTraits traits, Server::Handle handle,
          const Upgrades* upgrades)
      : connection_(std::move(connection)),
        answer_timer_(connection_.get_executor()),
        end_timer_(connection_.get_executor()),
        traits_(std::move(traits)),
        handle_(std::move(handle)),
        upgrades_(upgrades) {}

  boost::asio::any_io_executor executor() { return answer_timer_.get_executor(); }

  boost::asio::awaitable<void> Run();

  void Close() override {
    boost::asio::post(executor(), [self = shared_from_this()] {
      self->closing_ = true;
      if (self->place_ != nullptr) {
        self->place_->Stop();
      } else if (!self->is_answering_) {
        self->connection_.Cancel();
      } else if (!self->is_asking_) {
        self->BeginEnd();
      }
    });
  }

  /// Not null once it has handed its connection on. After Run has ended.
  std::shared_ptr<PlaceState> place() const { return place_; }

 private:
  // Whether another request may follow.
  boost::asio::awaitable<bool> ServeOne();
  const UpgradeHandler* FindUpgrade(const Message& message) const;
  void HandOn(const UpgradeHandler& to, Message message);
  boost::asio::awaitable<Response> Ask(std::function<void(Respond)> ask);
  boost::asio::awaitable<bool> Write(Answer* answer, bool header_alone);
  boost::asio::awaitable<bool> WriteContent(std::shared_ptr<Content> content, uint64_t offset,
                                            uint64_t bytes);
  boost::asio::awaitable<void> HangUp();
  void BeginEnd();

  Connection connection_;
  boost::asio::steady_timer answer_timer_;
  boost::asio::steady_timer end_timer_;
  const SessionTraits traits_;
  const Server::Handle handle_;
  const Upgrades* const upgrades_;
  boost::beast::flat_buffer buffer_{kMaxHeaderBytes + kMaxBodyBytes};
  bool closing_ = false;
  bool is_answering_ = false;          // a request was passed to the handler
  bool is_asking_ = false;             // and its answer is not there yet
  std::shared_ptr<PlaceState> place_;  // the connection belongs to another owner
};

}  // namespace pheromone::web
