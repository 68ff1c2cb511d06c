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

#include "server/robots/links/backoff.h"
#include "server/robots/links/link.h"
#include "server/robots/links/modem_lines.h"
#include "server/robots/links/port.h"
#include "server/robots/links/usb_port.h"
#include "server/robots/radio/rounds.h"

namespace pheromone::links {

/// A half-duplex medium: protocol/README.md, "Sharing a radio channel".
struct MediumOptions {
  uint32_t baud = 9600;
  uint16_t turnaround_ms = 0;        ///< T_t
  uint8_t slot_ms = 1;               ///< as announced
  uint16_t response_window_ms = 25;  ///< W, as announced
  uint16_t adapter_latency_ms = 0;   ///< for how long received bytes may be held back
  uint16_t server_delay_ms = 20;     ///< from reading a request to its answer, at most
  radio::Duration quiet_start = radio::kAwaitedRound;  ///< radio::RoundOptions
};

struct PtyOptions {
  std::string path;                     ///< the symbolic link to the slave side
  uint16_t gap_timeout_ms = 0;          ///< 0: none; a pty loses no bytes
  std::optional<MediumOptions> medium;  ///< of the virtual modem's robots; empty: no medium access
  BackoffOptions backoff;
};

/// Of any port.
struct PortLinkOptions {
  std::string address;  ///< for messages and status
  uint16_t gap_timeout_ms = 0;
  bool medium_access = false;
  MediumOptions medium;  ///< without medium access: only `baud`
  MediumLines lines;
  std::chrono::seconds silence{};
  BackoffOptions backoff;
};

/// The link that all ports have.
std::unique_ptr<Link> MakePortLink(boost::asio::io_context& io, std::unique_ptr<Port> port,
                                   const PortLinkOptions& options, LinkContext context);

/// A virtual modem. See MakePtyPort for the symbolic link.
std::unique_ptr<Link> MakePtyLink(boost::asio::io_context& io, const PtyOptions& options,
                                  LinkContext context);

struct SerialOptions {
  std::string path;                ///< of the port; symbolic links are followed at each attempt
  std::optional<UsbIdentity> usb;  ///< instead of a path: the adapter, wherever it is plugged in
  std::function<std::vector<UsbPort>()> list_usb_ports = ListUsbPorts;
  uint16_t gap_timeout_ms = 20;
  bool medium_access = true;  ///< false: a cable, with one robot at its end
  MediumOptions medium;
  MediumLines lines;
  std::chrono::seconds silence{};  ///< warn if nothing is received for this long; 0: never
  BackoffOptions backoff;
};

/// A radio modem, shared by its robots: answers observe the server gap and the response window, and
/// wait while another carrier is present, if the modem signals it.
std::unique_ptr<Link> MakeSerialLink(boost::asio::io_context& io, const SerialOptions& options,
                                     LinkContext context);

}  // namespace pheromone::links
