#include "server/operators/web/stream/replays.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <string_view>
#include <utility>
#include <vector>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>

#include "server/operators/web/api/capture_files.h"
#include "server/operators/web/http.h"
#include "server/operators/web/stream/conversation.h"
#include "server/operators/web/stream/entrance.h"
#include "server/operators/web/stream/replay_show.h"
#include "server/operators/web/stream/viewer.h"

namespace pheromone::web {
namespace {

namespace asio = boost::asio;
using ReplayClock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kReplayPeriod{100};
constexpr std::chrono::milliseconds kTurn{5};  // then it is another one's
constexpr char kReadOnly[] = "a recording is replayed: nothing can be changed";

template <typename Unit>
uint64_t ReplayNow() {
  return static_cast<uint64_t>(
      std::chrono::duration_cast<Unit>(ReplayClock::now().time_since_epoch()).count());
}

std::string NameIn(std::string_view target) {
  const auto parsed = ParseTarget(target);
  return parsed && parsed->path.starts_with(kReplayFolder)
             ? parsed->path.substr(std::string_view(kReplayFolder).size())
             : "";
}

}  // namespace

class Replays::Impl : public std::enable_shared_from_this<Impl> {
 public:
  Impl(control::Control* control, Api* api, ReplayOptions options)
      : control_(*control),
        options_(std::move(options)),
        work_(asio::make_work_guard(io_)),
        timer_(io_),
        entrance_(&io_, api, &counters,
                  {.max_guests = options_.max_replays,
                   .too_many = "too many replays",
                   .limit = "at most " + std::to_string(options_.max_replays) + " at once"}) {}

  UpgradeHandler Handler() {
    return {.check = [this](const Request& request) { return Check(request); },
            .take = [this](Upgrade upgrade) { Take(std::move(upgrade)); }};
  }

  void Run() { io_.run(); }

  void Stop() {
    entrance_.Close();
    asio::post(io_, [weak = weak_from_this()] {
      if (const auto self = weak.lock()) {
        self->timer_.cancel();
        for (const auto& session : std::vector(self->sessions_)) {
          session->viewer->Close();
        }
        self->work_.reset();  // it runs dry
      }
    });
  }

  StreamCounters counters;

 private:
  struct Session {
    explicit Session(ReplayShow::Options options, HubOptions hub)
        : show(std::move(options), std::move(hub)) {}
    ReplayShow show;
    std::shared_ptr<Viewer> viewer;
    bool is_working = false;  // a turn of it is queued
  };
  using SessionPtr = std::shared_ptr<Session>;

  // On the server's threads.
  std::optional<Response> Check(const Request& request) {
    auto refused = entrance_.Check(request);
    const std::string name = NameIn(request.target);
    if (!refused && (!IsCaptureName(name) || !name.ends_with(".pcapng"))) {
      refused = Refuse(404, {"cannot replay \"" + name.substr(0, 100) + "\"", "target",
                             "/replay/NAME, with a name that ends in .pcapng and is listed by "
                             "/api/v1/captures"});
      ++counters.refused;
    }
    return refused;
  }

  // On the server's threads.
  void Take(Upgrade upgrade) {
    const auto target = upgrade.message.target();
    const std::string name = NameIn({target.data(), target.size()});
    // Here, since it takes a lock that no thread of low priority may hold.
    const std::string folder = control_.GetCapture().folder;
    entrance_.Take(
        std::move(upgrade), weak_from_this(),
        [this, folder, name](Entrance::Guest guest) { Welcome(std::move(guest), folder, name); });
  }

