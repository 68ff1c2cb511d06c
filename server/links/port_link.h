// Links over one serial line, real or virtual.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <boost/asio/io_context.hpp>

#include "server/links/backoff.h"
#include "server/links/link.h"
#include "server/links/modem_lines.h"
#include "server/links/usb_port.h"

namespace pheromone::links {

struct PtyOptions {
  std::string path;             ///< the symbolic link to the slave side
  uint16_t gap_timeout_ms = 0;  ///< 0: none; a pty loses no bytes
  BackoffOptions backoff;
};

/// A virtual modem: no medium access. See MakePtyPort for the symbolic link.
std::unique_ptr<Link> MakePtyLink(boost::asio::io_context& io, const PtyOptions& options,
                                  LinkContext context);

struct SerialOptions {
  std::string path;                ///< of the port; symbolic links are followed at each attempt
  std::optional<UsbIdentity> usb;  ///< instead of a path: the adapter, wherever it is plugged in
  std::function<std::vector<UsbPort>()> list_usb_ports = ListUsbPorts;
  uint32_t baud = 9600;
  uint16_t gap_timeout_ms = 20;
  bool medium_access = true;         ///< false: a cable, with one robot at its end
  uint16_t turnaround_ms = 0;        ///< T_t
  uint16_t response_window_ms = 25;  ///< W
  MediumLines lines;
  std::chrono::seconds silence{};  ///< warn if nothing is received for this long; 0: never
  BackoffOptions backoff;
};

/// A radio modem, shared by its robots: answers observe the server gap and the response window, and
/// wait while another carrier is present, if the modem signals it.
std::unique_ptr<Link> MakeSerialLink(boost::asio::io_context& io, const SerialOptions& options,
                                     LinkContext context);

}  // namespace pheromone::links
