#include "server/operators/ctl/parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <vector>

namespace pheromone::ctl {
namespace {

struct Parameter {
  int64_t number = 0;
  std::string_view name;
  std::string_view unit;
  std::vector<std::string_view> words;  // of the values from 0 on, or of the bits
  bool is_set = false;                  // of bits
};

const Parameter* Find(int64_t number) {
  static const std::vector<Parameter> parameters = {
      {1, "type", "", {}},
      {2, "law", "", {"differential", "paper", "fuzzy", "careful"}},
      {3, "lay_trail", "", {"no", "yes"}},
      {4, "lost_trail", "", {"straight ahead", "stop", "spiral", "search"}},
      {5, "gain_8ths", "eighths", {}},
      {6, "faintest", "1/4096 unit", {}},
      {7, "speed_mm_s", "mm/s", {}},
      {8, "period_ms", "ms", {}},
      {9, "fail_safe_ms", "ms", {}},
      {10, "lost_after_ms", "ms", {}},
      {11, "drive_scale", "1/10000 mm", {}},
      {12, "start_released", "", {"no", "yes"}},
      {13, "bumpers", "", {"no", "yes"}},
      {14, "sonar", "", {"no", "yes"}},
      {15, "low_battery_100mv", "0.1 V", {}},
      {16, "ptt_lead_ms", "ms", {}},
      {17, "ptt_tail_ms", "ms", {}},
      {128, "last reset", "", {"power-on", "reset pin", "brown-out", "watchdog"}, true},
      {129, "framing errors of the radio's UART", "", {}},
      {130, "overruns of the radio's UART", "", {}},
      {131, "framing errors of the robot's UART", "", {}},
      {132, "overruns of the robot's UART", "", {}},
      {133,
       "why it stands",
       "",
       {"no answer yet", "fail-safe", "halted", "off the map", "wrong protocol version",
        "no such pheromone", "trail lost", "pose lost"},
       true},
      {134,
       "alarms",
       "",
       {"stall", "bumper", "STOP button", "motors off", "odometry interrupted"},
       true},
      {135, "stalls and bumpers", "", {}},
      {136, "battery", "0.1 V", {}},
      {137, "distance ahead, 32767 if nothing is seen", "mm", {}},
      {138, "requests sent", "", {}},
      {139, "requests without an answer", "", {}},
      {140, "damaged frames heard", "", {}},
      {141, "fail-safe stops", "", {}},
  };
  const auto found = std::find_if(parameters.begin(), parameters.end(),
                                  [number](const Parameter& it) { return it.number == number; });
  return found != parameters.end() ? &*found : nullptr;
}

std::string WordsOf(const Parameter& parameter, int64_t value) {
  std::string words;
  for (size_t i = 0; i < parameter.words.size(); ++i) {
    const bool holds = parameter.is_set ? (value >> i & 1) != 0 : value == static_cast<int64_t>(i);
    if (holds) {
      words.append(words.empty() ? "" : ", ").append(parameter.words[i]);
    }
  }
  return words;
}

}  // namespace

std::string DescribeParameter(int64_t number, int64_t value) {
  const Parameter* parameter = Find(number);
  if (parameter == nullptr) {
    return fmt::format("parameter {}: {}", number, value);
  }
  if (parameter->unit == "0.1 V") {
    return fmt::format("{}: {}.{} V", parameter->name, value / 10, value % 10);
  }
  const std::string words = WordsOf(*parameter, value);
  return fmt::format("{}: {}{}{}{}", parameter->name, value, parameter->unit.empty() ? "" : " ",
                     parameter->unit, words.empty() ? "" : " (" + words + ")");
}

}  // namespace pheromone::ctl
