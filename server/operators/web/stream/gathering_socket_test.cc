// The other end keeps the bounds of packets: each of its packets is one system call here.

#include "server/operators/web/stream/gathering_socket.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>

namespace pheromone::web {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

class GatheringSocketTest : public testing::Test {
 protected:
  GatheringSocketTest() {
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0, ends_.data()), 0);
    socket_.emplace(
        Connection(Connection::Protocol::socket(io_, Connection::Protocol(AF_UNIX, 0), ends_[0])));
  }
  ~GatheringSocketTest() override {
    socket_.reset();
    CloseOther();
  }

  void CloseOther() {
    if (ends_[1] >= 0) {
      close(std::exchange(ends_[1], -1));
    }
  }

  void Write(const std::string& text) {
    socket_->async_write_some(asio::buffer(text), [this](error_code error, size_t size) {
      errors_.push_back(error);
      sizes_.push_back(size);
    });
  }

  void Run() {
    io_.restart();
    io_.run();
  }

  // Empty: there is none.
  std::string Packet() const {
    std::string packet(size_t{1} << 18, '\0');
    const ssize_t size = recv(ends_[1], packet.data(), packet.size(), 0);
    packet.resize(size > 0 ? static_cast<size_t>(size) : 0);
    return packet;
  }

  asio::io_context io_{1};
  std::array<int, 2> ends_{-1, -1};
  std::optional<GatheringSocket> socket_;
  std::vector<error_code> errors_;
  std::vector<size_t> sizes_;
};

TEST_F(GatheringSocketTest, SendsWhatIsWrittenInOneGoWithOneCall) {
  const std::array<std::string, 3> texts{"one", "two", "three"};
  // As Beast does: each write begins when the one before it is done.
  socket_->async_write_some(asio::buffer(texts[0]), [&](error_code, size_t) {
    socket_->async_write_some(asio::buffer(texts[1]), [&](error_code, size_t) { Write(texts[2]); });
  });
  Run();
  EXPECT_EQ(sizes_, std::vector<size_t>{5});
  EXPECT_EQ(Packet(), "onetwothree");
  EXPECT_EQ(Packet(), "");
}

TEST_F(GatheringSocketTest, SendsALargeOneWithWhatWasWrittenBeforeIt) {
  const std::string large(GatheringSocket::kMaxSmall + 1, 'x');
  const std::string small = "small";
  socket_->async_write_some(asio::buffer(small), [&](error_code, size_t) { Write(large); });
  Run();
  EXPECT_EQ(sizes_, std::vector<size_t>{large.size()});
  EXPECT_EQ(Packet(), small + large);
  EXPECT_EQ(Packet(), "");
}

TEST_F(GatheringSocketTest, KeepsABoundedNumberOfBytesForAPeerThatDoesNotRead) {
  const std::string piece(1000, 'y');
  size_t done = 0;
  std::function<void(error_code, size_t)> next = [&](error_code error, size_t) {
    ASSERT_FALSE(error) << error.message();
    ++done;
    socket_->async_write_some(asio::buffer(piece), next);
  };
  int buffer_bytes = 0;
  socklen_t length = sizeof buffer_bytes;
  ASSERT_EQ(getsockopt(ends_[0], SOL_SOCKET, SO_SNDBUF, &buffer_bytes, &length), 0);
  socket_->async_write_some(asio::buffer(piece), next);
  for (size_t turns = 0; turns < 100'000; ++turns) {
    io_.poll_one();
  }
  const size_t most = (static_cast<size_t>(buffer_bytes) + 3 * GatheringSocket::kMaxKept) / 1000;
  EXPECT_GT(done, GatheringSocket::kMaxKept / 1000);
  EXPECT_LT(done, most);
  // And goes on once it reads, with nothing lost or in another order.
  const size_t before = done;
  const size_t wanted = before + 500;
  size_t read = 0;
  while (done < wanted) {
    for (std::string packet = Packet(); !packet.empty(); packet = Packet()) {
      ASSERT_EQ(packet, std::string(packet.size(), 'y'));
      read += packet.size();
    }
    ASSERT_GT(io_.poll_one(), 0U);
  }
  EXPECT_GE(read, (before - 1) * 1000 - 2 * GatheringSocket::kMaxKept);
}

TEST_F(GatheringSocketTest, TellsTheNextWriteOfAnErrorAfterOneThatWasDone) {
  CloseOther();
  Write("lost");
  Run();
  ASSERT_EQ(errors_.size(), 1U);
  EXPECT_FALSE(errors_[0]);
  Write("refused");
  Run();
  ASSERT_EQ(errors_.size(), 2U);
  EXPECT_TRUE(errors_[1]);
}

TEST_F(GatheringSocketTest, IsDestroyedWhileItSends) {
  Write("sent after all");
  socket_.reset();
  Run();
  EXPECT_EQ(sizes_.size(), 1U);
}

}  // namespace
}  // namespace pheromone::web
