#include "server/cluster/peers.h"

#include <algorithm>
#include <exception>
#include <list>
#include <optional>
#include <utility>
#include <variant>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/system/error_code.hpp>

#include "server/cluster/peer_connection.h"
#include "server/cluster/peer_tls.h"
#include "server/net/listen.h"
#include "server/robots/links/backoff.h"
#include "server/robots/links/keep_running.h"
#include "server/robots/links/link.h"

namespace pheromone::cluster {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;
using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

constexpr milliseconds kBetweenChecks{50};
constexpr milliseconds kAfterTrouble{200};  // out of descriptors, perhaps

std::vector<std::string> NamesOf(const std::map<std::string, Endpoint>& nodes) {
  std::vector<std::string> names;
  for (const auto& [name, address] : nodes) {
    names.push_back(name);
  }
  return names;
}

}  // namespace

class Peers::Impl : public std::enable_shared_from_this<Impl> {
 public:
  Impl(asio::any_io_executor executor, PeersSettings settings, PeersCallbacks callbacks)
      : executor_(std::move(executor)),
        settings_(std::move(settings)),
        callbacks_(std::move(callbacks)),
        tls_(std::make_shared<const PeerTls>(settings_.secret, settings_.own.cluster,
                                             NamesOf(settings_.nodes), settings_.own.node)),
        acceptor_(executor_),
        trouble_(executor_),
        checks_(executor_) {
    settings_.secret.clear();  // PeerTls has it
    uint32_t seed = settings_.seed;
    for (const auto& [name, address] : settings_.nodes) {
      if (name != settings_.own.node) {
        const links::BackoffOptions pauses{settings_.times.first_pause,
                                           settings_.times.longest_pause, ++seed};
        nodes_.try_emplace(name, executor_, address, pauses);
      }
    }
  }

  Status Listen() {
    const Endpoint& own = settings_.nodes.at(settings_.own.node);
    PHEROMONE_TRY_STATUS(pheromone::Listen(own, &acceptor_, [this] {
      error_code ignored;
      acceptor_.set_option(tcp::acceptor::reuse_address(true), ignored);
    }));
    // Whatever has failed is not tried again at once.
    Keep([again = false](Impl* self) mutable {
      return self->AcceptAll(std::exchange(again, true));
    });
    Keep([](Impl* self) { return self->CheckTimes(); });
    for (auto& [name, node] : nodes_) {
      if (settings_.own.node < name) {
        Keep([&name = name, &node = node, again = false](Impl* self) mutable {
          return self->Dial(&name, &node, std::exchange(again, true));
        });
      }
    }
    return Ok();
  }

  uint16_t port() const {
    error_code ignored;
    return acceptor_.local_endpoint(ignored).port();
  }

  bool Send(const std::string& to, const std::string& frame, Lane lane) {
    const auto found = nodes_.find(to);
    return found != nodes_.end() && found->second.is_up() && found->second.up->Send(frame, lane);
  }

  size_t SendAll(const std::string& frame, Lane lane) {
    size_t count = 0;
    for (auto& [name, node] : nodes_) {
      count += node.is_up() && node.up->Send(frame, lane) ? 1u : 0u;
    }
    return count;
  }

  bool IsUp(const std::string& name) const {
    const auto found = nodes_.find(name);
    return found != nodes_.end() && found->second.is_up();
  }

  void SetId(const std::string& id) { settings_.own.id = id; }

  std::vector<PeerState> states() const {
    std::vector<PeerState> states;
    for (const auto& [name, node] : nodes_) {
      PeerState& state = states.emplace_back();
      state.node = name;
      state.is_up = node.is_up();
      state.since = node.since;
      state.why_down = node.why_down;
      state.program = node.program;
      state.times_up = node.times_up;
      if (node.up != nullptr) {
        state.heard = node.up->heard();
        state.queued_bytes = node.up->queued_bytes();
      }
    }
    return states;
  }

  StrangerState strangers() const { return strangers_; }

  void Stop() {
    error_code ignored;
    is_stopped_ = true;
    acceptor_.close(ignored);
    trouble_.cancel();
    checks_.cancel();
    for (auto& [name, node] : nodes_) {
      node.pause.cancel();
    }
    for (const auto& connection : open_) {
      connection->Close("stopped");
    }
  }

 private:
  using Connection = std::shared_ptr<PeerConnection>;

  struct Node {
    Node(const asio::any_io_executor& executor, Endpoint at, const links::BackoffOptions& pauses)
        : address(std::move(at)), backoff(pauses), pause(executor) {}

    bool is_up() const { return up != nullptr && up->is_up(); }

