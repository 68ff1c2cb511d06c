// The metrics' text, read by a parser of the test's own.

#include "server/operators/web/api/metrics.h"

#include <gtest/gtest.h>

#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "server/operators/web/testing/fake_control.h"

namespace pheromone::web {
namespace {

struct Exposition {
  std::map<std::string, std::string> types;    // family -> type
  std::map<std::string, std::string> samples;  // name and labels -> value
};

// Fails the test for whatever the format does not allow.
Exposition Parse(const std::string& text) {
  static const std::regex help(R"(# HELP ([a-z_]+) .+\.)");
  static const std::regex type(R"(# TYPE ([a-z_]+) (counter|gauge|histogram))");
  static const std::regex sample(
      R"re(([a-z_]+)(\{[a-z_]+="(?:[^"\\\n]|\\[\\"n])*"(?:,[a-z_]+="(?:[^"\\\n]|\\[\\"n])*")*\})? (-?[0-9.]+(?:e[-+][0-9]+)?))re");
  Exposition read;
  std::set<std::string> helped;
  std::string family;
  EXPECT_TRUE(text.empty() || text.back() == '\n');
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (std::regex_match(line, match, help)) {
      EXPECT_TRUE(helped.insert(match[1]).second) << "twice: " << line;
      family = match[1];
    } else if (std::regex_match(line, match, type)) {
      EXPECT_EQ(family, match[1]) << line;
      read.types[match[1]] = match[2];
    } else if (std::regex_match(line, match, sample)) {
      std::string name = match[1];
      if (read.types[family] == "histogram") {
        name = std::regex_replace(name, std::regex("_(bucket|sum|count)$"), "");
      }
      EXPECT_EQ(family, name) << "outside of its family: " << line;
      EXPECT_TRUE(read.samples.emplace(match[1].str() + match[2].str(), match[3]).second) << line;
    } else {
      ADD_FAILURE() << "neither comment nor sample: " << line;
    }
  }
  return read;
}

TEST(MetricsTest, EverySampleStandsInAFamilyWithHelpAndType) {
  testing::FakeControl control;
  control::LinkView link;
  link.name = "radio-a";
  link.kind = "serial";
  link.failed_attempts = 3;
  link.byte_rate = 960;
  link.bytes_per_s = 96;
  link.counters = {{"received_frames", "Frames.", 5}, {"crc_errors", "Damaged.", 2}};
  control::LinkView other = link;
  other.name = "net";
  other.up = true;
  other.failed_attempts = 0;
  other.silent_s = 2.5;
  other.byte_rate.reset();
  other.counters[0].count = 70'000'000'000;
  control.links = {link, other};
  control::ClientView client;
  client.link = "radio-a";
  client.id = 7;
  client.traffic.requests = 12;
  client.silent_ms = 1500;
  control.clients = {client};
  control.status.version = "1.2";
  control.status.requests_by_opcode[0x01] = 3;
  control.status.requests_by_opcode[0x0F] = 4;
  control.status.requests_by_opcode[0x71] = 1;
  control.status.requests_by_opcode[0x00] = 9;
  control.status.service.errors[9] = 6;
  engine::LatencyHistogram latency;
  for (const uint64_t ns : {1'000u, 900u, 4'999u, 5'000u, 2'001u, 249'986'100u}) {
    latency.Count(ns);
  }
  control.status.latency = latency.counts();
  control.status.capture.recording = true;
  control.status.capture.bytes = 5'000'000'000;
  control.status.capture.lost = 2;

  control.status.service.errors[static_cast<size_t>(protocol::Reason::kTagFull)] = 8;
  control.status.requests_by_opcode[protocol::kScan] = 11;
  control.status.tags = {20'000, 3, 160'024, 70'000, 12, 65'536};
  control.status.tag_counters = {90'000, 20'000, 4};

  const Exposition read = Parse(Metrics(control));
  const auto value = [&](const std::string& key) {
    const auto found = read.samples.find("pheromone_" + key);
    return found != read.samples.end() ? found->second : "missing " + key;
  };
  EXPECT_EQ(value("build_info{version=\"1.2\"}"), "1");
  EXPECT_EQ(value("link_up{link=\"radio-a\",kind=\"serial\"}"), "0");
  EXPECT_EQ(value("link_up{link=\"net\",kind=\"serial\"}"), "1");
  EXPECT_EQ(value("link_failed_attempts{link=\"radio-a\"}"), "3");
  EXPECT_EQ(value("link_failed_attempts{link=\"net\"}"), "0");
  EXPECT_EQ(read.samples.count("pheromone_link_silent_seconds{link=\"radio-a\"}"), 0u);
  EXPECT_EQ(value("link_silent_seconds{link=\"net\"}"), "2.5");
  EXPECT_EQ(value("link_received_frames_total{link=\"net\"}"), "70000000000");
  EXPECT_EQ(value("link_crc_errors_total{link=\"radio-a\"}"), "2");
  EXPECT_EQ(value("link_utilisation_ratio{link=\"radio-a\"}"), "0.1");
  EXPECT_EQ(read.samples.count("pheromone_link_utilisation_ratio{link=\"net\"}"), 0u);
  EXPECT_EQ(value("requests_total{request=\"sense\"}"), "7");
  EXPECT_EQ(value("requests_total{request=\"hello\"}"), "1");
  EXPECT_EQ(value("requests_total{request=\"unknown\"}"), "9");
  EXPECT_EQ(value("errors_total{reason=\"map full\"}"), "6");
  EXPECT_EQ(value("errors_total{reason=\"tag full\"}"), "8");
  EXPECT_EQ(value("requests_total{request=\"scan\"}"), "11");
  EXPECT_EQ(value("tags"), "20000");
  EXPECT_EQ(value("tags_unconfigured"), "3");
  EXPECT_EQ(value("tag_slots"), "160024");
  EXPECT_EQ(value("tag_blocks"), "70000");
  EXPECT_EQ(value("tag_leased_blocks"), "12");
  EXPECT_EQ(value("tag_definitions"), "65536");
  EXPECT_EQ(value("tag_blocks_written_total"), "90000");
  EXPECT_EQ(value("tag_blocks_dropped_total"), "20000");
  EXPECT_EQ(value("tag_leases_expired_total"), "4");
  EXPECT_EQ(value("robot_requests_total{link=\"radio-a\",id=\"7\"}"), "12");
  EXPECT_EQ(value("robot_silent_seconds{link=\"radio-a\",id=\"7\"}"), "1.5");
  EXPECT_EQ(value("capture_recording"), "1");
  EXPECT_EQ(value("capture_failed"), "0");
  EXPECT_EQ(value("capture_bytes"), "5000000000");
  EXPECT_EQ(value("capture_lost_records"), "2");
  // 2 took up to 1 us, 3 up to 5 us, 1 longer than all: 6 in all.
  EXPECT_EQ(value("batch_seconds_bucket{le=\"1e-06\"}"), "2");
  EXPECT_EQ(value("batch_seconds_bucket{le=\"2e-06\"}"), "2");
  EXPECT_EQ(value("batch_seconds_bucket{le=\"0.1\"}"), "5");
  EXPECT_EQ(value("batch_seconds_bucket{le=\"+Inf\"}"), "6");
  EXPECT_EQ(value("batch_seconds_count"), "6");
  EXPECT_EQ(value("batch_seconds_sum"), "0.25");
  for (const auto& [family, type] : read.types) {
    const bool total = family.ends_with("_total");
    EXPECT_EQ(type == "counter", total) << family;
  }
}

TEST(MetricsTest, ARecordingThatEndedByItselfIsSeen) {
  testing::FakeControl control;
  control.status.capture.error = "the disk is full";
  const Exposition read = Parse(Metrics(control));
  EXPECT_EQ(read.samples.at("pheromone_capture_recording"), "0");
  EXPECT_EQ(read.samples.at("pheromone_capture_failed"), "1");
}

TEST(MetricsTest, LabelsAreEscaped) {
  testing::FakeControl control;
  control.status.version = "a\"b\\c\nd";
  const Exposition read = Parse(Metrics(control));
  EXPECT_EQ(read.samples.count("pheromone_build_info{version=\"a\\\"b\\\\c\\nd\"}"), 1u);
}

}  // namespace
}  // namespace pheromone::web
