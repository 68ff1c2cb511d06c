// What the tests of serial links share: a modem that can be plugged in and out. The tests are
// linked with pty_as_serial_shim.c.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <string>
#include <utility>

#include "server/robots/links/port_link.h"
#include "server/robots/links/testing/link_bench.h"
#include "server/robots/links/testing/pty_as_serial_shim.h"
#include "server/robots/links/testing/remembering_tap.h"

namespace pheromone::links::testing {

/// A 16550 with a driver that tells all, one that has only tcdrain, and one whose tcdrain returns
/// early.
constexpr PtyShimUart kTellsAll = {16, TIOCM_RTS, 1, 0};
constexpr PtyShimUart kDrainsOnly = {16, TIOCM_RTS, 0, 0};
constexpr PtyShimUart kDrainsEarly = {16, TIOCM_RTS, 1, 1};
/// A USB adapter that has taken the bytes and tells nothing more.
constexpr PtyShimUart kTellsNothing = {4096, TIOCM_RTS, 0, 1};
constexpr PtyShimUart kUarts[] = {kTellsAll, kDrainsOnly, kDrainsEarly, kTellsNothing};

/// The master is the test's, the slave the server's port.
class SerialLinkTest : public ::testing::Test {
 protected:
  SerialLinkTest() {
    config_.kind = LinkKind::kSerial;
    config_.path = path_;
    config_.gap_timeout_ms = 20;
    config_.medium_access = true;
    config_.server_delay_ms = 20;
    config_.response_window_ms = 10'000;  // a busy machine must not make answers late
  }

  Peer PlugIn() {
    Descriptor master(posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC));
    EXPECT_EQ(unlockpt(master.get()), 0);
    slave_ = ptsname(master.get());
    unlink(path_.c_str());
    EXPECT_EQ(symlink(slave_.c_str(), path_.c_str()), 0);
    return Peer(std::move(master));
  }

  Status Start(std::function<std::vector<UsbPort>()> list_usb_ports = ListUsbPorts) {
    LinkContext context = server_.Context(0);
    context.tap = &tap_;
    context.list_usb_ports = std::move(list_usb_ports);
    return server_.Start(MakeSerialLink(server_.io(), config_, std::move(context)));
  }

  bool Up() {
    return Eventually([this] { return server_.link().state().up; });
  }

  TemporaryFolder folder_;
  std::string path_ = folder_ / "modem";
  std::string slave_;
  LinkConfig config_{.name = "radio-a"};
  RememberingTap tap_;
  Server server_;
};

}  // namespace pheromone::links::testing
