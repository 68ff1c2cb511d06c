#include "server/daemon/http_front_end.h"

#include <spdlog/spdlog.h>

#include <cstdlib>
#include <exception>
#include <functional>
#include <string>
#include <thread>
#include <utility>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>

#include "server/config/folders.h"
#include "server/daemon/scheduling.h"
#include "server/daemon/work_queue.h"
#include "server/operators/web/api/api.h"
#include "server/operators/web/api/metrics.h"
#include "server/operators/web/server.h"
#include "server/operators/web/stream/replays.h"
#include "server/operators/web/stream/stream.h"

namespace pheromone::daemon {
namespace {

// The maximum number of waiting requests; further ones are refused.
constexpr size_t kMaxWaiting = 16;
// At most one read of a file at a time for each connection that a server has.
constexpr size_t kMaxFileReads = 256;

}  // namespace

class HttpFrontEnd::Impl {
 public:
  Impl(control::Control* control, const config::ControlSettings& control_settings,
       config::WebSettings web_settings)
      : long_work_({.name = "a request", .max_waiting = kMaxWaiting}),
        pictures_({.name = "a picture", .max_waiting = kMaxWaiting, .yields = true}),
        files_({.name = "a download", .max_waiting = kMaxFileReads, .yields = true}),
        api_(control,
             {.token = web_settings.token,
              .hosts = web_settings.hosts,
              .origins = web_settings.origins,
              .web_root = web_settings.root,
              .more_metrics =
                  [this] {
                    return web::StreamMetrics(stream_.counters(), replays_.counters()) +
                           (web_.tls ? web::TlsMetrics(tls_server_.tls_counters()) : "");
                  }},
             {.long_work = [this](web::Work work) { return long_work_.Add(std::move(work)); },
              .pictures = [this](web::Work work) { return pictures_.Add(std::move(work)); },
              .requests =
                  [this](web::Work work) {
                    boost::asio::post(io_, std::move(work));
                    return true;
                  },
              .files = [this](web::Work work) { return files_.Add(std::move(work)); }}),
        stream_(control, &api_,
                {.max_viewers = web_settings.max_viewers,
                 .ros_distro = web_settings.ros_distro,
                 .click_pheromone = web_settings.click_pheromone},
                [this](web::Work work) {
                  boost::asio::post(io_, std::move(work));
                  return true;
                }),
        replays_(control, &api_, {.ros_distro = web_settings.ros_distro}),
        socket_path_(config::ControlSocket(control_settings, std::getenv("RUNTIME_DIRECTORY"))),
        server_(io_,
                {.socket_path = socket_path_,
                 .listen = web_settings.listen,
                 .is_urgent = web::IsUrgent,
                 .tell = [](const std::string& text) { spdlog::warn("{}", text); }},
                [this](web::Request request, const web::Respond& respond) {
                  api_.Handle(std::move(request), respond);
                }),
        tls_server_(tls_io_,
                    {.socket_path = {},
                     .listen = web_settings.listen,
                     .is_urgent = web::IsUrgent,
                     .tell = [](const std::string& text) { spdlog::warn("{}", text); }},
                    // A thread of low priority must not hold the lock for which robots wait.
                    [this](web::Request request, web::Respond respond) {
                      boost::asio::post(io_, [this, request = std::move(request),
                                              respond = std::move(respond)]() mutable {
                        api_.Handle(std::move(request), respond);
                      });
                    }),
        web_(std::move(web_settings)) {
    for (web::Server* server : {&server_, &tls_server_}) {
      server->OnUpgrade("/", stream_.Handler());
      server->OnUpgrade(web::kReplayFolder, replays_.Handler());
    }
  }

  bool Open() {
    if (!web_.listen.address.empty() && !OpenPort()) {
      return false;
    }
    if (!socket_path_.empty()) {
      const Status listening = server_.ListenOnSocket();
      if (!listening.ok()) {
        spdlog::critical(
            "control: {}; a server that pheromonectl cannot reach does not start: see socket in "
            "[control]",
            listening.error());
        return false;
      }
      spdlog::info("control: {}", socket_path_);
    }
    stream_thread_ = std::thread([this] {
      YieldToOthers();
      Run("stream", [this] { stream_.Run(); });
    });
    replay_thread_ = std::thread([this] {
      YieldToOthers();
      Run("replay", [this] { replays_.Run(); });
    });
    thread_ = std::thread([this] {
      TakeShortTurns();  // it takes views under the lock for which robots wait
      Run("web", [this] { io_.run(); });
    });
    return true;
  }

  void SetCertificate(const Certificate& certificate) {
    const CheckedCertificate checked = CheckCertificate(certificate);
    if (web_.tls && checked.context != nullptr) {
      tls_server_.SetCertificate(checked.context);
      spdlog::info("web: certificate valid until {}", checked.valid_until);
    }
  }

  void Close() {
    server_.Stop();
    tls_server_.Stop();
    stream_.Stop();
    replays_.Stop();
    for (std::thread* thread : {&stream_thread_, &replay_thread_}) {
      if (thread->joinable()) {
        thread->join();
      }
    }
    long_work_.Close();
    pictures_.Close();
    files_.Close();
    for (std::thread* thread : {&thread_, &tls_thread_}) {
      if (thread->joinable()) {
        thread->join();
      }
    }
  }

 private:
  bool OpenPort() {
    if (web_.tls) {
      SetCertificate(*web_.tls);
    }
    web::Server& server = web_.tls ? tls_server_ : server_;
    const Status listening = server.ListenOnPort();
    if (!listening.ok()) {
      spdlog::critical("web: {}; choose another one with listen in [web]", listening.error());
      return false;
    }
    spdlog::info("web: {}://{}/, {}", web_.tls ? "https" : "http",
                 ToText(Endpoint{web_.listen.address, server.port()}),
                 !web_.token.empty()
                     ? "changes require the token in " + config::AbsolutePath(web_.token_file)
                 : web_.token_file.empty()
                     ? "read-only; with token_file in [web] the server makes a token for changes"
                     : std::string("read-only"));
    if (web_.tls) {
      tls_thread_ = std::thread([this] {
        YieldToOthers();
        Run("tls", [this] { tls_io_.run(); });
      });
    }
    return true;
  }

  static void Run(const char* name, const std::function<void()>& run) {
    for (;;) {
      try {
        run();
        return;
      } catch (const std::exception& failure) {  // only this request fails
        spdlog::error("{}: {}", name, failure.what());
      }
    }
  }

  boost::asio::io_context io_;
  boost::asio::io_context tls_io_;
  WorkQueue long_work_;
  WorkQueue pictures_;
  WorkQueue files_;
  web::Api api_;
  web::Stream stream_;
  web::Replays replays_;
  const std::string socket_path_;
  web::Server server_;
  web::Server tls_server_;  // of the port, if there is a certificate
  const config::WebSettings web_;
  std::thread thread_;
  std::thread stream_thread_;
  std::thread replay_thread_;
  std::thread tls_thread_;
};

HttpFrontEnd::HttpFrontEnd(control::Control* control,
                           const config::ControlSettings& control_settings,
                           config::WebSettings web_settings)
    : impl_(std::make_unique<Impl>(control, control_settings, std::move(web_settings))) {}

HttpFrontEnd::~HttpFrontEnd() = default;

bool HttpFrontEnd::Open() {
  return impl_->Open();
}

void HttpFrontEnd::SetCertificate(const Certificate& certificate) {
  impl_->SetCertificate(certificate);
}

void HttpFrontEnd::Close() {
  impl_->Close();
}

}  // namespace pheromone::daemon
