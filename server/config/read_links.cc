// [[link]]: how robots reach the server.
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "server/config/sections.h"

namespace pheromone::config {
namespace {

constexpr std::string_view kKinds[] = {"pty", "serial", "tcp", "udp"};  // in the order of LinkKind

// D_s, what the server may take to answer: a USB adapter alone may hold bytes back for 16 ms.
constexpr int64_t kServerDelayMs = 20;
constexpr int64_t kSerialGapMs = 20;  // or four bytes, if they take longer
constexpr int64_t kTcpGapMs = 10'000;
constexpr int64_t kWindowMs = 100;  // without medium access

constexpr int kMostId = 254;

// A number of milliseconds that HELLO tells in one byte. `fallback` follows from other keys, and
// may not fit.
std::optional<int64_t> ReadByte(const TableReader& table, std::string_view key, int64_t fallback) {
  if (table.Find(key) == nullptr && fallback > UINT8_MAX) {
    table.Report(key, "missing, and " + std::to_string(fallback) +
                          ", which follows from baud and turnaround_ms, is more than 255; expected "
                          "a faster line or a whole number from 1 to 255");
    return std::nullopt;
  }
  return table.Integer(key, 1, UINT8_MAX, fallback);
}

// The medium-access figures that HELLO tells the robots.
bool ReadTimes(const TableReader& table, LinkConfig* link) {
  const bool serial = link->kind == LinkKind::kSerial;
  const int64_t turnaround = serial ? table.Integer("turnaround_ms", 0, 200, 2).value_or(-1) : 0;
  if (turnaround < 0) {
    return false;
  }
  // A byte takes ten bits, start and stop included.
  const auto byte_times_ms = [link](int64_t n) {
    return (n * 10'000 + int64_t{link->baud} - 1) / int64_t{link->baud};
  };
  const int64_t slot = serial ? turnaround + byte_times_ms(1) : 1;
  const int64_t window = serial ? turnaround + kServerDelayMs + byte_times_ms(2) : kWindowMs;
  const int64_t gap = serial                         ? std::max(kSerialGapMs, byte_times_ms(4))
                      : link->kind == LinkKind::kTcp ? kTcpGapMs
                                                     : 0;
  const auto slot_ms = ReadByte(table, "slot_ms", slot);
  const auto window_ms = ReadByte(table, "response_window_ms", window);
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
  if (serial && *window_ms <= turnaround + byte_times_ms(1)) {
    table.Report("response_window_ms",
                 "found " + std::to_string(*window_ms) +
                     ", expected more than turnaround_ms and the time of a byte, which the server "
                     "waits before it answers");
    return false;
  }
  link->turnaround_ms = static_cast<uint16_t>(turnaround);
  link->slot_ms = static_cast<uint8_t>(*slot_ms);
  link->response_window_ms = static_cast<uint8_t>(*window_ms);
  link->gap_timeout_ms = static_cast<uint16_t>(*gap_ms);
  return true;
}

bool ReadAddress(const TableReader& table, LinkConfig* link) {
  std::optional<std::string> text;
  switch (link->kind) {
    case LinkKind::kPty:
      table.AllowOnly({"name", "kind", "required", "clients", "path", "slot_ms",
                       "response_window_ms", "gap_timeout_ms"});
      text = table.String("path");
      break;
    case LinkKind::kSerial: {
      table.AllowOnly({"name", "kind", "required", "clients", "port", "baud", "slot_ms",
                       "response_window_ms", "turnaround_ms", "gap_timeout_ms"});
      text = table.String("port");
      const auto baud = table.Integer("baud", 50, 4'000'000, 9600);
      if (!baud) {
        return false;
      }
      link->baud = static_cast<uint32_t>(*baud);
      break;
    }
    case LinkKind::kTcp:
    case LinkKind::kUdp: {
      if (link->kind == LinkKind::kTcp) {
        table.AllowOnly({"name", "kind", "required", "clients", "listen", "slot_ms",
                         "response_window_ms", "gap_timeout_ms"});
      } else {
        table.AllowOnly(
            {"name", "kind", "required", "clients", "listen", "slot_ms", "response_window_ms"});
      }
      const auto endpoint = ReadEndpoint(table, "listen");
      if (!endpoint) {
        return false;
      }
      link->listen_address = endpoint->address;
      link->listen_port = endpoint->port;
      return true;
    }
  }
  link->path = text.value_or("");
  return text.has_value();
}

// Two links cannot be reached in the same way.
std::string_view Clash(const LinkConfig& a, const LinkConfig& b) {
  if (a.name == b.name) {
    return "name";
  }
  const auto listens = [](LinkKind kind) {
    return kind == LinkKind::kTcp || kind == LinkKind::kUdp;
  };
  if (listens(a.kind)) {
    const bool same = a.kind == b.kind && a.listen_port != 0 && a.listen_port == b.listen_port &&
                      a.listen_address == b.listen_address;
    return same ? "listen" : "";
  }
  const auto normal = [](const std::string& path) {
    return std::filesystem::path(path).lexically_normal();
  };
  if (!listens(b.kind) && normal(a.path) == normal(b.path)) {
    return a.kind == LinkKind::kPty ? "path" : "port";
  }
  return "";
}

// "10-20", both included; nothing if it is no such range of IDs.
std::optional<std::pair<int, int>> ParseRange(const Value& value) {
  if (value.kind == Value::Kind::kInteger) {
    const bool good = value.integer >= 1 && value.integer <= kMostId;
    const auto id = static_cast<int>(good ? value.integer : 0);
    return good ? std::optional(std::pair(id, id)) : std::nullopt;
  }
  if (value.kind != Value::Kind::kString) {
    return std::nullopt;
  }
  const char* const end = value.text.data() + value.text.size();
  std::pair<int, int> range;
  const auto first = std::from_chars(value.text.data(), end, range.first);
  if (first.ec != std::errc() || first.ptr == end || *first.ptr != '-') {
    return std::nullopt;
  }
  const auto last = std::from_chars(first.ptr + 1, end, range.second);
  const bool good = last.ec == std::errc() && last.ptr == end && range.first >= 1 &&
                    range.first <= range.second && range.second <= kMostId;
  return good ? std::optional(range) : std::nullopt;
}

bool ReadClients(const TableReader& table, LinkConfig* link) {
  const Value* list = table.Find("clients");
  if (list == nullptr) {
    return true;
  }
  constexpr std::string_view kExpected =
      "client IDs from 1 to 254 and ranges of them, such as [1, 2, \"10-20\"]";
  if (list->kind != Value::Kind::kArray || list->items.empty()) {
    table.Expected("clients", *list, kExpected);
    return false;
  }
  link->clients.reset();
  bool good = true;
  for (const Value& item : list->items) {
    const auto range = ParseRange(item);
    if (!range) {
      table.Expected("clients", item, kExpected);
      good = false;
      continue;
    }
    for (int id = range->first; id <= range->second; ++id) {
      link->clients.set(static_cast<size_t>(id));
    }
  }
  return good;
}

void ReadLink(const TableReader& table, Config* config) {
  const auto kind = table.OneOf("kind", kKinds);
  const auto name = ReadName(table);
  if (!kind) {
    return;
  }
  LinkConfig link;
  link.kind = static_cast<LinkKind>(*kind);
  const bool has_address = ReadAddress(table, &link);
  const bool has_times = ReadTimes(table, &link);
  const bool has_clients = ReadClients(table, &link);
  const auto required = table.Boolean("required", false);
  if (!name || !has_address || !has_times || !has_clients || !required) {
    return;
  }
  link.name = *name;
  link.required = *required;
  for (const LinkConfig& other : config->links) {
    if (const std::string_view key = Clash(link, other); !key.empty()) {
      table.Report(key, "found " + table.Find(key)->Describe() + " again, expected what link \"" +
                            other.name + "\" does not have");
      return;
    }
  }
  config->links.push_back(link);
  config->engine.links.push_back({link.name, link.slot_ms, link.response_window_ms});
}

}  // namespace

void ReadLinks(const Value& root, Notes* notes, Config* config) {
  const std::vector<const Value*> tables = TablesOf(root, "link", notes, kMostTables);
  for (size_t i = 0; i < tables.size(); ++i) {
    ReadLink(TableReader(*tables[i], PathOf("link", i), &notes->problems), config);
  }
  if (tables.empty()) {
    notes->warnings.push_back(FormatProblem(
        notes->file, root.at, "link", "there is no [[link]], so no robot can reach the server"));
  }
}

}  // namespace pheromone::config
