// Where a server listens: what is in its way, and what takes it away.

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <string>
#include <vector>

#include "server/base/holders.h"
#include "server/operators/web/server.h"
#include "server/operators/web/testing/listening_server.h"
#include "server/operators/web/testing/raw_client.h"

namespace pheromone::web {
namespace {

using testing::RawClient;

class ListeningTest : public testing::ListeningServer {
 protected:
  // Answers with whether the request is local.
  void Start() {
    Make([](const Request& request, const Respond& respond) {
      respond({.body = request.local ? "local" : "remote"});
    });
    Listen(1);
  }
};

constexpr char kGet[] = "GET / HTTP/1.0\r\n\r\n";

TEST_F(ListeningTest, TheSocketOfADeadServerIsReplacedAndThatOfALivingOneIsNot) {
  const int dead = socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  options_.socket_path.copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(bind(dead, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  close(dead);
  Start();
  Server second(io_, options_, [](const Request&, const Respond&) {});
  const Status refused = second.ListenOnSocket();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error(), options_.socket_path + ": in use by " + DescribeProcess(getpid()));
  const RawClient client(options_.socket_path);
  client.Send(kGet);
  EXPECT_TRUE(client.ReadAll().ends_with("local"));
}

// What a server tells, in order.
class Told {
 public:
  void Add(const std::string& text) {
    const std::lock_guard lock(mutex_);
    texts_.push_back(text);
    wake_.notify_one();
  }
  // The next one that was not returned yet.
  std::string Next() {
    std::unique_lock lock(mutex_);
    wake_.wait(lock, [this] { return next_ < texts_.size(); });
    return texts_[next_++];
  }

 private:
  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<std::string> texts_;
  size_t next_ = 0;
};

TEST_F(ListeningTest, ASocketWhoseFileIsRemovedOrReplacedComesBackAndThatIsTold) {
  Told told;
  options_.listen_again = std::chrono::milliseconds(5);
  options_.tell = [&told](const std::string& text) { told.Add(text); };
  Start();
  const std::string path = options_.socket_path;
  const std::string name = "control: " + path;
  const std::string lost = name + ": lost, nobody can connect; trying to listen again";
  std::filesystem::remove(path);
  EXPECT_EQ(told.Next(), lost);
  EXPECT_EQ(told.Next(), name + ": listening again");
  const RawClient client(path);
  client.Send(kGet);
  EXPECT_TRUE(client.ReadAll().ends_with("local"));

  const std::string file = (folder_ / "file");
  std::ofstream(file) << "of somebody";
  std::filesystem::rename(file, path);
  EXPECT_EQ(told.Next(), lost);
  EXPECT_EQ(told.Next(), name + ": already exists and is not a socket; trying again");
  std::filesystem::remove(path);
  EXPECT_EQ(told.Next(), name + ": listening again");  // and nothing in between, however many tries
  const RawClient again(path);
  again.Send(kGet);
  EXPECT_TRUE(again.ReadAll().ends_with("local"));
  Stop();  // while `told` is there
}

// The descriptor of this process that listens on the port.
int ListenerOf(uint16_t port) {
  for (int fd = 3; fd < 1024; ++fd) {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    int listens = 0;
    socklen_t flag_size = sizeof listens;
    if (getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) == 0 &&
        address.sin_family == AF_INET && ntohs(address.sin_port) == port &&
        getsockopt(fd, SOL_SOCKET, SO_ACCEPTCONN, &listens, &flag_size) == 0 && listens != 0) {
      return fd;
    }
  }
  return -1;
}

TEST_F(ListeningTest, APortThatFailsComesBackWithTheSameNumberAndThatIsTold) {
  Told told;
  options_.tell = [&told](const std::string& text) { told.Add(text); };
  Start();
  const uint16_t port = server_->port();
  const std::string name = "web: 127.0.0.1:" + std::to_string(port);
  ASSERT_EQ(shutdown(ListenerOf(port), SHUT_RDWR), 0);
  EXPECT_EQ(told.Next(), name + ": lost, nobody can connect; trying to listen again");
  EXPECT_EQ(told.Next(), name + ": listening again");
  EXPECT_EQ(server_->port(), port);
  const RawClient client(port);
  client.Send(kGet);
  EXPECT_TRUE(client.ReadAll().ends_with("remote"));
  Stop();
}

TEST_F(ListeningTest, WhatCannotBeListenedOnIsAnErrorInWords) {
  Start();
  ServerOptions options = options_;
  options.listen.port = server_->port();
  options.socket_path = (folder_ / "file").string();
  std::ofstream(options.socket_path) << "of somebody";
  Server second(io_, options, [](const Request&, const Respond&) {});
  EXPECT_EQ(second.ListenOnPort().error(), "cannot listen on 127.0.0.1 port " +
                                               std::to_string(options.listen.port) +
                                               ": Address already in use");
  EXPECT_EQ(second.ListenOnSocket().error(),
            options.socket_path + ": already exists and is not a socket");
  options.socket_path = (folder_ / std::string(200, 'a')).string();
  Server third(io_, options, [](const Request&, const Respond&) {});
  EXPECT_NE(third.ListenOnSocket().error().find("expected at most 107"), std::string::npos);
}

}  // namespace
}  // namespace pheromone::web
