#include "server/daemon/front_door.h"

#include <spdlog/spdlog.h>

#include <cstdlib>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <boost/asio/io_context.hpp>

#include "server/config/folders.h"
#include "server/web/api.h"
#include "server/web/server.h"

namespace pheromone::daemon {
namespace {

// One may be busy drawing while the other tells that all is well.
constexpr int kThreads = 2;

}  // namespace

class FrontDoor::Impl {
 public:
  Impl(engine::Control* control, config::ControlSettings control_settings,
       config::WebSettings web_settings)
      : api_(control, {web_settings.token, web_settings.hosts}),
        socket_path_(config::ControlSocket(control_settings, std::getenv("RUNTIME_DIRECTORY"))),
        server_(io_,
                {.socket_path = socket_path_,
                 .listen_address = web_settings.listen_address,
                 .listen_port = web_settings.listen_port},
                [this](const web::Request& request) { return api_.Handle(request); }),
        web_(std::move(web_settings)) {}

  void Open() {
    if (!socket_path_.empty()) {
      const Status listening = server_.ListenOnSocket();
      if (listening.ok()) {
        spdlog::info("control: {}", socket_path_);
      } else {
        spdlog::warn("control: no socket, so pheromonectl cannot reach this server: {}",
                     listening.error());
      }
    }
    if (!web_.listen_address.empty()) {
      const Status listening = server_.ListenOnPort();
      if (listening.ok()) {
        const bool v6 = web_.listen_address.find(':') != std::string::npos;
        spdlog::info("web: http://{}:{}, {}",
                     v6 ? "[" + web_.listen_address + "]" : web_.listen_address, server_.port(),
                     web_.token.empty() ? "read-only" : "changes need the token");
      } else {
        spdlog::warn("web: none: {}", listening.error());
      }
    }
    for (int i = 0; i < kThreads; ++i) {
      threads_.emplace_back([this] { io_.run(); });
    }
  }

  void Close() {
    server_.Stop();
    for (std::thread& thread : threads_) {
      thread.join();
    }
    threads_.clear();
  }

 private:
  boost::asio::io_context io_;
  const web::Api api_;
  const std::string socket_path_;
  web::Server server_;
  const config::WebSettings web_;
  std::vector<std::thread> threads_;
};

FrontDoor::FrontDoor(engine::Control* control, config::ControlSettings control_settings,
                     config::WebSettings web_settings)
    : impl_(std::make_unique<Impl>(control, std::move(control_settings), std::move(web_settings))) {
}

FrontDoor::~FrontDoor() = default;

void FrontDoor::Open() {
  impl_->Open();
}

void FrontDoor::Close() {
  impl_->Close();
}

}  // namespace pheromone::daemon