    const Endpoint address;
    links::Backoff backoff;
    asio::steady_timer pause;  // before it is dialed again
    Connection up;             // null: it is down
    uint64_t instance = 0;     // of its process
    Clock::time_point since = Clock::now();
    std::string why_down;
    std::string program;
    uint64_t times_up = 0;
  };

  template <typename Begin>
  void Keep(Begin begin) {
    const auto self = shared_from_this();
    links::KeepRunning(
        executor_, [self, begin]() mutable { return begin(self.get()); },
        [self](const Error& error) { self->Warn(error); });
  }

  // `pauses`: something has failed before.
  asio::awaitable<void> AcceptAll(bool pauses) {
    const auto self = shared_from_this();
    while (!is_stopped_) {
      error_code error;
      if (pauses) {
        pauses = false;
        trouble_.expires_after(kAfterTrouble);
        co_await trouble_.async_wait(ErrorTo(&error));
        continue;
      }
      tcp::socket socket = co_await acceptor_.async_accept(ErrorTo(&error));
      pauses = error.failed();
      if (!error && !is_stopped_) {
        MakeRoom();
        asio::co_spawn(executor_, Serve(Add(std::move(socket), "")),
                       [self](const std::exception_ptr& thrown) {
                         if (thrown) {
                           self->Warn(links::InternalError(thrown));
                         }
                       });
      }
    }
  }

  // Those who were accepted and are nobody yet are limited. A node of the cluster needs some
  // milliseconds, and so is not the oldest.
  void MakeRoom() {
    const auto is_stranger = [](const Connection& it) {
      return !it->dials() && !it->is_up() && !it->is_closed();
    };
    if (static_cast<size_t>(std::count_if(open_.begin(), open_.end(), is_stranger)) >=
        kMaxStrangers) {
      (*std::find_if(open_.begin(), open_.end(), is_stranger))
          ->Close("closed to make room for others");
    }
  }

  asio::awaitable<void> Dial(const std::string* name, Node* node, bool pauses) {
    const auto self = shared_from_this();
    for (; !is_stopped_; pauses = true) {
      error_code error;
      if (pauses) {
        node->pause.expires_after(node->backoff.Next());
        co_await node->pause.async_wait(ErrorTo(&error));
      }
      if (is_stopped_) {
        co_return;
      }
      const Connection it = Add(tcp::socket(executor_), *name);
      const tcp::endpoint to(asio::ip::make_address(node->address.address, error),
                             node->address.port);
      if (!error) {
        co_await it->socket().async_connect(to, ErrorTo(&error));
      }
      if (error) {
        it->Close("cannot connect to " + ToText(node->address) + ": " + error.message());
      }
      co_await Serve(it);
    }
  }

  Connection Add(tcp::socket socket, const std::string& dials) {
    return open_.emplace_back(std::make_shared<PeerConnection>(std::move(socket), tls_, dials));
  }

  // Until it ends.
  asio::awaitable<void> Serve(Connection it) {
    const auto self = shared_from_this();
    std::string why;
    try {
      why = co_await Converse(it);
    } catch (const std::exception& exception) {
      why = exception.what();
    }
    it->Close(why);
    open_.remove(it);
    End(it);
  }

  // Why it has ended.
  asio::awaitable<std::string> Converse(Connection it) {
    if (it->is_closed()) {
      co_return it->why();
    }
    const Status secure = co_await it->ShakeHands();
    if (!secure.ok()) {
      co_return secure.error();
    }
    const std::string greeting = EncodePeerMessage(settings_.own).value();
    if (it->dials()) {
      it->Send(greeting, Lane::kUrgent);
    }
    const Result<PeerMessage> first = co_await it->Receive();
    if (!first.ok()) {
      co_return first.error();
    }
    const auto* theirs = std::get_if<Greeting>(&first.value());
    if (theirs == nullptr) {
      co_return "found a message of type " + std::to_string(first.value().index()) +
          ", expected a greeting";
    }
    Node* const node = &nodes_.at(it->node());
    const Status good = Check(it, *theirs);
    if (good.ok() && node->is_up() && node->instance != theirs->instance) {
      co_return "node " + it->node() + " is up, and another machine, " + it->address() +
          ", says that it is this node: expected one of each name";
    }
    if (!it->dials()) {
      it->Send(greeting, Lane::kUrgent);
    }
    if (!good.ok()) {
      co_await it->Flush();
      co_return good.error();
    }
    Begin(it, *theirs, node);
    while (!it->is_closed()) {
      Result<PeerMessage> message = co_await it->Receive();
      if (!message.ok()) {
        co_return message.error();
      }
      if (std::holds_alternative<Greeting>(message.value())) {
        co_return "found a second greeting";
      }
      if (!is_stopped_ && callbacks_.on_message) {
        callbacks_.on_message(it->node(), std::move(message).value());
      }
    }
    co_return it->why();
  }