  void Welcome(Entrance::Guest guest, const std::string& folder, const std::string& name) {
    const auto session = std::make_shared<Session>(
        ReplayShow::Options{
            .folder = folder, .name = name, .knows_states = guest.subprotocol != kSubprotocols[0]},
        HubOptions{.session = "replay-" + std::to_string(++number_),
                   .ros_distro = options_.ros_distro,
                   .click_pheromone = {},
                   .counters = nullptr,
                   .now_us = ReplayNow<std::chrono::microseconds>});
    const std::weak_ptr<Session> weak = session;
    session->viewer = std::make_shared<Viewer>(
        std::move(guest.connection), std::move(guest.place),
        Viewer::Parts{.hub = session->show.hub(),
                      .counters = &counters,
                      .change = [](const StreamChange& /*change*/, const Respond& /*respond*/) {},
                      .leave = [this](const std::shared_ptr<Viewer>& it) { Leave(it); },
                      .write_patience = options_.write_patience,
                      .play =
                          [this, weak](const PlaybackRequest& asked) {
                            if (const SessionPtr it = weak.lock()) {
                              it->viewer->Send(it->show.Take(asked));
                              GoOn(it);
                            }
                          }},
        kReadOnly, "", ReplayNow<std::chrono::milliseconds>());
    sessions_.push_back(session);
    session->viewer->CloseWithServer();
    session->viewer->Start(guest.message, guest.subprotocol);
    GoOn(session);
    if (sessions_.size() == 1) {
      Tick();
    }
  }

  void Leave(const std::shared_ptr<Viewer>& viewer) {
    std::erase_if(sessions_, [&](const SessionPtr& it) { return it->viewer == viewer; });
    entrance_.Leave();
  }

  // Others have their turn first.
  void GoOn(const SessionPtr& session) {
    if (std::exchange(session->is_working, true)) {
      return;
    }
    asio::post(io_, [this, weak = std::weak_ptr<Session>(session)] {
      const SessionPtr it = weak.lock();
      if (it == nullptr || entrance_.is_closed()) {
        return;
      }
      it->is_working = false;
      try {
        if (Work(it)) {
          GoOn(it);
        }
      } catch (const std::exception& /*failure*/) {  // such as: out of memory
        it->viewer->Close();
        throw;
      }
    });
  }

  // True: there is more to be done.
  static bool Work(const SessionPtr& session) {
    const auto end = ReplayClock::now() + kTurn;
    bool has_more = true;
    while (has_more && ReplayClock::now() < end) {
      has_more = session->show.Work(ReplayNow<std::chrono::milliseconds>());
    }
    Show(session);
    return has_more;
  }

  static void Show(const SessionPtr& session) {
    Viewer& viewer = *session->viewer;
    const uint64_t now_ms = ReplayNow<std::chrono::milliseconds>();
    const std::shared_ptr<const Catalogue> before = session->show.catalogue();
    const std::vector<Update> updates = session->show.Make(now_ms);
    const std::shared_ptr<const Catalogue> present = session->show.catalogue();
    if (viewer.awaits_greeting() && present != nullptr) {
      viewer.Greet(present);
      session->show.Begin();
    } else if (before != present) {
      viewer.ChangeCatalogue(present);
    }
    for (StreamMessage& message : session->show.TakeNews()) {
      viewer.Send(std::move(message));
    }
    for (const Update& update : updates) {
      viewer.Offer(update, now_ms);
    }
  }

  // While there are viewers.
  void Tick() {
    if (entrance_.is_closed() || sessions_.empty()) {
      return;
    }
    for (const SessionPtr& session : std::vector(sessions_)) {  // some may leave
      session->viewer->Tick(ReplayNow<std::chrono::milliseconds>(), session->show.time_ns(), false);
      GoOn(session);
    }
    timer_.expires_after(kReplayPeriod);
    timer_.async_wait([this](boost::system::error_code error) {
      if (!error) {
        Tick();
      }
    });
  }

  control::Control& control_;
  const ReplayOptions options_;
  asio::io_context io_{1};
  asio::executor_work_guard<asio::io_context::executor_type> work_;
  asio::steady_timer timer_;
  Entrance entrance_;
  std::vector<SessionPtr> sessions_;
  uint64_t number_ = 0;
};

Replays::Replays(control::Control* control, Api* api, ReplayOptions options)
    : impl_(std::make_shared<Impl>(control, api, std::move(options))) {}

Replays::~Replays() = default;

UpgradeHandler Replays::Handler() {
  return impl_->Handler();
}

void Replays::Run() {
  impl_->Run();
}

void Replays::Stop() {
  impl_->Stop();
}

const StreamCounters& Replays::counters() const {
  return impl_->counters;
}

}  // namespace pheromone::web
