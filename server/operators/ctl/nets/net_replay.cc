#include "server/operators/ctl/nets/net_replay.h"

#include <algorithm>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <boost/json/object.hpp>
#include <boost/json/serialize.hpp>

#include "server/core/engine/engine.h"
#include "server/core/engine/event_codec.h"
#include "server/operators/ctl/journal_commands.h"
#include "server/operators/ctl/server_call.h"
#include "server/store/journal/event_reader.h"
#include "server/store/journal/posix_folder.h"
#include "server/store/journal/snapshot.h"

namespace pheromone::ctl {
namespace {

namespace json = boost::json;
using engine::Engine;
using journal::PosixFolder;
using journal::Record;

json::object MarkingOf(const petri::LiveNet& net) {
  json::object marking;
  const petri::LiveSettings& settings = net.rules().settings;
  for (size_t i = 0; i < settings.net.places.size(); ++i) {
    if (net.marking()[i] != 0) {
      marking[settings.net.places[i].id] = net.marking()[i];
    }
  }
  return marking;
}

class Replayer {
 public:
  Replayer(std::string net, std::ostream* out) : net_(std::move(net)), out_(out) {}

  /// Events up to its sequence are not applied again.
  void StartFrom(Engine engine) {
    engine_ = std::move(engine);
    TellBeginnings("snapshot");
  }

  Status Take(const Record& record) {
    if (record.sequence <= engine_.sequence()) {
      return Ok();
    }
    ByteReader reader(record.event);
    engine::Event event = engine::DecodeEvent(&reader);
    reader.ExpectEnd();
    const std::string what = "event " + std::to_string(record.sequence) + ": ";
    if (!reader.ok()) {
      return Error{what + reader.error()};
    }
    if (record.sequence != engine_.sequence() + 1) {
      return Error{what + "expected event " + std::to_string(engine_.sequence() + 1) +
                   ", or a snapshot of the state before"};
    }
    Status possible = engine_.Prepare(&event);
    possible = possible.ok() ? engine_.Check(event) : possible;
    if (!possible.ok()) {
      return Error{what + possible.error()};
    }
    messages_.clear();
    engine_.Apply(record.sequence, record.stamp, event, &messages_);
    if (std::holds_alternative<engine::Advance>(event)) {
      TellFirings();
    } else if (std::holds_alternative<engine::ConfigChanged>(event)) {
      TellBeginnings("configuration");
    } else if (const auto* const reset = std::get_if<engine::NetsChanged>(&event)) {
      known_.erase(reset->net);
      TellBeginnings("reset");
    }
    return Ok();
  }

  void TellEnds() {
    for (const auto& [name, it] : engine_.nets().nets()) {
      Tell(name, [&net = it.net](json::object* line) { (*line)["ends"] = MarkingOf(net); });
    }
  }

 private:
  template <typename Add>
  void Tell(std::string_view net, const Add& add) {
    if (net_.empty() || net_ == net) {
      json::object line{{"sequence", engine_.sequence()},
                        {"field_time_ms", engine_.field_time_ms()},
                        {"net", net}};
      add(&line);
      *out_ << json::serialize(line) << '\n';
    }
  }

  void TellBeginnings(std::string_view from) {
    const auto& nets = engine_.nets().nets();
    std::erase_if(known_, [&](const std::string& name) { return nets.count(name) == 0; });
    for (const auto& [name, it] : nets) {
      if (known_.insert(name).second) {
        Tell(name, [&net = it.net, from](json::object* line) {
          (*line)["begins"] = MarkingOf(net);
          (*line)["from"] = from;
        });
      }
    }
  }

  void TellFirings() {
    const tags::SymbolTables& symbols = engine_.tags().symbols();
    for (const engine::NetFiring& it : engine_.nets().fired()) {
      const petri::LiveNet& net = engine_.nets().nets().find(it.net)->second.net;
      Tell(it.net, [&](json::object* line) {
        (*line)["transition"] = net.rules().settings.net.transitions[it.transition].id;
        (*line)["robot"] = it.robot;
        if (const std::string* const unique_id = symbols.UniqueIdOf(it.robot)) {
          (*line)["robot_id"] = *unique_id;
        }
      });
    }
  }

  std::string net_;
  std::ostream* out_;
  Engine engine_;
  std::set<std::string> known_;  // nets whose beginning was told
  std::vector<engine::Outgoing> messages_;
};

// The oldest readable snapshot; nothing if there is none.
std::optional<Engine> OldestState(const PosixFolder& folder) {
  const auto names = folder.List();
  std::vector<std::pair<uint64_t, std::string>> snapshots;
  for (const std::string& name : names.ok() ? names.value() : std::vector<std::string>{}) {
    if (const auto sequence = journal::SnapshotSequenceOf(name)) {
      snapshots.emplace_back(*sequence, name);
    }
  }
  std::sort(snapshots.begin(), snapshots.end());
  for (const auto& [sequence, name] : snapshots) {
    uint64_t byte = 0;
    auto read = journal::ReadSnapshot(folder, name, &byte);
    if (read.ok()) {
      return std::move(read).value().engine;
    }
  }
  return std::nullopt;
}

}  // namespace

int ReplayNets(const std::string& path, const std::string& net, const std::string& output) {
  const auto folder = PosixFolder::Open(path, PosixFolder::Mode::kReader);
  if (!folder.ok()) {
    return Fail(kFailed, folder.error());
  }
  std::ofstream file;
  if (!output.empty()) {
    file.open(output);
    if (!file) {
      return Fail(kFailed, output + ": cannot be written");
    }
  }
  std::ostream& out = output.empty() ? std::cout : file;
  Replayer replayer(net, &out);
  Status taken = Ok();
  bool has_begun = false;
  const auto walked = journal::WalkEvents(*folder.value(), [&](const Record& record) {
    if (!has_begun && record.sequence != 1) {
      if (std::optional<Engine> state = OldestState(*folder.value())) {
        replayer.StartFrom(std::move(*state));
      }
    }
    has_begun = true;
    taken = taken.ok() ? replayer.Take(record) : taken;
  });
  if (!walked.ok() || !taken.ok()) {
    return Fail(kFailed, path + ": " + (walked.ok() ? taken.error() : walked.error()));
  }
  const int status = ReportEnd(walked.value());
  replayer.TellEnds();
  out.flush();
  return out ? status : Fail(kFailed, output + ": cannot be written");
}

}  // namespace pheromone::ctl
