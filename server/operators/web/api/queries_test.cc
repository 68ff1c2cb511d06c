// What the API tells of the server, its links and the robots that it knows.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>

#include "server/operators/web/testing/api_fixture.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;

class QueriesTest : public testing::ApiFixture {};

TEST_F(QueriesTest, HealthIs503WithTheReasonWhileNoChangesAreTaken) {
  control_.outcome = Error{"the disk is full"};
  EXPECT_EQ(Refusal(Get("/healthz")),
            "503 : the disk is full, expected a log that accepts changes and a disk that responds");
}

TEST_F(QueriesTest, StatusHasTheHashOnlyIfAskedFor) {
  control_.status.sequence = 12;
  EXPECT_TRUE(Parsed(Get("/api/v1/status")).at("state_hash").is_null());
  const json::value status = Parsed(Get("/api/v1/status?hash=1"));
  EXPECT_EQ(status.at("state_hash").as_string(), "0123456789abcdef");
  EXPECT_EQ(status.at("sequence").to_number<int>(), 12);
}

TEST_F(QueriesTest, StatusWarnsOfWhatMakesTheServerUnhealthy) {
  EXPECT_TRUE(Parsed(Get("/api/v1/status")).at("warning").is_null());
  control_.status.warning = "no response from the disk for 2.1 s";
  EXPECT_EQ(Parsed(Get("/api/v1/status")).at("warning").as_string(),
            "no response from the disk for 2.1 s");
}

TEST_F(QueriesTest, ConfigurationsAreLines) {
  EXPECT_EQ(Get("/api/v1/config").body,
            "{\"lines\":[\"a \\\"map\\\"\",\"two\\nlines\"],\"file\":\"/lab.toml\","
            "\"journal\":null}\n");
}

TEST_F(QueriesTest, TrackersTellWhatTheyRefuseAndWhy) {
  control_.trackers = {{.name = "ceiling",
                        .address = "127.0.0.1:4960",
                        .up = true,
                        .state = "udp 127.0.0.1:4960",
                        .datagrams = 9,
                        .poses = 5,
                        .refusals = {{"unknown link", 4}},
                        .last_refusal = "unknown link: \"pose x 1 0 0 0\""},
                       {}};
  const json::value view = Parsed(Get("/api/v1/trackers"));
  EXPECT_EQ(view.at("trackers").at(0),
            (json::object{{"name", "ceiling"},
                          {"address", "127.0.0.1:4960"},
                          {"up", true},
                          {"state", "udp 127.0.0.1:4960"},
                          {"datagrams", 9},
                          {"poses", 5},
                          {"refusals", json::array{{{"reason", "unknown link"}, {"count", 4}}}},
                          {"last_refusal", "unknown link: \"pose x 1 0 0 0\""}}));
  EXPECT_TRUE(view.at("trackers").at(1).at("last_refusal").is_null());
}

TEST_F(QueriesTest, LinksTellUtilisationOnlyWhereTheLineHasALimit) {
  control::LinkView serial;
  serial.name = "radio-a";
  serial.up = true;
  serial.byte_rate = 960;
  serial.bytes_per_s = 240;
  serial.counters = {{"rounds", "", 7, false, false},
                     {"stray_bytes", "", 90, true, false},
                     {"crc_errors", "", 3, true, true},
                     {"breaks", "", 0, true, true},
                     {"too_many", "", 4, true, true}};
  serial.revoked = {8};
  control_.links = {serial, {}};
  const json::value view = Parsed(Get("/api/v1/links"));
  const json::array& links = view.at("links").as_array();
  ASSERT_EQ(links.size(), 2u);
  EXPECT_EQ(links[0].at("utilisation").to_number<double>(), 0.25);
  EXPECT_EQ(
      links[0].at("counters"),
      (json::object{
          {"rounds", 7}, {"stray_bytes", 90}, {"crc_errors", 3}, {"breaks", 0}, {"too_many", 4}}));
  EXPECT_EQ(links[0].at("losses"),
            (json::object{{"stray_bytes", 90}, {"crc_errors", 3}, {"too_many", 4}}));
  EXPECT_EQ(links[0].at("errors"), 7);
  EXPECT_EQ(links[0].at("revoked"), json::array{8});
  EXPECT_EQ(links[1].at("revoked"), json::array());
  EXPECT_TRUE(links[0].at("terminal").is_null());
  EXPECT_TRUE(links[1].at("utilisation").is_null());
}

