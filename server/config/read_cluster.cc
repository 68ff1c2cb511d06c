// [cluster]: several daemons with one map.
#include <algorithm>
#include <string>
#include <string_view>

#include "server/base/hex.h"
#include "server/base/text.h"
#include "server/config/sections.h"

namespace pheromone::config {
namespace {

constexpr size_t kLeastSecretDigits = 64;
constexpr size_t kMaxSecretDigits = 512;
constexpr int64_t kLeastBeats = 4;  // until a leader is suspected
constexpr int64_t kMaxSuspectMs = 60'000;

using Node = ClusterSettings::Node;

std::string ListOf(const std::vector<Node>& nodes) {
  std::string list;
  for (const Node& node : nodes) {
    list += (list.empty() ? "\"" : ", \"") + node.name + '"';
  }
  return list;
}

bool Has(const std::vector<Node>& nodes, std::string_view name) {
  return std::any_of(nodes.begin(), nodes.end(),
                     [name](const Node& node) { return node.name == name; });
}

constexpr std::string_view kScheme = "http://";

std::optional<Endpoint> ParseEngineUrl(std::string_view text) {
  if (!text.starts_with(kScheme)) {
    return std::nullopt;
  }
  text.remove_prefix(kScheme.size());
  const auto endpoint = ParseEndpoint(text);
  return endpoint && endpoint->port != 0 ? endpoint : std::nullopt;
}

void ReadEngine(const TableReader& table, std::vector<Endpoint>* engine) {
  static constexpr std::string_view kExpected =
      "1 to 9 different numeric addresses of etcd's members, http://ADDRESS:PORT, such as "
      "[\"http://10.0.0.1:2379\"]";
  const Value* list = table.Find("engine");
  if (list == nullptr) {
    table.Missing("engine", kExpected);
    return;
  }
  if (list->kind != Value::Kind::kArray || list->items.empty() ||
      list->items.size() > ClusterSettings::kMaxMachines) {
    table.Expected("engine", *list, kExpected);
    return;
  }
  for (const Value& item : list->items) {
    const bool is_text = item.kind == Value::Kind::kString;
    const auto member = is_text ? ParseEngineUrl(item.text) : std::nullopt;
    if (is_text && item.text.starts_with("https://")) {
      table.Expected(
          "engine", item,
          "http://ADDRESS:PORT: there is no TLS between the server and etcd, whose ports "
          "belong on a network of the cluster's own");
    } else if (!member || std::find(engine->begin(), engine->end(), *member) != engine->end()) {
      table.Expected("engine", item, kExpected);
    } else {
      engine->push_back(*member);
    }
  }
}

void ReadNodes(const TableReader& table, std::vector<Node>* nodes) {
  static constexpr std::string_view kExpected =
      "a table of 1 to 9 names and addresses, such as {a = \"10.0.0.1:8390\", b = "
      "\"10.0.0.2:8390\"}";
  const auto inside = table.Table("nodes", kExpected);
  if (!inside) {
    return;
  }
  const Value& list = *table.Find("nodes");
  if (list.items.empty() || list.items.size() > ClusterSettings::kMaxMachines) {
    table.Expected("nodes", list, kExpected);
    return;
  }
  for (const Value& item : list.items) {
    if (!IsName(item.key)) {
      inside->Report(item.key,
                     "found the name \"" + item.key + "\", expected " + std::string(kNameExpected));
      continue;
    }
    const auto address = ReadEndpoint(*inside, item.key);
    if (!address) {
      continue;
    }
    if (address->port == 0) {
      inside->Expected(item.key, item, "a port that the other nodes can know, not 0");
      continue;
    }
    const auto same = std::find_if(nodes->begin(), nodes->end(),
                                   [&](const Node& node) { return node.address == *address; });
    if (same != nodes->end()) {
      inside->Report(item.key, "found " + item.Describe() +
                                   " again, expected a value not used by node \"" + same->name +
                                   '"');
      continue;
    }
    nodes->push_back({item.key, *address});
  }
  std::sort(nodes->begin(), nodes->end(),
            [](const Node& a, const Node& b) { return a.name < b.name; });
}

// The node that this machine is: as the command line says, or the file, or the host's name.
void ReadOwnNode(const TableReader& table, const std::optional<Machine>& machine,
                 ClusterSettings* cluster) {
  const std::vector<Node>& nodes = cluster->nodes;
  if (const Value* value = table.Find("node")) {
    const auto name = table.String("node");
    if (name && !Has(nodes, *name)) {
      table.Expected("node", *value, "one of " + ListOf(nodes));
      return;
    }
    cluster->node = name.value_or("");
  }
  if (!machine) {
    return;
  }
  if (!machine->node.empty()) {
    if (!Has(nodes, machine->node)) {
      table.Report("nodes", "found no node \"" + machine->node +
                                "\", which --node says, expected " + "one of " + ListOf(nodes));
    }
    cluster->node = machine->node;
  } else if (cluster->node.empty()) {
    const std::string& host = machine->host_name;
    for (const std::string& name : {host, host.substr(0, host.find('.'))}) {
      cluster->node = cluster->node.empty() && Has(nodes, name) ? name : cluster->node;
    }
    if (cluster->node.empty()) {
      table.Missing("node", "one of " + ListOf(nodes) +
                                ", or the option --node: none is named as " + "this machine, \"" +
                                host + '"');
    }
  }
}

// Bytes in hexadecimal digits.
std::optional<std::string> ParseSecret(std::string_view digits) {
  return digits.size() < kLeastSecretDigits || digits.size() > kMaxSecretDigits ? std::nullopt
                                                                                : ParseHex(digits);
}

void ReadSecret(const TableReader& table, const Notes& notes, std::string* secret) {
  if (table.Find("secret_file") == nullptr) {
    table.Missing("secret_file", "a file with the secret that all nodes have");
    return;
  }
  if (!table.String("secret_file") || !notes.folder) {  // as of a token
    return;
  }
  const auto file = ReadNamedFile(table, "secret_file", 4096, notes);
  if (!file) {
    return;
  }
  const auto bytes = ParseSecret(Trim(file->text, " \t\r\n"));
  if (!bytes) {
    table.Report("secret_file",
                 file->path +
                     ": expected at least 32 bytes as 64 to 512 hexadecimal digits, such "
                     "as the output of `openssl rand -hex 32`; the same on all machines");
  } else if (const std::string why = WhyNotSecret(file->path); !why.empty()) {
    table.Report("secret_file", why);
  }
  *secret = bytes.value_or("");
}

}  // namespace

void ReadCluster(const Value& root, const std::optional<Machine>& machine, Notes* notes,
                 std::optional<ClusterSettings>* cluster) {
  if (root.Find("cluster") == nullptr) {
    return;
  }
  const TableReader table(TableOf(root, "cluster", notes), "cluster", &notes->problems);
  if (root.Find("cluster")->kind != Value::Kind::kTable) {
    return;
  }
  table.AllowOnly({"name", "engine", "nodes", "node", "secret_file", "suspect_ms", "group_ms"});
  ClusterSettings& settings = cluster->emplace();
  settings.name = ReadName(table).value_or("");
  ReadEngine(table, &settings.engine);
  ReadNodes(table, &settings.nodes);
  if (!settings.nodes.empty()) {
    ReadOwnNode(table, machine, &settings);
  }
  ReadSecret(table, *notes, &settings.secret);
  // A heartbeat or two may be late or lost; a group delays answers by as much as is waited for it.
  constexpr int64_t kBeatMs = ClusterSettings::kHeartbeatMs;
  settings.suspect_ms = static_cast<uint32_t>(
      table.Integer("suspect_ms", kLeastBeats * kBeatMs, kMaxSuspectMs, settings.suspect_ms)
          .value_or(0));
  settings.group_ms =
      static_cast<uint32_t>(table.Integer("group_ms", 1, kBeatMs, settings.group_ms).value_or(0));
}

void CheckJournalOfCluster(const Value& root, Notes* notes, const Config& config) {
  if (config.cluster && config.journal.durability == JournalConfig::Durability::kNone) {
    const TableReader journal(TableOf(root, "journal", notes), "journal", &notes->problems);
    journal.Expected("durability", *journal.Find("durability"),
                     "\"durable\" or \"relaxed\": a cluster needs a journal on each machine");
  }
}

}  // namespace pheromone::config
