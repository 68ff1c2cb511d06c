// A test's HTTP server: on a port of the loopback device and on a Unix socket in a folder of its
// own, served by threads.
#pragma once

#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <boost/asio/io_context.hpp>

#include "server/base/testing/temporary_folder.h"
#include "server/operators/web/server.h"

namespace pheromone::web::testing {

class ListeningServer : public ::testing::Test {
 protected:
  ListeningServer() {
    std::signal(SIGPIPE, SIG_IGN);
    options_.socket_path = folder_ / "s.sock";
    options_.listen.address = "127.0.0.1";
  }

  void TearDown() override { Stop(); }

  // Before Listen.
  void Make(Server::Handle handle) {
    server_ = std::make_unique<Server>(io_, options_, std::move(handle));
  }
  void Listen(int threads) {
    ASSERT_TRUE(server_->ListenOnPort().ok());
    const Status local = server_->ListenOnSocket();
    ASSERT_TRUE(local.ok()) << local.error();
    for (int i = 0; i < threads; ++i) {
      threads_.emplace_back([this] { io_.run(); });
    }
  }

  void Stop() {
    if (server_ != nullptr) {
      server_->Stop();
    }
    for (std::thread& thread : threads_) {
      thread.join();
    }
    threads_.clear();
  }

  boost::asio::io_context io_;
  ServerOptions options_;
  const TemporaryFolder folder_;
  std::unique_ptr<Server> server_;
  std::vector<std::thread> threads_;
};

}  // namespace pheromone::web::testing
