#include "server/operators/web/stream/stream.h"

#include <algorithm>
#include <chrono>
#include <random>
#include <string_view>
#include <utility>
#include <vector>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>

#include "server/operators/web/http.h"
#include "server/operators/web/stream/conversation.h"
#include "server/operators/web/stream/entrance.h"
#include "server/operators/web/stream/hub.h"
#include "server/operators/web/stream/pacer.h"
#include "server/operators/web/stream/viewer.h"

namespace pheromone::web {
namespace {

namespace asio = boost::asio;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kTickPeriod{100};

std::string_view HeaderText(boost::beast::string_view text) {
  return {text.data(), text.size()};
}

uint64_t UnixNs() {
  return static_cast<uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                   std::chrono::system_clock::now().time_since_epoch())
                                   .count());
}

template <typename Unit>
uint64_t SteadyTime() {
  return static_cast<uint64_t>(
      std::chrono::duration_cast<Unit>(Clock::now().time_since_epoch()).count());
}

// Without the pauses, which do not count as work.
uint64_t WorkedUs(const Pacer& pacer) {
  return SteadyTime<std::chrono::microseconds>() -
         static_cast<uint64_t>(pacer.paused() / std::chrono::microseconds(1));
}

StreamTime Now() {
  return {SteadyTime<std::chrono::milliseconds>(), UnixNs()};
}

std::string TicketIn(std::string_view target) {
  if (const auto parsed = ParseTarget(target)) {
    for (const auto& [name, value] : parsed->query) {
      if (name == "ticket") {
        return value;
      }
    }
  }
  return {};
}

}  // namespace

// What waits in lanes and in its own queue refers to it weakly: its owner destroys it.
class Stream::Impl : public std::enable_shared_from_this<Impl> {
 public:
  Impl(control::Control* control, Api* api, StreamOptions options, Lane requests)
      : control_(*control),
        api_(*api),
        options_(std::move(options)),
        requests_(std::move(requests)),
        work_(asio::make_work_guard(io_)),
        timer_(io_),
        entrance_(&io_, api, &counters,
                  {.max_guests = options_.max_viewers,
                   .too_many = "too many viewers",
                   .limit = "at most " + std::to_string(options_.max_viewers) +
                            ", web.max_viewers of the configuration"}),
        hub_({.session = std::to_string(UnixNs()),
              .ros_distro = options_.ros_distro,
              .click_pheromone = options_.click_pheromone,
              .counters = &counters,
              .now_us = [this] { return WorkedUs(pacer_); },
              .between_pieces = [this] { pacer_.MayPause(); }}) {}

  UpgradeHandler Handler() {
    return {.check = [this](const Request& request) { return entrance_.Check(request); },
            .take = [this](Upgrade upgrade) { Take(std::move(upgrade)); }};
  }

  void Run() {
    while (io_.run_one() != 0) {
      pacer_.MayPause();
    }
  }

  void Stop() {
    entrance_.Close();
    asio::post(io_, [weak = weak_from_this()] {
      const auto self = weak.lock();
      if (self == nullptr) {
        return;
      }
      self->timer_.cancel();
      self->subscription_.reset();
      const std::vector<std::shared_ptr<Viewer>> viewers = self->viewers_;
      for (const auto& viewer : viewers) {
        viewer->Close();
      }
      self->work_.reset();  // it runs dry
    });
  }

  StreamCounters counters;

 private:
  // On the server's threads.
  void Take(Upgrade upgrade) {
    const auto& message = upgrade.message;
    const std::string ticket = TicketIn(HeaderText(message.target()));
    const std::string header(HeaderText(message[boost::beast::http::field::authorization]));
    const std::string refusal = api_.WhyReadOnly({.method = "POST",
                                                  .target = "viewer",
                                                  .local = upgrade.local,
                                                  .of_viewer = true,
                                                  .authorization = header,
                                                  .client = upgrade.client},
                                                 ticket);
    const std::string warning = ticket.empty() && header.empty() ? "" : refusal;
    const std::string client = upgrade.client;
    entrance_.Take(std::move(upgrade), weak_from_this(),
                   [this, refusal, warning, client](Entrance::Guest guest) {
                     Welcome(std::move(guest), refusal, warning, client);
                   });
  }

  void Welcome(Entrance::Guest guest, const std::string& refusal, const std::string& warning,
               const std::string& client) {
    const auto viewer = std::make_shared<Viewer>(
        std::move(guest.connection), std::move(guest.place),
        Viewer::Parts{
            .hub = &hub_,
            .counters = &counters,
            .change = [this, client](const StreamChange& change,
                                     const Respond& respond) { Change(change, client, respond); },
            .leave = [this](const std::shared_ptr<Viewer>& it) { Leave(it); },
            .write_patience = options_.write_patience},
        refusal, warning, Now().steady_ms);
    viewers_.push_back(viewer);
    viewer->CloseWithServer();
    viewer->Start(guest.message, guest.subprotocol);
    if (!is_ticking_) {
      is_ticking_ = true;
      subscription_ = control_.Subscribe({.max_waiting = 256, .wake = [this] { OnNotice(); }});
      next_tick_ = Clock::now();
      Tick();
    }
  }

