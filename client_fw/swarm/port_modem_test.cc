#include "client_fw/swarm/port_modem.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <string>
#include <vector>

#include "server/base/testing/temporary_folder.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kMs = 1'000'000;

// A terminal, seen from the daemon's side.
class Pty {
 public:
  Pty() : master_(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    EXPECT_EQ(0, grantpt(master_));
    EXPECT_EQ(0, unlockpt(master_));
    std::array<char, 64> name{};
    EXPECT_EQ(0, ptsname_r(master_, name.data(), name.size()));
    device = name.data();
  }
  ~Pty() { HangUp(); }
  Pty(const Pty&) = delete;
  Pty& operator=(const Pty&) = delete;

  void HangUp() {
    if (master_ >= 0) {
      close(master_);
      master_ = -1;
    }
  }
  void Write(const std::string& bytes) {
    EXPECT_EQ(static_cast<ssize_t>(bytes.size()), write(master_, bytes.data(), bytes.size()));
  }
  /// How many bytes can be read.
  int Waiting() const {
    int bytes = 0;
    EXPECT_EQ(0, ioctl(master_, FIONREAD, &bytes));
    return bytes;
  }
  std::string Read() {
    pollfd wait{master_, POLLIN, 0};
    poll(&wait, 1, 10'000);
    std::array<char, 64> bytes{};
    const ssize_t size = read(master_, bytes.data(), bytes.size());
    return size > 0 ? std::string(bytes.data(), static_cast<size_t>(size)) : "";
  }

  std::string device;

 private:
  int master_;
};

class Listener final : public sim::Station {
 public:
  void OnByte(uint8_t byte, int64_t time_ns) override {
    heard += static_cast<char>(byte);
    times_ns.push_back(time_ns);
  }
  void OnTransmitted(int64_t /*time_ns*/) override {}
  std::string heard;
  std::vector<int64_t> times_ns;
};

struct World {
  explicit World(const std::string& device, int64_t adapter_ns = 0)
      : modem(device, &medium, adapter_ns), station(medium.AddStation(&listener)) {}

  void RunFor(int64_t ms) {
    for (int64_t i = 0; i < ms; ++i) {
      modem.AdvanceTo(medium.now_ns() + kMs);
    }
  }

  sim::RadioMedium medium{{}};
  PortModem modem;
  Listener listener;
  int station;
};

TEST(PortModem, BytesFromThePortGoOnTheAirAtItsRate) {
  Pty pty;
  World world(pty.device);
  ASSERT_TRUE(world.modem.Open().ok());
  pty.Write("abc\r\x03");  // nothing of it means anything to a raw terminal
  world.RunFor(20);
  EXPECT_EQ("abc\r\x03", world.listener.heard);
  // Noticed in the first millisecond, keyed for two; then a byte lasts ten bits.
  ASSERT_EQ(5u, world.listener.times_ns.size());
  for (int64_t i = 0; i < 5; ++i) {
    EXPECT_EQ(3 * kMs + (i + 1) * 10'000'000'000 / 9600,
              world.listener.times_ns[static_cast<size_t>(i)]);
  }
}

TEST(PortModem, BytesFromTheAirGoToThePort) {
  Pty pty;
  World world(pty.device);
  ASSERT_TRUE(world.modem.Open().ok());
  const std::vector<uint8_t> frame = {0x10, 0x02, '\n', 0x11, 0x03};
  world.medium.Transmit(world.station, frame);
  world.RunFor(20);
  std::string got;
  while (got.size() < frame.size()) {
    const std::string more = pty.Read();
    ASSERT_FALSE(more.empty());
    got += more;
  }
  EXPECT_EQ(std::string(frame.begin(), frame.end()), got);
}

TEST(PortModem, AnAdapterHoldsReceivedBytesBack) {
  Pty pty;
  World world(pty.device, 16 * kMs);
  ASSERT_TRUE(world.modem.Open().ok());
  // The first byte ends after 2 ms and ten bits, the second another ten bits later.
  world.medium.Transmit(world.station, std::vector<uint8_t>{'a', 'b'});
  world.RunFor(18);
  EXPECT_EQ(0, pty.Waiting());
  world.RunFor(2);
  EXPECT_EQ("ab", pty.Read());
}

TEST(PortModem, AnAdapterHoldsBackNoMoreThanAPacket) {
  Pty pty;
  World world(pty.device, 200 * kMs);
  ASSERT_TRUE(world.modem.Open().ok());
  world.medium.Transmit(world.station, std::vector<uint8_t>(62, 'a'));
  world.RunFor(2 + 62 * 10'000 / 9600);
  EXPECT_EQ(0, pty.Waiting());
  world.RunFor(2);
  EXPECT_EQ(std::string(62, 'a'), pty.Read());
}

TEST(PortModem, APortThatIsNotThereIsAnError) {
  World world("/nonexistent/radio-a.pty");
  const Status opened = world.modem.Open();
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ("/nonexistent/radio-a.pty: No such file or directory", opened.error());
}

TEST(PortModem, AFileIsNoTerminal) {
  World world("/dev/null");
  const Status opened = world.modem.Open();
  ASSERT_FALSE(opened.ok());
  EXPECT_NE(std::string::npos, opened.error().find("/dev/null: not a terminal device"));
}

// A daemon that restarts makes another terminal behind the same link.
TEST(PortModem, OpensAPortThatCameBack) {
  const TemporaryFolder folder;
  const std::string link = folder / "modem.pty";
  Pty first;
  ASSERT_EQ(0, symlink(first.device.c_str(), link.c_str()));
  World world(link);
  ASSERT_TRUE(world.modem.Open().ok());
  first.HangUp();
  unlink(link.c_str());
  world.RunFor(2'000);
  EXPECT_FALSE(world.modem.connected());
  Pty second;
  ASSERT_EQ(0, symlink(second.device.c_str(), link.c_str()));
  world.RunFor(501);
  EXPECT_TRUE(world.modem.connected());
  EXPECT_EQ(1u, world.modem.reconnects());
  second.Write("x");
  world.RunFor(20);
  EXPECT_EQ("x", world.listener.heard);
}

}  // namespace
}  // namespace pheromone::swarm
