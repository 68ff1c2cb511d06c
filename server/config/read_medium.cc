// The part of [[link]] about medium access.
#include <algorithm>
#include <optional>

#include "server/config/sections.h"

namespace pheromone::config {
namespace {

using links::LinkConfig;
using links::LinkKind;

constexpr int64_t kAdapterLatencyMs = 16;  // of a USB adapter, unless it is told otherwise
constexpr int64_t kServerDelayMs = 10;     // the disk included, if there is a journal
constexpr int64_t kSerialGapMs = 20;       // or longer, for slow bytes or adapters
constexpr int64_t kTcpGapMs = 10'000;
constexpr int64_t kWindowMs = 100;  // without medium access

// In the order of CarrierSense and Ptt.
constexpr std::string_view kCarrierSenses[] = {"none", "dcd", "cts"};
constexpr std::string_view kPtts[] = {"none", "rts", "dtr", "rs485"};
constexpr int64_t kMaxPttMs = 1000;

// A number of milliseconds that HELLO's answer contains as one byte. `fallback` is computed from
// the keys `from`, and may not fit.
std::optional<int64_t> ReadByte(const TableReader& table, std::string_view key, int64_t fallback,
                                const std::string& from) {
  if (table.Find(key) == nullptr && fallback > UINT8_MAX) {
    table.Report(key, "missing, and its default " + std::to_string(fallback) + ", derived from " +
                          from + ", is more than 255; expected a faster line, shorter times or " +
                          "a whole number from 1 to 255");
    return std::nullopt;
  }
  return table.Integer(key, 1, UINT8_MAX, fallback);
}

// Whether several stations share the line, and how fast it is.
bool ReadLine(const TableReader& table, LinkConfig* link) {
  const auto medium_access = table.Boolean("medium_access", link->kind == LinkKind::kSerial);
  const auto baud = table.Integer("baud", 50, 4'000'000, 9600);
  if (!medium_access || !baud) {
    return false;
  }
  link->medium_access = *medium_access;
  link->baud = static_cast<uint32_t>(*baud);
  return *medium_access ||
         table.Without({"carrier_sense", "turnaround_ms", "adapter_latency_ms", "server_delay_ms"},
                       "medium_access = false", "only on a shared medium");
}

// The use of the modem's lines.
bool ReadLines(const TableReader& table, LinkConfig* link) {
  const auto carrier_sense = table.OneOf("carrier_sense", kCarrierSenses, 0);
  const auto ptt = table.OneOf("ptt", kPtts, 0);
  const auto lead = table.Integer("ptt_lead_ms", 0, kMaxPttMs, 0);
  const auto tail = table.Integer("ptt_tail_ms", 0, kMaxPttMs, 0);
  if (!carrier_sense || !ptt || !lead || !tail) {
    return false;
  }
  link->lines = {static_cast<links::CarrierSense>(*carrier_sense), static_cast<links::Ptt>(*ptt),
                 static_cast<uint16_t>(*lead), static_cast<uint16_t>(*tail)};
  return link->lines.ptt != links::Ptt::kNone ||
         table.Without({"ptt_lead_ms", "ptt_tail_ms"}, "ptt = \"none\"",
                       "ptt = \"rts\", \"dtr\" or \"rs485\"");
}

// The medium access parameters in HELLO's answer.
bool ReadTimes(const TableReader& table, LinkConfig* link) {
  const bool serial = link->kind == LinkKind::kSerial;
  const bool shared = link->medium_access;
  const auto turnaround = shared ? table.Integer("turnaround_ms", 0, links::kMostMediumMs, 2) : 0;
  const auto adapter = shared ? table.Integer("adapter_latency_ms", 0, links::kMostMediumMs,
                                              serial ? kAdapterLatencyMs : 0)
                              : 0;
  const auto delay =
      shared ? table.Integer("server_delay_ms", 0, links::kMostMediumMs, kServerDelayMs) : 0;
  if (!turnaround || !adapter || !delay) {
    return false;
  }
  // A byte takes ten bits, start and stop included.
  const auto byte_times_ms = [link](int64_t n) {
    return (n * 10'000 + int64_t{link->baud} - 1) / int64_t{link->baud};
  };
  const int64_t key_delay =
      link->lines.ptt == links::Ptt::kNone ? *turnaround : int64_t{link->lines.ptt_lead_ms};
  // The robot's modem must have turned round before the answer arrives.
  const int64_t turning = std::max(int64_t{0}, *turnaround - key_delay);
  const int64_t before_answer = *turnaround + key_delay + *adapter + byte_times_ms(2);
  const int64_t slot = shared ? *turnaround + byte_times_ms(1) : 1;
  const int64_t window = shared ? before_answer + std::max(*delay, turning) : kWindowMs;
  const int64_t gap = serial
                          ? std::max({kSerialGapMs, byte_times_ms(4), *adapter + byte_times_ms(2)})
                      : link->kind == LinkKind::kTcp ? kTcpGapMs
                                                     : 0;
  const auto slot_ms = ReadByte(table, "slot_ms", slot, "baud and turnaround_ms");
  const auto window_ms =
      ReadByte(table, "response_window_ms", window,
               "turnaround_ms, adapter_latency_ms, server_delay_ms, ptt_lead_ms and baud");
  const auto gap_ms = table.Integer("gap_timeout_ms", 0, 60'000, gap);
  if (!slot_ms || !window_ms || !gap_ms) {
    return false;
  }
  // Bytes that follow each other without a pause are a byte time apart, and a read may come late.
  if (serial && *gap_ms != 0 && *gap_ms * link->baud <= 20'000) {
    table.Report("gap_timeout_ms",
                 "found " + std::to_string(*gap_ms) + ", expected more than the " +
                     "time of two bytes, which is " +
                     FormatScaled(20'000'000 / link->baud, kSecondsToMs) + " ms at " +
                     std::to_string(link->baud) + " baud, or 0 for no limit");
    return false;
  }
  if (shared && *window_ms < before_answer + turning) {
    table.Report("response_window_ms",
                 "found " + std::to_string(*window_ms) + ", expected at least " +
                     std::to_string(before_answer + turning) +
                     ", what the modems, the adapter and two bytes take before the server's answer "
                     "arrives");
    return false;
  }
  link->turnaround_ms = static_cast<uint16_t>(*turnaround);
  link->adapter_latency_ms = static_cast<uint16_t>(*adapter);
  link->server_delay_ms = static_cast<uint16_t>(*delay);
  link->slot_ms = static_cast<uint8_t>(*slot_ms);
  link->response_window_ms = static_cast<uint16_t>(*window_ms);
  link->gap_timeout_ms = static_cast<uint16_t>(*gap_ms);
  return true;
}

}  // namespace

bool ReadMedium(const TableReader& table, links::LinkConfig* link) {
  const bool serial = link->kind == LinkKind::kSerial;
  const bool is_line = serial || link->kind == LinkKind::kPty;
  return (!is_line || ReadLine(table, link)) && (!serial || ReadLines(table, link)) &&
         ReadTimes(table, link);
}

}  // namespace pheromone::config