  void Leave(const std::shared_ptr<Viewer>& viewer) {
    std::erase(viewers_, viewer);
    entrance_.Leave();
  }

  // On the thread that publishes it.
  void OnNotice() {
    asio::post(io_, [weak = weak_from_this()] {
      if (const auto self = weak.lock()) {
        self->TakeNotices();
      }
    });
  }

  void TakeNotices() {
    if (subscription_ == nullptr) {
      return;
    }
    for (const control::Notice& notice : subscription_->Take().notices) {
      hub_.AddNotice(notice, UnixNs());
    }
  }

  // While there are viewers.
  void Tick() {
    if (entrance_.is_closed() || viewers_.empty()) {
      is_ticking_ = false;
      subscription_.reset();
      return;
    }
    const StreamTime now = Now();
    Needs needs = hub_.Due(now.steady_ms);
    needs.field |= std::any_of(viewers_.begin(), viewers_.end(),
                               [](const auto& viewer) { return viewer->awaits_greeting(); });
    const bool looks = needs.any() && !is_looking_;
    const std::vector<std::shared_ptr<Viewer>> viewers = viewers_;  // some may leave
    for (const auto& viewer : viewers) {
      viewer->Tick(now.steady_ms, now.unix_ns, looks);
    }
    if (looks) {
      is_looking_ = true;
      Look(needs, now);
    }
    next_tick_ = std::max(next_tick_ + kTickPeriod, Clock::now());
    timer_.expires_at(next_tick_);
    timer_.async_wait([this](boost::system::error_code error) {
      if (!error) {
        Tick();
      }
    });
  }

  void Look(const Needs& needs, const StreamTime& now) {
    is_looking_ = RunIn(requests_, [weak = weak_from_this(), needs, now] {
      const auto self = weak.lock();
      if (self == nullptr || self->entrance_.is_closed()) {
        return;
      }
      asio::post(self->io_, [weak, now, views = TakeViews(self->control_, needs)] {
        if (const auto still = weak.lock()) {
          still->Show(views, now);
        }
      });
    });
  }

  void Show(const Views& views, const StreamTime& now) {
    is_looking_ = false;
    if (entrance_.is_closed()) {
      return;
    }
    const std::shared_ptr<const Catalogue> before = hub_.catalogue();
    const std::vector<Update> updates = hub_.Make(views, now);
    const std::vector<std::shared_ptr<Viewer>> viewers = viewers_;
    for (const auto& viewer : viewers) {
      if (viewer->awaits_greeting()) {
        viewer->Greet(hub_.catalogue());
      } else if (before != hub_.catalogue()) {
        viewer->ChangeCatalogue(hub_.catalogue());
      }
      for (const Update& update : updates) {
        viewer->Offer(update, now.steady_ms);
      }
      viewer->Pump();
    }
  }

  // A request to the API; `respond` is called on this thread.
  void Change(const StreamChange& change, const std::string& client, const Respond& respond) {
    Request request{.method = "POST",
                    .target = change.target,
                    .local = true,
                    .of_viewer = true,
                    .body = change.body,
                    .client = client};
    auto answer = [weak = weak_from_this(), respond](Response response) {
      if (const auto self = weak.lock()) {
        asio::post(self->io_, [respond, response = std::move(response)] { respond(response); });
      }
    };
    if (!RunIn(requests_, [weak = weak_from_this(), request, answer] {
          const auto self = weak.lock();
          if (self != nullptr && !self->entrance_.is_closed()) {
            self->api_.Handle(request, answer);
          }
        })) {
      answer(Busy());
    }
  }

  control::Control& control_;
  Api& api_;
  const StreamOptions options_;
  const Lane requests_;
  Pacer pacer_;  // of the thread that runs this
  asio::io_context io_{1};
  asio::executor_work_guard<asio::io_context::executor_type> work_;
  asio::steady_timer timer_;
  Entrance entrance_;
  Hub hub_;
  std::unique_ptr<control::Subscription> subscription_;
  std::vector<std::shared_ptr<Viewer>> viewers_;
  Clock::time_point next_tick_;
  bool is_ticking_ = false;
  bool is_looking_ = false;
};

Stream::Stream(control::Control* control, Api* api, StreamOptions options, Lane requests)
    : impl_(std::make_shared<Impl>(control, api, std::move(options), std::move(requests))) {}

Stream::~Stream() = default;

UpgradeHandler Stream::Handler() {
  return impl_->Handler();
}

void Stream::Run() {
  impl_->Run();
}

void Stream::Stop() {
  impl_->Stop();
}

const StreamCounters& Stream::counters() const {
  return impl_->counters;
}

}  // namespace pheromone::web
