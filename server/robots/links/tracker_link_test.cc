#include "server/robots/links/tracker_link.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <stdexcept>
#include <utility>

#include "server/robots/links/testing/link_bench.h"
#include "server/robots/links/testing/net_peer.h"

namespace pheromone::links {
namespace {

using engine::testing::Hello;
using testing::Eventually;
using testing::PortOf;

// A tracker for robots 1 and 2 of "radio-a", and a socket that sends to it.
class TrackerLinkTest : public ::testing::Test {
 protected:
  TrackerLinkTest() : service_(&log_, [] { return engine::ClockReading{1'000, 0}; }) {
    EXPECT_TRUE(service_.Configure(engine::testing::SmallConfig(), 7).ok());
    std::vector<engine::Outgoing> out;
    service_.Handle(0, std::vector{Hello(1, 1), Hello(2, 1)}, &out);
  }
  void TearDown() override { StopAll(); }

  // A second one for tests that need it.
  Status Start(GpsToMap gps_to_map = nullptr) {
    trackers_.push_back(std::make_unique<TrackerLink>(
        io_, config_, &service_, std::move(gps_to_map),
        [this](const LinkNotice& notice) {
          const std::lock_guard lock(mutex_);
          lines_.push_back(ToText(notice));
        },
        BackoffOptions{std::chrono::milliseconds(5), std::chrono::milliseconds(20), 1}));
    Status status = trackers_.back()->Start();
    if (!thread_.joinable()) {
      thread_ = std::thread([this] { io_.run(); });
    }
    return status;
  }

  void StopAll() {
    for (const auto& tracker : trackers_) {
      tracker->Stop();
    }
    if (thread_.joinable()) {
      thread_.join();
    }
  }

  // Sends a datagram and waits until it was dealt with.
  void Send(const std::string& text) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(PortOf(trackers_[0]->address()));
    const Descriptor handle(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    const ssize_t sent = sendto(handle.get(), text.data(), text.size(), 0,
                                reinterpret_cast<const sockaddr*>(&to), sizeof to);
    ASSERT_EQ(sent, static_cast<ssize_t>(text.size()));
    ++sent_;
    ASSERT_TRUE(Eventually([this] { return trackers_[0]->counters().datagrams == sent_; }));
  }

  std::optional<engine::ObservedPose> SeenOf(uint8_t id) {
    return service_.Inspect(
        [id](const engine::Engine& engine) { return engine.robots().Find(0, id)->observed; });
  }

  uint64_t Faults(TrackerFault fault) {
    return trackers_[0]->counters().faults[static_cast<size_t>(fault)];
  }

  std::vector<std::string> lines() {
    const std::lock_guard lock(mutex_);
    return lines_;
  }

  boost::asio::io_context io_;
  engine::VolatileLog log_;
  engine::Service service_;
  TrackerConfig config_{.listen = {"127.0.0.1", 0}, .valid_ms = 700};
  std::vector<std::unique_ptr<TrackerLink>> trackers_;
  std::thread thread_;
  std::mutex mutex_;
  std::vector<std::string> lines_;
  uint64_t sent_ = 0;
};

TEST_F(TrackerLinkTest, APoseReachesItsRobot) {
  ASSERT_TRUE(Start().ok());
  Send("pose radio-a 1 2.3500004 -0.9 90\n");
  const auto seen = SeenOf(1);
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->pose.position, (field::PointUm{2'350'000, -900'000}));
  EXPECT_EQ(seen->pose.heading, 16384);
  EXPECT_EQ(seen->until_ms,
            service_.Inspect([](const auto& it) { return it.field_time_ms(); }) + uint64_t{700});
  EXPECT_FALSE(SeenOf(2));
  EXPECT_EQ(trackers_[0]->counters().poses, 1u);
}

TEST_F(TrackerLinkTest, HeadingsOfAnySignBecomeBinaryAngles) {
  ASSERT_TRUE(Start().ok());
  const struct {
    const char* degrees;
    uint16_t heading;
  } cases[] = {{"-90", 49152}, {"360", 0},     {"-360", 0},
               {"359.999", 0}, {"180", 32768}, {"0.005493164", 1}};
  for (const auto& it : cases) {
    Send(std::string("pose radio-a 1 0 0 ") + it.degrees);
    EXPECT_EQ(SeenOf(1)->pose.heading, it.heading) << it.degrees;
  }
}

TEST_F(TrackerLinkTest, OneDatagramMayHoldManyRobots) {
  ASSERT_TRUE(Start().ok());
  Send("pose radio-a 1 1 1 0\r\npose radio-a 2 2 2 0\r\n\r\npose radio-a 3 3 3 0");
  EXPECT_EQ(SeenOf(1)->pose.position, (field::PointUm{1'000'000, 1'000'000}));
  EXPECT_EQ(SeenOf(2)->pose.position, (field::PointUm{2'000'000, 2'000'000}));
  EXPECT_EQ(trackers_[0]->counters().poses, 2u);
  EXPECT_EQ(trackers_[0]->counters().not_taken, 0u);
}

TEST_F(TrackerLinkTest, APoseOfARobotThatHasNotSaidHelloIsRefusedByName) {
  ASSERT_TRUE(Start().ok());
  Send("pose radio-a 1 1 1 0\npose radio-a 3 3 3 0\n");
  EXPECT_EQ(Faults(TrackerFault::kNoHello), 1u);
  EXPECT_EQ(trackers_[0]->counters().poses, 1u);
  EXPECT_EQ(trackers_[0]->counters().last_fault,
            "the robot has not said HELLO: \"pose radio-a 3 3 3 0\"");
  EXPECT_EQ(lines().back(),
            "tracker: 1 lines refused, the last one: the robot has not said HELLO: "
            "\"pose radio-a 3 3 3 0\"");
}

TEST_F(TrackerLinkTest, PlacesOnTheEarthGoThroughTheMapsOwnConversion) {
  std::optional<GpsFix> asked;
  ASSERT_TRUE(Start([&asked](const GpsFix& fix) {
                asked = fix;
                return field::PoseUm{{11, 22}, 33};
              }).ok());
  Send("gps radio-a 1 47.5 8.25 90 408");
  EXPECT_EQ(asked, (GpsFix{47.5, 8.25, 90, 408}));
  EXPECT_EQ(SeenOf(1)->pose.position, (field::PointUm{11, 22}));
  EXPECT_EQ(SeenOf(1)->pose.heading, 33);
}

TEST_F(TrackerLinkTest, APlaceThatTheMapCannotHaveIsOutOfRange) {
  ASSERT_TRUE(Start([](const GpsFix&) { return std::nullopt; }).ok());
  Send("gps radio-a 1 -47.5 -171.75 90");
  EXPECT_FALSE(SeenOf(1));
  EXPECT_EQ(Faults(TrackerFault::kOutOfRange), 1u);
}

TEST_F(TrackerLinkTest, AMapThatIsNowhereOnTheEarthTakesNoPlaces) {
  ASSERT_TRUE(Start().ok());
  Send("gps radio-a 1 47.5 8.25 90");
  EXPECT_FALSE(SeenOf(1));
  EXPECT_EQ(Faults(TrackerFault::kNoDatum), 1u);
}

TEST_F(TrackerLinkTest, BadLinesAreCountedByReasonAndDoNotSpoilGoodOnes) {
  ASSERT_TRUE(Start().ok());
  Send(
      "pose radio-a x 1 1 0\npose radio-z 1 1 1 0\nhello\npose radio-a 1 1 nan 0\n"
      "pose radio-a 1 1 1\npose radio-a 1 1 1 999\npose radio-a 1 5 5 0\n");
  for (const TrackerFault fault :
       {TrackerFault::kBadId, TrackerFault::kUnknownLink, TrackerFault::kUnknownKind,
        TrackerFault::kBadNumber, TrackerFault::kWordCount, TrackerFault::kOutOfRange}) {
    EXPECT_EQ(Faults(fault), 1u) << TextOf(fault);
  }
  EXPECT_EQ(SeenOf(1)->pose.position, (field::PointUm{5'000'000, 5'000'000}));
}

TEST_F(TrackerLinkTest, AFloodOfBadLinesIsToldInAFewWords) {
  ASSERT_TRUE(Start().ok());
  Send("pose radio-a 1 \x1B[31m 1 0" + std::string(300, 'x'));
  std::string flood;
  for (int i = 0; i < 1000; ++i) {
    flood += "?\n";
  }
  Send(flood);
  ASSERT_TRUE(Eventually([this] { return lines().size() == 3; }));  // up, the first, the rest
  EXPECT_NE(lines()[1].find("1 lines refused, the last one: not a plain decimal number"),
            std::string::npos)
      << lines()[1];
  EXPECT_EQ(lines()[1].find('\x1B'), std::string::npos);
  EXPECT_LT(lines()[1].size(), 200u);
  EXPECT_NE(lines()[2].find("1000 lines refused"), std::string::npos) << lines()[2];
}

TEST_F(TrackerLinkTest, LinesBeyondTheLimitOfADatagramAreNotRead) {
  ASSERT_TRUE(Start().ok());
  std::string many;
  for (size_t i = 0; i < kMaxTrackerLines; ++i) {
    many += "pose radio-a 1 1 1 0\n";
  }
  Send(many + "pose radio-a 2 1 1 0\n");
  EXPECT_EQ(trackers_[0]->counters().poses, kMaxTrackerLines);
  EXPECT_EQ(Faults(TrackerFault::kTooManyLines), 1u);
  EXPECT_FALSE(SeenOf(2));
}

TEST_F(TrackerLinkTest, AnEmptyDatagramIsNothing) {
  ASSERT_TRUE(Start().ok());
  Send("");
  Send("pose radio-a 1 1 1 0");
  EXPECT_TRUE(SeenOf(1));
}

TEST_F(TrackerLinkTest, APortInUseIsToldAndTriedAgain) {
  ASSERT_TRUE(Start().ok());
  config_.listen.port = PortOf(trackers_[0]->address());
  const Status second = Start();
  ASSERT_FALSE(second.ok());
  EXPECT_NE(second.error().find("Address already in use"), std::string::npos);
  EXPECT_EQ(trackers_[1]->address(), "");
  trackers_[0]->Stop();
  EXPECT_TRUE(Eventually([this] { return !trackers_[1]->address().empty(); }));
}

TEST_F(TrackerLinkTest, AnAddressThatIsNoneIsAnError) {
  config_.listen.address = "localhost";
  EXPECT_FALSE(Start().ok());
}

TEST_F(TrackerLinkTest, AnExceptionCostsADatagramAndIsTold) {
  bool thrown = false;
  ASSERT_TRUE(Start([&thrown](const GpsFix&) -> std::optional<field::PoseUm> {
                if (!std::exchange(thrown, true)) {
                  throw std::runtime_error("out of order");
                }
                return field::PoseUm{{1, 2}, 3};
              }).ok());
  Send("gps radio-a 1 47.5 8.25 90");
  EXPECT_FALSE(SeenOf(1).has_value());
  EXPECT_EQ(lines().back(), "tracker: internal error: out of order; a datagram was dropped");
  Send("gps radio-a 1 47.5 8.25 90");
  EXPECT_TRUE(SeenOf(1).has_value());
}

}  // namespace
}  // namespace pheromone::links
