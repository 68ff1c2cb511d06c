// A keyed line covers every bit, at every baud rate, without a tail. The UART is that of
// testing/pty_as_serial_shim.h.
#include "server/robots/links/drain.h"

#include <gtest/gtest.h>
#include <linux/serial.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <future>
#include <memory>
#include <thread>
#include <vector>

#include "server/robots/links/port.h"
#include "server/robots/links/testing/pty_as_serial_shim.h"
#include "server/robots/links/testing/serial_bench.h"

namespace pheromone::links {
namespace {

using testing::Eventually;
using testing::kDrainsEarly;
using testing::kDrainsOnly;
using testing::kTellsAll;
using testing::kTellsNothing;
using testing::Peer;

class DrainTest : public testing::SerialLinkTest {
 protected:
  void TearDown() override { PtyShimSetUart({}); }

  // The port and its descriptor.
  void Open(uint32_t baud) {
    SerialPortOptions options;
    options.name = path_;
    options.find_path = [this]() -> Result<std::string> { return path_; };
    options.baud = baud;
    options.lines.ptt = Ptt::kRts;
    port_ = MakeSerialPort(options);
    Result<Descriptor> opened = port_->Open();
    ASSERT_TRUE(opened.ok()) << opened.error();
    descriptor_ = std::move(opened).value();
  }

  void Write(size_t size) {
    const std::vector<uint8_t> bytes(size, 0x55);
    ASSERT_EQ(write(descriptor_.get(), bytes.data(), size), static_cast<ssize_t>(size));
  }

  std::unique_ptr<Port> port_;
  Descriptor descriptor_;
};

TEST_F(DrainTest, AKeyedLineCoversEveryBitAtEachBaudRate) {
  for (const PtyShimUart& uart : {kTellsAll, kDrainsOnly, kDrainsEarly}) {
    for (const uint32_t baud : {9600u, 19'200u, 38'400u, 57'600u, 115'200u}) {
      const Peer modem = PlugIn();
      Open(baud);
      for (const size_t size : {size_t{1}, size_t{12}, size_t{17}, size_t{140}}) {
        PtyShimSetUart(uart);
        port_->Key(true);
        Write(size);
        port_->WaitUntilSent();
        port_->Key(false);
        EXPECT_EQ(PtyShimAir().bytes, static_cast<long long>(size));
        EXPECT_EQ(PtyShimAir().cut, 0) << baud << " baud, " << size << " bytes";
        EXPECT_GE(PtyShimAir().tail_ns, 0);
      }
      port_->Close();
    }
  }
}

TEST_F(DrainTest, UnkeyingAfterTheWriteCutsEverything) {
  const Peer modem = PlugIn();
  Open(9600);
  PtyShimSetUart(kTellsAll);
  PtyShimStopUart(1);
  port_->Key(true);
  Write(140);
  port_->Key(false);
  EXPECT_EQ(PtyShimAir().cut, 140);
}

TEST_F(DrainTest, BytesBeforeTheKeyAreCutToo) {
  const Peer modem = PlugIn();
  Open(9600);
  PtyShimSetUart(kTellsAll);
  Write(12);
  port_->Key(true);
  port_->WaitUntilSent();
  port_->Key(false);
  EXPECT_EQ(PtyShimAir().cut, 12);
}

TEST_F(DrainTest, ItWaitsAsLongAsAnyBitIsLeft) {
  for (const PtyShimUart& uart : {kTellsAll, kDrainsEarly}) {
    for (const size_t size : {size_t{1}, size_t{17}}) {  // in the FIFO alone
      const Peer modem = PlugIn();
      Open(115'200);
      PtyShimSetUart(uart);
      PtyShimStopUart(1);
      port_->Key(true);
      Write(size);
      std::thread waiting([this] {
        port_->WaitUntilSent();
        port_->Key(false);
      });
      EXPECT_TRUE(Eventually([] { return PtyShimAsked() >= 1; }));
      EXPECT_NE(PtyShimOutputs() & TIOCM_RTS, 0);
      PtyShimStopUart(0);
      waiting.join();
      EXPECT_EQ(PtyShimAir().cut, 0);
      port_->Close();
    }
  }
}

// Then the time of the bytes has to do.
TEST_F(DrainTest, ADriverThatTellsNothingHoldsNothingUp) {
  const Peer modem = PlugIn();
  Open(9600);
  PtyShimSetUart(kTellsNothing);
  PtyShimStopUart(1);
  Write(140);
  port_->WaitUntilSent();
  EXPECT_EQ(PtyShimAir().bytes, 140);
}

TEST_F(DrainTest, ADeadDeviceIsGivenUp) {
  for (const PtyShimUart& uart : {kTellsAll, kDrainsEarly}) {
    const Peer modem = PlugIn();
    Open(9600);
    PtyShimSetUart(uart);
    PtyShimStopUart(1);
    Write(140);
    port_->WaitUntilSent();
    port_->Close();
  }
}

TEST_F(DrainTest, APseudoTerminalHasNothingToWaitFor) {
  const std::unique_ptr<Port> port = MakePtyPort(folder_ / "virtual.pty");
  ASSERT_TRUE(port->Open().ok());
  port->WaitUntilSent();
}

}  // namespace
}  // namespace pheromone::links
