#include "server/daemon/describe.h"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "protocol/opcodes.h"
#include "server/operators/control/names.h"

namespace pheromone::daemon {

std::vector<std::string> DescribeCounters(const engine::ServiceCounters& counters) {
  std::vector<std::string> lines = {fmt::format(
      "requests {}, answers {} ({} repeated), changes {}, ignored {}", counters.requests,
      counters.answers, counters.repeats, counters.changes, counters.ignored)};
  std::string errors;
  for (size_t reason = 0; reason < counters.errors.size(); ++reason) {
    if (counters.errors[reason] != 0) {
      errors +=
          fmt::format("{}{} {}", errors.empty() ? "" : ", ",
                      web::NameOf(static_cast<protocol::Reason>(reason)), counters.errors[reason]);
    }
  }
  lines.push_back("errors: " + (errors.empty() ? "none" : errors));
  return lines;
}

std::string DescribeTrouble(const engine::RobotCounters& counters) {
  const std::array<std::pair<std::string_view, uint64_t>, 3> troubles = {{
      {"ID conflicts (two robots under one ID)", counters.id_conflicts},
      {"commands unanswered", counters.commands_unanswered},
      {"commands with unknown outcome (the robot restarted)", counters.commands_unknown},
  }};
  std::string text;
  for (const auto& [what, count] : troubles) {
    if (count != 0) {
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", what, count);
    }
  }
  return text;
}

std::string DescribeLink(const std::string& name, const links::LinkCounters& counters) {
  std::string line = fmt::format("link {}: {} frames in {} bytes received, {} in {} bytes sent",
                                 name, counters.received.frames, counters.bytes_in,
                                 counters.frames_out, counters.bytes_out);
  for (const links::LinkCounter& it : links::kLinkCounters) {
    const uint64_t count = it.count(counters);
    if (it.kind != links::CounterKind::kTraffic && count != 0) {
      line += fmt::format(", {} {}", count, it.name);
    }
  }
  if (counters.opened > 1) {
    line += fmt::format(", opened {} times", counters.opened);
  }
  return line;
}

std::string DescribeKeys(const signing::Keys& before, const signing::Keys& after) {
  std::string revoked;
  std::string changed;
  std::string added;
  for (const auto& [id, key] : before) {
    const auto now = after.find(id);
    if (now == after.end()) {
      revoked += fmt::format(" {}", id);
    } else if (now->second != key) {
      changed += fmt::format(" {}", id);
    }
  }
  for (const auto& [id, key] : after) {
    added += before.contains(id) ? "" : fmt::format(" {}", id);
  }
  std::string text;
  const std::pair<std::string_view, std::string> parts[] = {
      {"revoked", revoked}, {"changed", changed}, {"added", added}};
  for (const auto& [what, ids] : parts) {
    if (!ids.empty()) {
      text += fmt::format("{}{}{}", text.empty() ? "" : ", ", what, ids);
    }
  }
  return text;
}

}  // namespace pheromone::daemon
