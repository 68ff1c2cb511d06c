// How robots are reached: what a [[link]] and a [[tracker]] of the configuration say, and all that
// a link is made of. Read by server/config, checked there; plain values.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/net/endpoint.h"
#include "server/robots/links/admission.h"
#include "server/robots/signing/keys.h"

namespace pheromone::links {

enum class LinkKind { kPty, kSerial, kTcp, kUdp };

/// Of a USB adapter.
struct UsbIdentity {
  uint16_t vendor = 0;
  uint16_t product = 0;
  std::string serial;  ///< empty: any, or unknown
  bool operator==(const UsbIdentity&) const = default;
};

/// "0403:6001:A50285BI", or without the serial number "0403:6001"
std::string ToText(const UsbIdentity& identity);

/// The input that signals the carrier of another station.
enum class CarrierSense { kNone, kDcd, kCts };

/// How a transceiver is keyed: by a modem line, asserted while there is something to send, or by
/// the driver itself (RS-485, Linux' TIOCSRS485).
enum class Ptt { kNone, kRts, kDtr, kRs485 };

/// The use of a port's modem lines.
struct ModemLines {
  CarrierSense carrier_sense = CarrierSense::kNone;
  Ptt ptt = Ptt::kNone;
  uint16_t ptt_lead_ms = 0;  ///< from keying to the first byte
  uint16_t ptt_tail_ms = 0;  ///< from the last byte to unkeying
  bool operator==(const ModemLines&) const = default;
};

/// At most, each of a shared medium's turnaround, adapter latency and server delay.
constexpr unsigned kMostMediumMs = 200;

struct LinkConfig {
  std::string name{};
  LinkKind kind = LinkKind::kPty;
  std::vector<std::string> on{};  ///< the cluster's nodes that have it; empty: all of them
  bool required = false;          ///< the server does not start if the link does not come up
  AdmissionOptions admission{};
  signing::Security security = signing::Security::kOff;
  std::string keys_path{};  ///< the file with the robots' keys; empty: security is off

  std::string
      path{};  ///< kPty: the symbolic link to the slave side; kSerial: the port, or a link to it
  std::optional<UsbIdentity> usb{};  ///< kSerial: instead of a path, wherever it is plugged in
  uint32_t baud = 9600;              ///< kSerial, and kPty with medium access
  ModemLines lines{};                ///< kSerial
  uint32_t silence_s = 0;            ///< kSerial: nothing received for so long is told; 0: never
  Endpoint listen{};                 ///< kTcp, kUdp
  /// kTcp. When this is exceeded, a connection is closed: the oldest on which no robot has been
  /// heard, or else the one that has been silent for longest.
  uint16_t max_connections = 254;

  uint16_t gap_timeout_ms = 0;  ///< longest silence inside a frame; 0: no limit
  /// Several stations share the line, one sending at a time: protocol/README.md, "Sharing a radio
  /// channel".
  bool medium_access = false;
  uint16_t turnaround_ms = 0;         ///< with medium access: T_t, from receiving to sending
  uint16_t adapter_latency_ms = 0;    ///< likewise: for how long received bytes may be held back
  uint16_t server_delay_ms = 0;       ///< likewise: from reading a request to its answer, at most
  uint8_t slot_ms = 1;                ///< as announced
  uint16_t response_window_ms = 100;  ///< W, as announced: at most 255 then

  bool operator==(const LinkConfig&) const = default;
};

/// A place where a camera or another tracking system reports where robots are, over UDP.
struct TrackerConfig {
  std::string name{};
  Endpoint listen{};
  uint32_t valid_ms = 1000;  ///< how long a reported pose counts
  bool operator==(const TrackerConfig&) const = default;
};

}  // namespace pheromone::links
