// A robot with a net in virtual time, at a naive bench. For tests only.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client_fw/core/tasks/net_robot.h"
#include "client_fw/core/testing/naive_bench.h"

namespace pheromone {
namespace client {

constexpr uint16_t kPaceMs = 200;
constexpr uint8_t kId = 7;
constexpr uint16_t kBoot = 4;

// The marking with this place alone, counted from 1 as in the net's file.
constexpr uint32_t At(int place) {
  return 1u << (place - 1);
}

inline const std::vector<std::string> kToldOfA = {
    "N1 present 1", "N1 pass 1",  "P choose A 2", "N5 leave 3", "S1 present 4", "S1 pass 4",
    "Src take 5",   "S3 leave 6", "N2 present 7", "N2 pass 7",  "P store A 8",  "N4 leave 9"};
inline const std::vector<std::string> kToldOfB = {
    "N1 present 1", "N1 pass 1",   "P choose B 2",  "N6 leave 10", "S2 present 11", "S2 pass 11",
    "Src take 12",  "S4 leave 13", "N3 present 14", "N3 pass 14",  "P store B 15",  "N4 leave 9"};

class NetRobotTest : public testing::Test {
 protected:
  NetRobotTest() { Start(); }

  void Start() {
    robot_ = std::make_unique<NetRobot>(kRobotNet, parameters_, kId, kBoot, &memory_);
  }

  // A turn of the robot's loop. What it asks is in asked_ until it is served.
  void Turn() {
    now_ms_ += 20;
    if (robot_->Step(NetStep{now_ms_, kPaceMs, 100, held_})) {
      robot_->exchange()->state = TagExchange::kAsked;
    }
    uint16_t tag = 0;
    if (robot_->TakeException(&tag)) {
      exception_tags_.push_back(tag);
      held_ = true;
    }
  }

  bool Asks() const { return robot_->exchange()->state == TagExchange::kAsked; }

  // Turns, answers, and the reader's instants between them.
  void Run(uint32_t ms) {
    for (const uint32_t end_ms = now_ms_ + ms; now_ms_ != end_ms;) {
      Turn();
      if (Asks()) {
        bench_.Serve(robot_->exchange());
      }
      if (now_ms_ % kPaceMs == kPaceMs / 2) {
        bench_.Act();
      }
    }
  }

  // Until it asks for this; not served.
  bool RunUntilAsked(uint8_t opcode, uint32_t limit_ms = 20000) {
    for (const uint32_t end_ms = now_ms_ + limit_ms; now_ms_ < end_ms;) {
      Turn();
      if (Asks() && robot_->exchange()->message.opcode == opcode) {
        return true;
      }
      if (Asks()) {
        bench_.Serve(robot_->exchange());
      }
      if (now_ms_ % kPaceMs == kPaceMs / 2) {
        bench_.Act();
      }
    }
    return false;
  }

  // Drives over a tag: captures it, and goes on if it is let.
  void Visit(const std::string& tag) {
    bench_.in_range = {bench_.tag(tag)};
    Run(2000);
    if (robot_->drives()) {
      bench_.in_range.clear();
      Run(400);
    }
  }
  void VisitAll(const std::vector<std::string>& tags) {
    for (const std::string& tag : tags) {
      Visit(tag);
    }
  }

  void Advise(uint8_t state) {
    bench_.at("P")->shown.state = state;
    bench_.Show(bench_.at("P"));
  }

  // What has been told: "N1 present 1".
  std::vector<std::string> Told() const {
    const char* const names[] = {"",         "present", "pass",    "leave", "choose A",
                                 "choose B", "store A", "store B", "take"};
    std::vector<std::string> told;
    for (const NaiveRecord& it : bench_.handled) {
      told.push_back(it.tag + " " + names[static_cast<int>(it.action)] + " " +
                     std::to_string(it.transition));
    }
    return told;
  }

  void Release() {
    held_ = false;
    Run(20);
  }

  void ExpectException(NetFault fault, const std::string& tag, uint32_t marking) {
    EXPECT_EQ(fault, robot_->fault());
    ASSERT_EQ(1u, exception_tags_.size());
    EXPECT_EQ(bench_.tag(tag), exception_tags_[0]);
    EXPECT_EQ(marking, robot_->marking());
    EXPECT_FALSE(robot_->drives());
    const int requests = bench_.requests;
    Run(5000);
    EXPECT_EQ(requests, bench_.requests) << "it does not stand still";
    exception_tags_.clear();
  }

  NaiveBench bench_;
  NetRobotParameters parameters_;
  NetMemory memory_ = {};
  std::unique_ptr<NetRobot> robot_;
  uint32_t now_ms_ = 5000;
  bool held_ = false;
  std::vector<uint16_t> exception_tags_;
};

}  // namespace client
}  // namespace pheromone
