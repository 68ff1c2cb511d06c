// States as diagnostic_msgs/DiagnosticArray.
//
//   Diagnostics diagnostics;
//   diagnostics.Add(Health::kWarning, "pheromone: robot tb1", "stands: halted", {{"id", "1"}});
//   diagnostics.Publish(publisher);
#pragma once

#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/ros2/node.h"
#include "client_fw/ros2/robot_report.h"
#include "client_fw/ros2/text.h"

namespace pheromone::ros2 {

class Diagnostics {
 public:
  void Add(Health health, std::string name, std::string message,
           const std::vector<std::pair<std::string, std::string>>& values) {
    auto& pairs = values_.emplace_back();
    for (const auto& [key, value] : values) {
      pairs.push_back({Keep(key), Keep(value)});
    }
    diagnostic_msgs_msg_dds__DiagnosticStatus_ status{};
    status.level = static_cast<uint8_t>(health);
    status.name = Keep(std::move(name));
    status.message = Keep(std::move(message));
    status.hardware_id = Keep("pheromone");
    PointAt(&status.values, &pairs);
    statuses_.push_back(status);
  }

  void Publish(const Publisher<DiagnosticArray>& publisher) {
    const std::string no_frame;
    DiagnosticArray message{MakeHeader(no_frame), {}};
    PointAt(&message.status, &statuses_);
    publisher.Publish(message);
  }

 private:
  char* Keep(std::string text) {
    texts_.push_back(std::move(text));
    return texts_.back().data();
  }

  std::vector<diagnostic_msgs_msg_dds__DiagnosticStatus_> statuses_;
  std::deque<std::string> texts_;
  std::deque<std::vector<diagnostic_msgs_msg_dds__KeyValue_>> values_;
};

}  // namespace pheromone::ros2
