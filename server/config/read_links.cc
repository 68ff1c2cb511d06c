// [[link]]: how robots reach the server.
#include <algorithm>
#include <charconv>
#include <optional>
#include <system_error>
#include <utility>

#include "server/config/sections.h"
#include "server/robots/signing/keys_file.h"

namespace pheromone::config {
namespace {

using links::LinkConfig;
using links::LinkKind;
using links::UsbIdentity;

constexpr std::string_view kKinds[] = {"pty", "serial", "tcp", "udp"};  // in the order of LinkKind

// In the order of Security.
constexpr std::string_view kSecurities[] = {"off", "accept", "require"};

constexpr int kMaxId = 254;

// VENDOR:PRODUCT in hexadecimal, and perhaps :SERIAL.
std::optional<UsbIdentity> ParseUsb(std::string_view text) {
  UsbIdentity usb;
  const auto parse = [&text](size_t begin, uint16_t* number) {
    const std::string_view digits = text.substr(std::min(begin, text.size()), 4);
    const char* const end = digits.data() + digits.size();
    const auto parsed = std::from_chars(digits.data(), end, *number, 16);
    return digits.size() == 4 && parsed.ec == std::errc() && parsed.ptr == end;
  };
  const bool numbers = parse(0, &usb.vendor) && parse(5, &usb.product) && text[4] == ':';
  const bool has_serial = text.size() > 10 && text[9] == ':';
  if (!numbers || (text.size() != 9 && !has_serial)) {
    return std::nullopt;
  }
  usb.serial = has_serial ? text.substr(10) : "";
  return usb;
}

// A path, a name in /dev/serial/by-id, or a USB adapter.
bool ReadPort(const TableReader& table, LinkConfig* link) {
  if (table.Find("usb") == nullptr) {
    const auto port = table.String("port");
    if (!port) {
      return false;
    }
    link->path = PortPath(*port);
    return true;
  }
  const auto text = table.String("usb");
  link->usb = text ? ParseUsb(*text) : std::nullopt;
  if (text && !link->usb) {
    table.Expected("usb", *table.Find("usb"),
                   "vendor and product IDs in hexadecimal and optionally the serial number, such "
                   "as \"0403:6001\" or \"0403:6001:A50285BI\"");
  }
  return table.Without({"port"}, "usb", "only one of them") && link->usb;
}

// The keys of a link, and the kinds that have them, in the order in which messages list them.
constexpr uint8_t Bit(LinkKind kind) {
  return static_cast<uint8_t>(1 << static_cast<int>(kind));
}
constexpr uint8_t kPty = Bit(LinkKind::kPty);
constexpr uint8_t kSerial = Bit(LinkKind::kSerial);
constexpr uint8_t kPorts = kPty | kSerial;
constexpr uint8_t kSockets = Bit(LinkKind::kTcp) | Bit(LinkKind::kUdp);
constexpr uint8_t kAll = kPorts | kSockets;
constexpr std::pair<std::string_view, uint8_t> kKeys[] = {
    {"name", kAll},
    {"kind", kAll},
    {"required", kAll},
    {"clients", kAll},
    {"security", kAll},
    {"keys", kAll},
    {"on", kPorts},
    {"path", kPty},
    {"port", kSerial},
    {"usb", kSerial},
    {"listen", kSockets},
    {"max_connections", Bit(LinkKind::kTcp)},
    {"baud", kPorts},
    {"silence_s", kSerial},
    {"medium_access", kPorts},
    {"slot_ms", kAll},
    {"response_window_ms", kAll},
    {"turnaround_ms", kPorts},
    {"adapter_latency_ms", kPorts},
    {"server_delay_ms", kPorts},
    {"carrier_sense", kSerial},
    {"ptt", kSerial},
    {"ptt_lead_ms", kSerial},
    {"ptt_tail_ms", kSerial},
    {"gap_timeout_ms", kPorts | Bit(LinkKind::kTcp)},
};

std::vector<std::string_view> KeysOf(LinkKind kind) {
  std::vector<std::string_view> keys;
  for (const auto& [key, kinds] : kKeys) {
    if ((kinds & Bit(kind)) != 0) {
      keys.push_back(key);
    }
  }
  return keys;
}

bool ReadAddress(const TableReader& table, LinkConfig* link) {
  switch (link->kind) {
    case LinkKind::kPty:
      link->path = table.String("path").value_or("");
      return !link->path.empty();
    case LinkKind::kSerial: {
      const bool has_port = ReadPort(table, link);
      const auto silence = table.Integer("silence_s", 0, 1'000'000, 0);
      if (!has_port || !silence) {
        return false;
      }
      link->silence_s = static_cast<uint32_t>(*silence);
      return true;
    }
    case LinkKind::kTcp:
    case LinkKind::kUdp: {
      const auto endpoint = ReadEndpoint(table, "listen");
      const auto connections = table.Integer("max_connections", 1, kMaxId, link->max_connections);
      if (!endpoint || !connections) {
        return false;
      }
      link->listen = *endpoint;
      link->max_connections = static_cast<uint16_t>(*connections);
      return true;
    }
  }
  return false;
}

// Properties that two links cannot share; conflicts.cc checks ports and paths.
std::string_view Clash(const LinkConfig& a, const LinkConfig& b) {
  if (a.name == b.name) {
    return "name";
  }
  return a.usb && a.usb == b.usb && !AreApart(a.on, b.on) ? "usb" : "";
}

// "10-20", both included; empty if it is not such a range of IDs.
std::optional<std::pair<int, int>> ParseRange(const Value& value) {
  if (value.kind == Value::Kind::kInteger) {
    const bool good = value.integer >= 1 && value.integer <= kMaxId;
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
                    range.first <= range.second && range.second <= kMaxId;
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
  link->admission.clients.reset();
  bool good = true;
  for (const Value& item : list->items) {
    const auto range = ParseRange(item);
    if (!range) {
      table.Expected("clients", item, kExpected);
      good = false;
      continue;
    }
    for (int id = range->first; id <= range->second; ++id) {
      link->admission.clients.set(static_cast<size_t>(id));
    }
  }
  return good;
}

// The nodes of the cluster that have the port.
bool ReadOn(const TableReader& table, const std::optional<ClusterSettings>& cluster,
            LinkConfig* link) {
  const Value* list = table.Find("on");
  if (list == nullptr) {
    return true;
  }
  if (!cluster) {
    table.Expected("on", *list, "no such key without [cluster]");
    return false;
  }
  std::string names;
  for (const ClusterSettings::Node& node : cluster->nodes) {
    names += (names.empty() ? "\"" : ", \"") + node.name + '"';
  }
  const std::string expected = "different nodes of [cluster], such as [" + names + "]";
  if (list->kind != Value::Kind::kArray || list->items.empty()) {
    table.Expected("on", *list, expected);
    return false;
  }
  for (const Value& item : list->items) {
    const bool is_node =
        std::any_of(cluster->nodes.begin(), cluster->nodes.end(),
                    [&](const ClusterSettings::Node& node) { return node.name == item.text; });
    if (item.kind != Value::Kind::kString || !is_node ||
        std::find(link->on.begin(), link->on.end(), item.text) != link->on.end()) {
      table.Expected("on", item, expected);
      return false;
    }
    link->on.push_back(item.text);
  }
  // When a transmission has left is known of channels with medium access only, and so when the next
  // server may send.
  if (link->on.size() > 1 && !link->medium_access) {
    table.Expected("on", *list, "one node, or medium_access = true");
    return false;
  }
  return true;
}

// Whether frames are signed, and by which keys. The file is not read without a folder, as of a
// token.
std::optional<signing::Keys> ReadSecurity(const TableReader& table, Notes* notes,
                                          LinkConfig* link) {
  const auto security = table.OneOf("security", kSecurities, 0);
  if (!security) {
    return std::nullopt;
  }
  link->security = static_cast<signing::Security>(*security);
  if (link->security == signing::Security::kOff) {
    return table.Without({"keys"}, "security = \"off\"", "security = \"accept\" or \"require\"")
               ? std::optional(signing::Keys())
               : std::nullopt;
  }
  if (table.Find("keys") == nullptr) {
    table.Missing("keys", "the file with the robots' keys, as pheromonectl keys new makes it");
    return std::nullopt;
  }
  const auto name = table.String("keys");
  if (!name || !notes->folder) {
    link->keys_path = name.value_or("");
    return name ? std::optional(signing::Keys()) : std::nullopt;
  }
  link->keys_path = (*notes->folder / *name).string();
  const auto file = signing::KeysFile::Read(link->keys_path);
  if (!file.ok()) {
    table.Report("keys", file.error());
    return std::nullopt;
  }
  if (file.value().robots().empty()) {
    Warn(table, "keys", "no robot has a key, so none is heard on this link", notes);
  }
  return file.value().keys();
}

void ReadLink(const TableReader& table, Notes* notes, Config* config) {
  const auto kind = table.OneOf("kind", kKinds);
  const auto name = ReadName(table);
  if (!kind) {
    return;
  }
  LinkConfig link;
  link.kind = static_cast<LinkKind>(*kind);
  table.AllowOnly(KeysOf(link.kind));
  const bool has_address = ReadAddress(table, &link);
  const bool has_medium = ReadMedium(table, &link);
  const bool has_clients = ReadClients(table, &link);
  const bool has_nodes = ReadOn(table, config->cluster, &link);
  auto keys = ReadSecurity(table, notes, &link);
  const auto required = table.Boolean("required", false);
  if (!keys || !name || !has_address || !has_medium || !has_clients || !has_nodes || !required) {
    return;
  }
  link.name = *name;
  link.required = *required;
  for (const LinkConfig& other : config->links) {
    if (const std::string_view key = Clash(link, other); !key.empty()) {
      table.Report(key, "found " + table.Find(key)->Describe() +
                            " again, expected a value not used by link \"" + other.name + '"');
      return;
    }
  }
  if (link.security != signing::Security::kOff) {
    config->keys[link.name] = *std::move(keys);
  }
  config->links.push_back(link);
  config->engine.links.push_back(
      {link.name, link.slot_ms, static_cast<uint8_t>(link.response_window_ms)});
}

}  // namespace

bool AreApart(const std::vector<std::string>& on, const std::vector<std::string>& other) {
  return !on.empty() && !other.empty() &&
         std::find_first_of(on.begin(), on.end(), other.begin(), other.end()) == on.end();
}

std::string PortPath(const std::string& port) {
  return (port.find('/') == std::string::npos ? "/dev/serial/by-id/" : "") + port;
}

void ReadLinks(const Value& root, Notes* notes, Config* config) {
  const std::vector<const Value*> tables = TablesOf(root, "link", notes, kMaxTables);
  for (size_t i = 0; i < tables.size(); ++i) {
    ReadLink(TableReader(*tables[i], PathOf("link", i), &notes->problems), notes, config);
  }
  if (tables.empty()) {
    notes->warnings.push_back({FormatProblem(
        notes->file, root.at, "link", "there is no [[link]], so no robot can reach the server")});
  }
}

}  // namespace pheromone::config
