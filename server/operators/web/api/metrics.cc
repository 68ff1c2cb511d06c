#include "server/operators/web/api/metrics.h"

#include <array>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/format.h"
#include "server/operators/control/names.h"

namespace pheromone::web {
namespace {

struct Label {
  std::string_view name;
  std::string_view value;
};

// Escapes characters as required by the format in help texts and label values.
std::string Escaped(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '\\':
        escaped += "\\\\";
        break;
      case '"':
        escaped += "\\\"";
        break;
      case '\n':
        escaped += "\\n";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

// Families are written one after the other, each with all its samples.
class Text {
 public:
  void Family(std::string_view name, std::string_view type, std::string_view help) {
    name_ = "pheromone_" + std::string(name);
    text_ += "# HELP " + name_ + ' ' + std::string(help) + "\n# TYPE " + name_ + ' ' +
             std::string(type) + '\n';
  }

  template <typename Number>
  void Sample(std::initializer_list<Label> labels, Number value, std::string_view suffix = "") {
    text_.append(name_).append(suffix);
    const char* before = "{";
    for (const Label& label : labels) {
      text_.append(before).append(label.name).append("=\"").append(Escaped(label.value)) += '"';
      before = ",";
    }
    text_ += (labels.size() != 0 ? "} " : " ") + ShortestText(value) + '\n';
  }

  template <typename Number>
  void Counter(std::string_view name, std::string_view help, Number value) {
    Family(name, "counter", help);
    Sample({}, value);
  }
  template <typename Number>
  void Gauge(std::string_view name, std::string_view help, Number value) {
    Family(name, "gauge", help);
    Sample({}, value);
  }

  std::string Take() { return std::move(text_); }

 private:
  std::string name_;
  std::string text_;
};

void AddProcess(const control::StatusView& status, Text* text) {
  text->Family("build_info", "gauge", "Always 1; the version is its label.");
  text->Sample({{"version", status.version}}, 1);
  text->Gauge("uptime_seconds", "Time since the start.", status.uptime_s);
  text->Gauge("resident_memory_bytes", "Memory of the process.", status.resident_bytes);
  text->Gauge("open_descriptors", "Open files and sockets of the process.",
              status.open_descriptors);
  text->Counter("cpu_seconds_total", "Processor time of the process.", status.cpu_s);
}

void AddCluster(const control::ClusterView& cluster, Text* text) {
  text->Family("cluster_leads", "gauge", "1: this server orders the changes of the cluster.");
  text->Sample({{"node", cluster.node}}, cluster.role == "leads" ? 1 : 0);
  text->Gauge("cluster_term", "Term of the leader.", cluster.term);
  text->Gauge("cluster_committed_sequence", "The last event that a majority has.",
              cluster.committed);
  text->Gauge("cluster_lag_events", "Events that are not applied here yet.", cluster.behind);
  text->Gauge("cluster_lag_seconds", "Time since the log was heard.", cluster.heard_s);
  text->Gauge("cluster_engine_up", "1: the engine of the log responds.",
              cluster.trouble.empty() ? 1 : 0);
  text->Counter("cluster_elections_total", "Changes of the leader.", cluster.elections);
  text->Counter("cluster_fenced_total", "Appends that were refused, since another server led.",
                cluster.fenced);
  text->Counter("cluster_forwarded_total", "Messages passed to the leader.", cluster.forwarded);
  text->Counter("cluster_divergences_total", "States of servers that were not the leader's.",
                cluster.divergences);
  text->Family("cluster_peer_up", "gauge", "1: there is a connection to this server.");
  for (const control::ClusterView::Peer& peer : cluster.peers) {
    text->Sample({{"peer", peer.node}}, peer.up ? 1 : 0);
  }
}

void AddEngine(const control::StatusView& status, Text* text) {
  text->Gauge("field_time_seconds", "Field time, by which pheromone evaporates.",
              static_cast<double>(status.field_time_ms) / 1e3);
  text->Gauge("log_sequence", "Sequence number of the last event of the log.", status.sequence);
  text->Gauge("log_durable_sequence", "Sequence number of the last durable event.",
              status.durable_sequence);
  text->Gauge("robots", "Robots that have sent HELLO.", status.robots);
  text->Gauge("field_nodes", "Nodes of the map that hold pheromone.", status.nodes);
  text->Gauge("field_tiles", "Tiles of 8 x 8 nodes in memory.", status.tiles);
  text->Gauge("field_memory_bytes", "Memory used for pheromone.", status.field_bytes);
  text->Gauge("field_memory_limit_bytes",
              "Memory limit for pheromone, beyond which the map is full.",
              status.field_limit_bytes);

  const engine::ServiceCounters& counters = status.service;
  std::map<std::string_view, uint64_t> by_name;
  for (size_t opcode = 0; opcode < status.requests_by_opcode.size(); ++opcode) {
    by_name[NameOfRequest(static_cast<uint8_t>(opcode))] += status.requests_by_opcode[opcode];
  }
  text->Family("requests_total", "counter", "Messages from robots, by request.");
  for (const auto& [name, count] : by_name) {
    text->Sample({{"request", name}}, count);
  }
  text->Counter("requests_ignored_total", "Messages that are not answered, such as echoes.",
                counters.ignored);
  text->Counter("answers_total", "Answers other than ERROR.", counters.answers);
  text->Counter("duplicates_total", "Changes that robots repeated because the answer was lost.",
                counters.repeats);
  text->Counter("changes_total", "Events that went through the log.", counters.changes);
  text->Counter("observations_total", "Accepted poses from trackers.", counters.observations);
  text->Counter("observations_refused_total",
                "Refused poses from trackers, such as of unknown robots.",
                counters.observations_refused);
  text->Family("errors_total", "counter", "ERROR answers, by reason.");
  for (size_t reason = 1; reason < counters.errors.size(); ++reason) {
    const std::string_view name = NameOf(static_cast<protocol::Reason>(reason));
    if (name != "unknown") {
      text->Sample({{"reason", name}}, counters.errors[reason]);
    }
  }
  text->Counter("id_conflicts_total", "Conflicts of two robots with the same ID.",
                status.engine.id_conflicts);
  text->Counter("commands_unanswered_total", "Commands that were not acknowledged.",
                status.engine.commands_unanswered);
  text->Counter("commands_unknown_total", "Commands whose robot restarted before it acknowledged.",
                status.engine.commands_unknown);
}

void AddTags(const tags::Figures& figures, const tags::Counters& counters, Text* text) {
  text->Gauge("tags", "Virtual RFID tags that are configured.", figures.configured);
  text->Gauge("tags_unconfigured", "Tags that are no longer configured, kept for their blocks.",
              figures.unconfigured);
  text->Gauge("tag_slots", "Slots of all tags.", figures.slots);
  text->Gauge("tag_blocks", "Slots in use, each by one block.", figures.blocks);
  text->Gauge("tag_leased_blocks", "Blocks that are erased when their lease ends.", figures.leased);
  text->Gauge("tag_definitions", "Rows of the symbol tables: robots, strings and mappings.",
              figures.definitions);
  text->Counter("tag_blocks_written_total", "Blocks written by robots and operators.",
                counters.writes);
  text->Counter("tag_blocks_dropped_total", "Blocks that others were written over.",
                counters.dropped);
  text->Counter("tag_leases_expired_total", "Blocks erased because their lease ended.",
                counters.expired);
}

void AddNets(const std::vector<control::NetView>& nets, Text* text) {
  const auto counter = [&](std::string_view name, std::string_view help,
                           uint64_t petri::LiveCounts::*count) {
    text->Family(name, "counter", help);
    for (const control::NetView& it : nets) {
      text->Sample({{"net", it.net.rules().settings.name}}, it.net.counts().*count);
    }
  };
  counter("net_firings_total", "Transitions of a Petri net that were fired.",
          &petri::LiveCounts::firings);
  counter("net_records_total", "Records that robots have left for a net.",
          &petri::LiveCounts::records);
  counter("net_exceptions_total", "Of these, those that were refused.",
          &petri::LiveCounts::exceptions);
  counter("net_deposits_total", "Deposits of pheromone on trails.", &petri::LiveCounts::deposits);
  counter("net_deposited_total", "Energy of these deposits.", &petri::LiveCounts::deposited);
  counter("net_taken_total", "Energy taken from the source.", &petri::LiveCounts::taken);
  counter("net_restored_total", "Blocks of a net that others had replaced.",
          &petri::LiveCounts::restored);
  counter("net_blocked_total", "Blocks of a net that a full tag did not take.",
          &petri::LiveCounts::blocked);
  text->Family("net_concentration", "gauge", "Pheromone of a trail, in units of energy.");
  for (const control::NetView& it : nets) {
    const petri::LiveSettings& settings = it.net.rules().settings;
    const auto add = [&](std::string_view trail, const petri::Trail& its) {
      const int64_t milli = petri::ConcentrationAt(settings.evaporation(), its, it.now_ms);
      text->Sample({{"net", settings.name}, {"trail", std::string(trail)}},
                   static_cast<double>(milli) / 1e3);
    };
    add("A", it.net.trails().a);
    add("B", it.net.trails().b);
  }
  text->Family("net_source_energy", "gauge", "What the source has left, if it can be emptied.");
  for (const control::NetView& it : nets) {
    if (it.net.rules().settings.has_source) {
      text->Sample({{"net", it.net.rules().settings.name}}, it.net.source_left());
    }
  }
  text->Family("net_since_firing_seconds", "gauge", "Time since a net's last firing.");
  for (const control::NetView& it : nets) {
    if (it.net.counts().firings != 0) {
      const uint64_t then_ms = std::min(it.net.last_firing_ms(), it.now_ms);
      text->Sample({{"net", it.net.rules().settings.name}},
                   static_cast<double>(it.now_ms - then_ms) / 1e3);
    }
  }
}

// Each bucket includes the previous ones.
void AddLatency(const engine::LatencyCounts& counts, Text* text) {
  text->Family("batch_seconds", "histogram",
               "Latency of a batch of requests, waiting for the engine and processing.");
  uint64_t count = 0;
  for (size_t i = 0; i < counts.by_class.size(); ++i) {
    count += counts.by_class[i];
    const bool last = i == engine::kLatencyEndsUs.size();
    text->Sample({{"le", last ? "+Inf" : ShortestText(engine::kLatencyEndsUs[i] / 1e6)}}, count,
                 "_bucket");
  }
  text->Sample({}, static_cast<double>(counts.sum_ns) / 1e9, "_sum");
  text->Sample({}, count, "_count");
}

void AddLinks(const std::vector<control::LinkView>& links, Text* text) {
  text->Family("link_up", "gauge", "1 while the link is up.");
  for (const control::LinkView& link : links) {
    text->Sample({{"link", link.name}, {"kind", link.kind}}, link.up ? 1 : 0);
  }
  text->Family("link_failed_attempts", "gauge",
               "Failed attempts to open a link since it was last up.");
  for (const control::LinkView& link : links) {
    text->Sample({{"link", link.name}}, link.failed_attempts);
  }
  text->Family("link_silent_seconds", "gauge", "Time since the last byte was received on a link.");
  for (const control::LinkView& link : links) {
    if (link.silent_s) {
      text->Sample({{"link", link.name}}, *link.silent_s);
    }
  }
  text->Family("link_capacity_bytes_per_second", "gauge", "Capacity of the line, if limited.");
  for (const control::LinkView& link : links) {
    if (link.byte_rate) {
      text->Sample({{"link", link.name}}, *link.byte_rate);
    }
  }
  text->Family("link_utilisation_ratio", "gauge",
               "Utilisation of the line in both directions, over about ten seconds.");
  for (const control::LinkView& link : links) {
    if (link.byte_rate) {
      text->Sample({{"link", link.name}}, link.bytes_per_s / *link.byte_rate);
    }
  }
  // All links count the same things, in the same order.
  for (size_t i = 0; !links.empty() && i < links.front().counters.size(); ++i) {
    const control::NamedCount& first = links.front().counters[i];
    text->Family("link_" + std::string(first.name) + "_total", "counter", first.help);
    for (const control::LinkView& link : links) {
      text->Sample({{"link", link.name}}, link.counters[i].count);
    }
  }
}

void AddCapture(const control::CaptureView& capture, Text* text) {
  text->Gauge("capture_recording", "1 while a recording is in progress.",
              capture.recording ? 1 : 0);
  text->Gauge("capture_failed", "1 if the last recording stopped by itself.",
              capture.error.empty() ? 0 : 1);
  text->Gauge("capture_bytes", "Bytes written in the present recording, or the last one.",
              capture.bytes);
  text->Gauge("capture_lost_records",
              "Records of that recording dropped because the disk was too slow.", capture.lost);
}

constexpr size_t kRobotStates = static_cast<size_t>(control::kLastRobotState) + 1;

void AddRobots(const std::vector<control::ClientView>& clients, Text* text) {
  const auto family = [&](std::string_view name, std::string_view help, auto value_of) {
    text->Family(name, "counter", help);
    for (const control::ClientView& client : clients) {
      text->Sample({{"link", client.link}, {"id", std::to_string(client.id)}}, value_of(client));
    }
  };
  family("robot_requests_total", "Messages from a robot.",
         [](const control::ClientView& it) { return it.traffic.requests; });
  family("robot_repeats_total", "Changes that a robot had to repeat.",
         [](const control::ClientView& it) { return it.traffic.repeats; });
  text->Family("robot_states", "gauge", "Robots of a link, by what they are doing.");
  std::map<std::string, std::array<uint64_t, kRobotStates>> by_link;
  for (const control::ClientView& client : clients) {
    ++by_link[client.link][static_cast<size_t>(client.condition.state)];
  }
  for (const auto& [link, counts] : by_link) {
    for (size_t state = 0; state < kRobotStates; ++state) {
      text->Sample(
          {{"link", link},
           {"state", std::string(control::NameOf(static_cast<control::RobotState>(state)))}},
          counts[state]);
    }
  }
  text->Family("robot_silent_seconds", "gauge", "Time since a robot's last message.");
  for (const control::ClientView& client : clients) {
    if (client.silent_ms) {
      text->Sample({{"link", client.link}, {"id", std::to_string(client.id)}},
                   static_cast<double>(*client.silent_ms) / 1e3);
    }
  }
}

}  // namespace

std::string Metrics(const control::Control& control) {
  const control::StatusView status = control.GetStatus(false);
  Text text;
  AddProcess(status, &text);
  AddEngine(status, &text);
  if (status.cluster) {
    AddCluster(*status.cluster, &text);
  }
  AddTags(status.tags, status.tag_counters, &text);
  AddNets(control.GetNets(), &text);
  AddLatency(status.latency, &text);
  AddCapture(status.capture, &text);
  AddLinks(control.GetLinks(), &text);
  AddRobots(control.GetClients(), &text);
  return text.Take();
}

std::string StreamMetrics(const StreamCounters& counters, const StreamCounters& replays) {
  Text text;
  text.Gauge("viewers", "Viewers connected to the stream.", counters.viewers.load());
  text.Counter("viewers_accepted_total", "Viewers that have connected.", counters.accepted.load());
  text.Counter("viewers_refused_total", "Viewers refused: too many, or not permitted.",
               counters.refused.load());
  text.Counter("viewers_stalled_total", "Viewers disconnected since they did not read.",
               counters.stalled.load());
  text.Counter("viewer_sent_frames_total", "Frames of channels sent to viewers.",
               counters.sent_frames.load());
  text.Counter("viewer_sent_bytes_total", "Bytes sent to viewers.", counters.sent_bytes.load());
  text.Counter("viewer_dropped_frames_total",
               "Frames replaced by newer ones before a viewer could take them.",
               counters.dropped_frames.load());
  text.Gauge("replays", "Recordings that are being replayed for viewers.", replays.viewers.load());
  text.Counter("replays_accepted_total", "Replays of recordings that have begun.",
               replays.accepted.load());
  text.Counter("replays_refused_total", "Replays refused: too many, or not permitted.",
               replays.refused.load());
  return text.Take();
}

std::string AccessMetrics(uint64_t unauthorized) {
  Text text;
  text.Counter("unauthorized_total",
               "Changes refused for want of the token, or since another web page asked for them.",
               unauthorized);
  return text.Take();
}

std::string TlsMetrics(const TlsCounters& counters) {
  Text text;
  text.Gauge("tls_connections", "Connections with TLS, also those that are not established yet.",
             counters.connections.load());
  text.Counter("tls_handshakes_total", "TLS handshakes that succeeded.", counters.accepted.load());
  text.Counter("tls_handshakes_failed_total",
               "TLS handshakes that failed, or took too long; plain HTTP on the port of HTTPS.",
               counters.failed.load());
  return text.Take();
}

}  // namespace pheromone::web