  Status Check(const Connection& it, const Greeting& theirs) const {
    PHEROMONE_TRY_STATUS(CheckGreeting(settings_.own, theirs));
    if (theirs.node != it->node()) {
      return Error{"node " + it->node() + " says that it is node " + theirs.node};
    }
    return Ok();
  }

  void Begin(const Connection& it, const Greeting& theirs, Node* node) {
    if (node->up != nullptr) {  // its process has found the last one dead
      node->up->Close("replaced by a new connection");
      End(node->up);
    }
    if (is_stopped_) {
      return;
    }
    node->up = it;
    node->instance = theirs.instance;
    node->since = Clock::now();
    node->program = theirs.versions.program;
    ++node->times_up;
    node->backoff.Reset();
    it->SetUp();
    if (callbacks_.on_up) {
      callbacks_.on_up(it->node(), theirs);
    }
  }

  void End(Connection it) {
    const auto found = nodes_.find(it->node());
    if (!it->EndOnce() || is_stopped_) {
      return;
    }
    if (found == nodes_.end() || (found->second.up != nullptr && found->second.up != it)) {
      ++strangers_.count;
      strangers_.last = it->address() + ": " + it->why();
      Warn("a connection that is of no node was closed: " + strangers_.last);
      return;
    }
    Node& node = found->second;
    node.why_down = it->why();
    if (node.up == it) {
      node.up = nullptr;
      node.since = Clock::now();
      if (callbacks_.on_down) {
        callbacks_.on_down(found->first, it->why());
      }
    }
  }

  // Anybody can cause them, so few are told.
  void Warn(const std::string& text) {
    const Clock::time_point now = Clock::now();
    if (is_stopped_ || !callbacks_.on_warning) {
      return;
    }
    if (warned_ && now - *warned_ < settings_.times.quiet) {
      ++untold_;
      return;
    }
    warned_ = now;
    const uint64_t untold = std::exchange(untold_, 0);
    callbacks_.on_warning(
        text + (untold == 0 ? "" : "; " + std::to_string(untold) + " more since the last warning"));
  }

  asio::awaitable<void> CheckTimes() {
    const auto self = shared_from_this();
    while (!is_stopped_) {
      error_code ignored;
      checks_.expires_after(kBetweenChecks);
      co_await checks_.async_wait(ErrorTo(&ignored));
      const Clock::time_point now = Clock::now();
      for (const Connection& connection : open_) {
        connection->CheckTimes(now, settings_.times);
      }
    }
  }

  const asio::any_io_executor executor_;
  PeersSettings settings_;
  const PeersCallbacks callbacks_;
  const std::shared_ptr<const PeerTls> tls_;
  tcp::acceptor acceptor_;
  asio::steady_timer trouble_;
  asio::steady_timer checks_;
  bool is_stopped_ = false;
  std::map<std::string, Node> nodes_;  // the others
  std::list<Connection> open_;         // the oldest first
  StrangerState strangers_;
  std::optional<Clock::time_point> warned_;
  uint64_t untold_ = 0;  // since then
};

Peers::Peers(asio::any_io_executor executor, PeersSettings settings, PeersCallbacks callbacks)
    : impl_(
          std::make_shared<Impl>(std::move(executor), std::move(settings), std::move(callbacks))) {}

Peers::~Peers() {
  Stop();
}

Status Peers::Listen() {
  return impl_->Listen();
}

uint16_t Peers::port() const {
  return impl_->port();
}

bool Peers::Send(const std::string& node, const PeerMessage& message) {
  const Result<std::string> frame = EncodePeerMessage(message);
  return frame.ok() && impl_->Send(node, frame.value(), LaneOf(message));
}

size_t Peers::SendAll(const PeerMessage& message) {
  const Result<std::string> frame = EncodePeerMessage(message);
  return frame.ok() ? impl_->SendAll(frame.value(), LaneOf(message)) : 0;
}

bool Peers::IsUp(const std::string& node) const {
  return impl_->IsUp(node);
}

void Peers::SetId(const std::string& id) {
  impl_->SetId(id);
}

std::vector<PeerState> Peers::states() const {
  return impl_->states();
}

StrangerState Peers::strangers() const {
  return impl_->strangers();
}

void Peers::Stop() {
  impl_->Stop();
}

}  // namespace pheromone::cluster
