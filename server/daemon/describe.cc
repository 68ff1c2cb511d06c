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
  const std::array<std::pair<std::string_view, uint64_t>, 4> troubles = {{
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
  const std::array<std::pair<std::string_view, uint64_t>, 24> losses = {{
      {"damaged", counters.received.crc_errors},
      {"bad escapes", counters.received.bad_escapes},
      {"oversize", counters.received.oversize},
      {"runts", counters.received.runts},
      {"refused", counters.received.refused},
      {"restarts", counters.received.restarts},
      {"timeouts", counters.received.timeouts},
      {"stray bytes", counters.received.ignored_bytes},
      {"late answers", counters.late_answers},
      {"dropped answers", counters.dropped_answers},
      {"withheld errors", counters.withheld_errors},
      {"ignored carriers", counters.ignored_carriers},
      {"undeliverable", counters.undeliverable},
      {"dropped connections", counters.dropped_connections},
      {"from clients not allowed", counters.not_allowed},
      {"too many at once", counters.too_many},
      {"framing errors", counters.line.framing},
      {"parity errors", counters.line.parity},
      {"overruns", counters.line.overruns},
      {"buffer overruns", counters.line.buffer_overruns},
      {"breaks", counters.line.breaks},
      {"oversize datagrams", counters.oversize_datagrams},
      {"dropped datagrams", counters.dropped_datagrams},
      {"opened again", counters.opened > 0 ? counters.opened - 1 : 0},
  }};
  for (const auto& [what, count] : losses) {
    if (count != 0) {
      line += fmt::format(", {} {}", what, count);
    }
  }
  return line;
}

}  // namespace pheromone::daemon