TEST_F(QueriesTest, LinksTellWhyTheyAreDownAndWhatIsTriedOrHowLongTheyAreSilent) {
  control::LinkView down;
  down.state = "no such port";
  down.last_error = "no such port";
  down.failed_attempts = 4;
  down.next_attempt_s = 2.5;
  control::LinkView quiet;
  quiet.up = true;
  quiet.silent = true;
  quiet.silent_s = 61.5;
  down.terminal = "/dev/ttyUSB0";
  quiet.role = "standby";
  quiet.nodes = {"m", "n"};
  quiet.owner = "m";
  control_.links = {down, quiet};
  const json::value view = Parsed(Get("/api/v1/links"));
  const json::value& first = view.at("links").as_array()[0];
  EXPECT_EQ(first.at("last_error").as_string(), "no such port");
  EXPECT_EQ(first.at("terminal").as_string(), "/dev/ttyUSB0");
  EXPECT_EQ(first.at("failed_attempts").to_number<int>(), 4);
  EXPECT_EQ(first.at("next_attempt_s").to_number<double>(), 2.5);
  EXPECT_TRUE(first.at("silent_s").is_null());
  EXPECT_FALSE(first.at("silent").as_bool());
  EXPECT_EQ(first.at("role").as_string(), "serves");
  EXPECT_EQ(first.at("nodes"), json::array{});
  EXPECT_TRUE(first.at("owner").is_null());
  const json::value& second = view.at("links").as_array()[1];
  EXPECT_EQ(second.at("role").as_string(), "standby");
  EXPECT_EQ(second.at("nodes"), (json::array{"m", "n"}));
  EXPECT_EQ(second.at("owner").as_string(), "m");
  EXPECT_EQ(second.at("failed_attempts").to_number<int>(), 0);
  EXPECT_TRUE(second.at("next_attempt_s").is_null());
  EXPECT_EQ(second.at("silent_s").to_number<double>(), 61.5);
  EXPECT_TRUE(second.at("silent").as_bool());
}

TEST_F(QueriesTest, PathsAreTheCurvesThatWereConfigured) {
  control_.config.paths = {{.type = 1, .closed = true, .points = {{0, 0}, {1'500'000, -250'000}}},
                           {.type = 14, .points = {{7, 7}}}};
  const json::value view = Parsed(Get("/api/v1/paths"));
  ASSERT_EQ(view.at("paths").as_array().size(), 2u);
  const json::value& first = view.at("paths").as_array()[0];
  EXPECT_EQ(first.at("pheromone").as_string(), control_.config.FindLaw(1)->name);
  EXPECT_TRUE(first.at("closed").as_bool());
  EXPECT_EQ(first.at("points_m").as_array()[1].as_array()[0].to_number<double>(), 1.5);
  EXPECT_EQ(first.at("points_m").as_array()[1].as_array()[1].to_number<double>(), -0.25);
  EXPECT_TRUE(view.at("paths").as_array()[1].at("pheromone").is_null());  // there is no type 14
}

TEST_F(QueriesTest, ClientsTellWhatIsKnownOfThem) {
  control::ClientView client;
  client.link = "radio-a";
  client.id = 7;
  client.known = true;
  client.silent_ms = 2500;
  client.pose_source = control::PoseSource::kTracker;
  client.pose = {{1'500'000, -250'000}, 16384};
  client.follows = "path";
  client.robot.hello.nonce = 9;
  client.robot.hello.round_period = 10;
  client.robot.last_event = protocol::EventReport{7, 1, protocol::EventCode::kObstacle, -3};
  client.robot.command.outcome = engine::CommandOutcome::kRefused;
  client.robot.command.command.code = protocol::CommandCode::kSpeed;
  client.robot.command.result = 11;
  control_.clients = {client, {}};
  const json::value view = Parsed(Get("/api/v1/clients"));
  const json::value& first = view.at("clients").as_array()[0];
  EXPECT_EQ(first.at("silent_s").to_number<double>(), 2.5);
  EXPECT_EQ(first.at("follows").as_string(), "path");
  EXPECT_TRUE(view.at("clients").as_array()[1].at("follows").is_null());
  EXPECT_EQ(first.at("pose").at("x_m").to_number<double>(), 1.5);
  EXPECT_EQ(first.at("pose").at("heading_deg").to_number<double>(), 90);
  EXPECT_EQ(first.at("pose").at("source").as_string(), "tracker");
  EXPECT_EQ(first.at("round_period_ms").as_int64(), 200);
  EXPECT_EQ(first.at("last_event").at("event").as_string(), "obstacle");
  EXPECT_EQ(first.at("last_command").at("command").as_string(), "speed");
  EXPECT_EQ(first.at("last_command").at("reason").as_string(), "bad value");
  const json::value& second = view.at("clients").as_array()[1];
  EXPECT_TRUE(second.at("silent_s").is_null());
  EXPECT_TRUE(second.at("pose").is_null());
  EXPECT_TRUE(second.at("last_command").is_null());
}

}  // namespace
}  // namespace pheromone::web
