// [[link]]: how robots reach the server.
#include <algorithm>
#include <charconv>
#include <optional>

#include "server/config/sections.h"

namespace pheromone::config {
namespace {

constexpr std::string_view kKinds[] = {"pty", "serial", "tcp"};  // in the order of LinkKind

// D_s, what the server may take to answer: a USB adapter alone may hold bytes back for 16 ms.
constexpr int64_t kServerDelayMs = 20;
constexpr int64_t kSerialGapMs = 20;
constexpr int64_t kTcpGapMs = 10'000;
constexpr int64_t kWindowMs = 100;  // without medium access

struct Endpoint {
  std::string address;
  uint16_t port = 0;
};

bool IsIpv4(std::string_view text) {
  int parts = 0;
  while (true) {
    uint8_t part = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), part);
    if (error != std::errc() || end == text.data()) {
      return false;
    }
    ++parts;
    text.remove_prefix(static_cast<size_t>(end - text.data()));
    if (text.empty()) {
      return parts == 4;
    }
    if (text.front() != '.' || parts == 4) {
      return false;
    }
    text.remove_prefix(1);
  }
}

// Near enough: whoever opens the socket says the rest.
bool IsIpv6(std::string_view text) {
  return text.find(':') != std::string_view::npos &&
         text.find_first_not_of("0123456789abcdefABCDEF:.") == std::string_view::npos;
}

// "127.0.0.1:4950" or "[::1]:4950"
std::optional<Endpoint> ParseEndpoint(std::string_view text) {
  const size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) {
    return std::nullopt;
  }
  std::string_view address = text.substr(0, colon);
  const std::string_view port = text.substr(colon + 1);
  const bool brackets = address.size() > 2 && address.front() == '[' && address.back() == ']';
  if (brackets) {
    address = address.substr(1, address.size() - 2);
  }
  Endpoint endpoint{std::string(address), 0};
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), endpoint.port);
  const bool good = error == std::errc() && end == port.data() + port.size() && !port.empty() &&
                    (brackets ? IsIpv6(address) : IsIpv4(address));
  return good ? std::optional(endpoint) : std::nullopt;
}

std::optional<std::string> ReadName(const TableReader& table) {
  auto name = table.String("name");
  if (name && (name->size() > 32 ||
               name->find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                       "0123456789-_.") != std::string::npos)) {
    table.Expected("name", *table.Find("name"),
                   "at most 32 letters, digits, hyphens, underscores and dots");
    return std::nullopt;
  }
  return name;
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
  const int64_t slot = serial ? std::min<int64_t>(turnaround + byte_times_ms(1), 255) : 1;
  const int64_t window =
      serial ? std::min<int64_t>(turnaround + kServerDelayMs + byte_times_ms(2), 255) : kWindowMs;
  const int64_t gap = serial ? kSerialGapMs : link->kind == LinkKind::kTcp ? kTcpGapMs : 0;
  const auto slot_ms = table.Integer("slot_ms", 1, 255, slot);
  const auto window_ms = table.Integer("response_window_ms", 1, 255, window);
  const auto gap_ms = table.Integer("gap_timeout_ms", 0, 60'000, gap);
  if (!slot_ms || !window_ms || !gap_ms) {
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
      table.AllowOnly(
          {"name", "kind", "required", "path", "slot_ms", "response_window_ms", "gap_timeout_ms"});
      text = table.String("path");
      break;
    case LinkKind::kSerial: {
      table.AllowOnly({"name", "kind", "required", "port", "baud", "slot_ms", "response_window_ms",
                       "turnaround_ms", "gap_timeout_ms"});
      text = table.String("port");
      const auto baud = table.Integer("baud", 50, 4'000'000, 9600);
      if (!baud) {
        return false;
      }
      link->baud = static_cast<uint32_t>(*baud);
      break;
    }
    case LinkKind::kTcp: {
      table.AllowOnly({"name", "kind", "required", "listen", "slot_ms", "response_window_ms",
                       "gap_timeout_ms"});
      const auto listen = table.String("listen");
      const auto endpoint = listen ? ParseEndpoint(*listen) : std::nullopt;
      if (listen && !endpoint) {
        table.Expected("listen", *table.Find("listen"),
                       "a numeric address and a port such as \"127.0.0.1:4950\" or \"[::1]:4950\"");
      }
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
  if (a.kind == LinkKind::kTcp && b.kind == LinkKind::kTcp) {
    const bool same = a.listen_port != 0 && a.listen_port == b.listen_port &&
                      a.listen_address == b.listen_address;
    return same ? "listen" : "";
  }
  if (a.kind != LinkKind::kTcp && a.path == b.path) {
    return a.kind == LinkKind::kPty ? "path" : "port";
  }
  return "";
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
  const auto required = table.Boolean("required", false);
  if (!name || !has_address || !has_times || !required) {
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
  const std::vector<const Value*> tables = TablesOf(root, "link", notes);
  for (size_t i = 0; i < tables.size(); ++i) {
    ReadLink(TableReader(*tables[i], PathOf("link", i), &notes->problems), config);
  }
  if (tables.empty()) {
    notes->warnings.push_back(FormatProblem(
        notes->file, root.at, "link", "there is no [[link]], so no robot can reach the server"));
  }
}

}  // namespace pheromone::config
