#include "server/robots/links/link_counters.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

namespace pheromone::links {
namespace {

// Written down a second time, so that a row that counts something else is noticed.
TEST(LinkCountersTest, EachNameTellsItsCounter) {
  LinkCounters counters;
  counters.received = {.frames = 1,
                       .crc_errors = 2,
                       .bad_escapes = 3,
                       .oversize = 4,
                       .runts = 5,
                       .refused = 6,
                       .restarts = 7,
                       .timeouts = 8,
                       .ignored_bytes = 9};
  counters.line = {
      .framing = 10, .parity = 11, .overruns = 100, .buffer_overruns = 1000, .breaks = 12};
  counters.rounds = {.rounds = 13, .coded = 1300, .turns = 14, .missed = 15, .unanswered = 16};
  counters.late_answers = 17;
  counters.dropped_answers = 18;
  counters.withheld_errors = 19;
  counters.ignored_carriers = 20;
  counters.bytes_in = 21;
  counters.bytes_out = 22;
  counters.frames_out = 23;
  counters.opened = 24;
  counters.undeliverable = 25;
  counters.dropped_connections = 26;
  counters.not_allowed = 27;
  counters.too_many = 28;
  counters.datagrams_in = 29;
  counters.oversize_datagrams = 30;
  counters.dropped_datagrams = 31;
  counters.signing = {.unsigned_frames = 32, .unknown_robots = 33, .wrong_tags = 34};
  std::map<std::string, uint64_t> found;
  for (const LinkCounter& it : kLinkCounters) {
    EXPECT_TRUE(found.emplace(it.name, it.count(counters)).second) << it.name << " twice";
  }
  const std::map<std::string, uint64_t> expected = {
      {"received_frames", 1},
      {"crc_errors", 2},
      {"bad_escapes", 3},
      {"oversize_frames", 4},
      {"runt_frames", 5},
      {"refused_frames", 6},
      {"restarted_frames", 7},
      {"gap_timeouts", 8},
      {"stray_bytes", 9},
      {"framing_errors", 10},
      {"parity_errors", 11},
      {"overruns", 1100},
      {"breaks", 12},
      {"rounds", 13},
      {"coded_rounds", 1300},
      {"turns", 14},
      {"missed_turns", 15},
      {"unanswered_turns", 16},
      {"late_answers", 17},
      {"dropped_answers", 18},
      {"withheld_errors", 19},
      {"ignored_carriers", 20},
      {"received_bytes", 21},
      {"sent_bytes", 22},
      {"sent_frames", 23},
      {"openings", 24},
      {"undeliverable", 25},
      {"dropped_connections", 26},
      {"not_allowed", 27},
      {"too_many", 28},
      {"received_datagrams", 29},
      {"oversize_datagrams", 30},
      {"dropped_datagrams", 31},
      {"unsigned_frames", 32},
      {"unknown_robots", 33},
      {"wrong_signatures", 34},
  };
  EXPECT_EQ(found, expected);
}

}  // namespace
}  // namespace pheromone::links
