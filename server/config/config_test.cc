#include "server/config/config.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "server/base/file.h"

namespace pheromone::config {
namespace {

// The example of the specification, character by character what users are told to write.
constexpr std::string_view kExample = R"([map]
width_m = 10.0
height_m = 10.0
cell_m = 0.1            # a
[antennas]
bias_m = 0.33           # b
[[pheromone]]
type = 1
name = "trail"
core_m = 0.1            # c
sigma_m = 0.4           # σ
tau_s = 30.0            # τ; 0 = never evaporates
quantum = 0.125         # Q
maximum = 1.0
directional = true
[[link]]
name = "radio-a"
kind = "pty"            # later: "serial" (port, baud), "tcp" and "udp" (listen)
path = "radio-a.pty"    # a symbolic link to the slave side, made by the daemon
)";

Config Parse(std::string_view text) {
  Result<Config> parsed = ParseConfig(text, "test.toml");
  EXPECT_TRUE(parsed.ok()) << parsed.error();
  return parsed.ok() ? std::move(parsed).value() : Config{};
}

TEST(ConfigTest, TheExampleBecomesTheseIntegers) {
  const Config config = Parse(kExample);
  const field::FieldConfig& field = config.engine.field;
  EXPECT_EQ(field.map, (field::MapGeometry{{0, 0}, 10'000'000, 10'000'000, 100'000}));
  EXPECT_EQ(field.antennas, (field::AntennaGeometry{330'000, 0, 16384}));
  ASSERT_EQ(field.pheromones.size(), 1u);
  field::PheromoneLaw trail;
  trail.type = 1;
  trail.name = "trail";
  trail.core_um = 100'000;
  trail.sigma_um = 400'000;
  trail.tau_ms = 30'000;
  trail.quantum_micro = 125'000;
  trail.max_count = 8;
  EXPECT_EQ(field.pheromones[0], trail);
  EXPECT_TRUE(field.paths.empty());
  EXPECT_EQ(field.memory_bytes, uint64_t{1} << 30);
  EXPECT_EQ(config.engine.pose_unit_10um, 100);
  ASSERT_EQ(config.engine.links.size(), 1u);
  EXPECT_EQ(config.engine.links[0], (engine::LinkSettings{"radio-a", 1, 100}));
  ASSERT_EQ(config.links.size(), 1u);
  links::LinkConfig link;
  link.name = "radio-a";
  link.kind = links::LinkKind::kPty;
  link.path = "radio-a.pty";
  EXPECT_EQ(config.links[0], link);
  EXPECT_EQ(config.daemon, DaemonSettings{});
}

TEST(ConfigTest, EveryKeyArrivesWhereItBelongs) {
  const Config config = Parse(R"(
[map]
width_m = 60
height_m = 20.5
cell_m = 0.05
origin_x_m = -30
origin_y_m = -1.25
pose_unit_mm = 2.5
datum = {latitude_deg = 47.25, longitude_deg = -8.5, height_m = 408}
[antennas]
bias_m = 0.5
forward_m = -0.25
angle_deg = 60
[[pheromone]]
type = 15
name = "a"
core_m = 0
sigma_m = 0.000001
tau_s = 0.001
quantum = 0.000001
maximum = 0.065535
directional = false
[[path]]
pheromone = "a"
points_m = [[-30, -1.25], [30, 19.25], [0.1, 0.2]]
closed = true
intensity = 0.00001
[[path]]
name = "ring"
shape = "circle"
pheromone = 15
center_m = [0.0, 5]
radius_m = 1.5
[[link]]
name = "usb"
kind = "serial"
port = "/dev/ttyUSB0"
baud = 250000
turnaround_ms = 3
adapter_latency_ms = 1
server_delay_ms = 12
slot_ms = 7
response_window_ms = 40
gap_timeout_ms = 50
required = true
[[link]]
name = "v4"
kind = "tcp"
listen = "127.0.0.1:4950"
max_connections = 200
[[link]]
name = "v6"
kind = "tcp"
listen = "[::1]:4951"
gap_timeout_ms = 5
[[frame]]
link = "v6"
id = 254
x_m = -1.5
y_m = 0.25
heading_deg = 90
[[tracker]]
name = "ceiling"
listen = "[::1]:4960"
valid_s = 0.25
[[tracker]]
name = "gps"
listen = "0.0.0.0:4961"
[limits]
field_memory_mib = 16
[daemon]
io_threads = 4
log_level = "debug"
)");
  const field::FieldConfig& field = config.engine.field;
  EXPECT_EQ(field.map,
            (field::MapGeometry{{-30'000'000, -1'250'000}, 60'000'000, 20'500'000, 50'000}));
  EXPECT_EQ(config.engine.pose_unit_10um, 250);
  EXPECT_EQ(config.datum, (maps::Wgs84{47.25, -8.5, 408}));
  // A sixth of a turn: 65 536 / 6 = 10 922.67.
  EXPECT_EQ(field.antennas, (field::AntennaGeometry{500'000, -250'000, 10'923}));
  ASSERT_EQ(field.pheromones.size(), 1u);
  field::PheromoneLaw a;
  a.type = 15;
  a.name = "a";
  a.tau_ms = 1;
  a.max_count = 65535;
  a.directional = false;
  EXPECT_EQ(field.pheromones[0], a);
  ASSERT_EQ(field.paths.size(), 2u);
  EXPECT_EQ(
      field.paths[0],
      (field::Path{15,
                   10,
                   true,
                   {{-30'000'000, -1'250'000}, {30'000'000, 19'250'000}, {100'000, 200'000}}}));
  EXPECT_EQ(field.paths[1].count, 65535);
  EXPECT_TRUE(field.paths[1].closed);
  EXPECT_EQ(field.paths[1].points, field::CirclePoints({0, 5'000'000}, 1'500'000, 25'000));
  ASSERT_EQ(config.links.size(), 3u);
  links::LinkConfig usb;
  usb.name = "usb";
  usb.kind = links::LinkKind::kSerial;
  usb.path = "/dev/ttyUSB0";
  usb.baud = 250'000;
  usb.medium_access = true;
  usb.adapter_latency_ms = 1;
  usb.server_delay_ms = 12;
  usb.required = true;
  usb.turnaround_ms = 3;
  usb.gap_timeout_ms = 50;
  usb.slot_ms = 7;
  usb.response_window_ms = 40;
  EXPECT_EQ(config.links[0], usb);
  links::LinkConfig tcp;
  tcp.name = "v4";
  tcp.kind = links::LinkKind::kTcp;
  tcp.listen = {"127.0.0.1", 4950};
  tcp.gap_timeout_ms = 10'000;
  tcp.max_connections = 200;
  EXPECT_EQ(config.links[1], tcp);
  EXPECT_EQ(config.links[2].listen.address, "::1");
  EXPECT_EQ(config.links[2].gap_timeout_ms, 5);
  EXPECT_EQ(config.engine.links[0], (engine::LinkSettings{"usb", 7, 40}));
  engine::RobotFrame frame;
  frame.link = "v6";
  frame.id = 254;
  frame.x_um = -1'500'000;
  frame.y_um = 250'000;
  frame.heading = 16384;  // a quarter turn: cos 0, sin 1
  frame.cos_q30 = 0;
  frame.sin_q30 = 1 << 30;
  EXPECT_EQ(config.engine.frames, std::vector<engine::RobotFrame>{frame});
  EXPECT_EQ(config.trackers, (std::vector<links::TrackerConfig>{{"ceiling", {"::1", 4960}, 250},
                                                                {"gps", {"0.0.0.0", 4961}, 1000}}));
  EXPECT_EQ(field.memory_bytes, uint64_t{16} << 20);
  EXPECT_EQ(config.daemon, (DaemonSettings{4, "debug"}));
  ASSERT_EQ(config.warnings.size(), 1u);
  EXPECT_NE(config.warnings[0].text.find("less than a cell"), std::string::npos);
}

// T_t = 2 ms and a byte of 1.04 ms at 9600 baud, rounded up: slot T_t + B, window 2 T_t + 26 + 2 B.
TEST(ConfigTest, ASerialLinksTimesFollowFromItsBaudRate) {
  std::string text(kExample);
  text += "[[link]]\nname = \"s\"\nkind = \"serial\"\nport = \"/dev/ttyS0\"\n";
  const Config config = Parse(text);
  ASSERT_EQ(config.links.size(), 2u);
  EXPECT_EQ(config.links[1].baud, 9600u);
  EXPECT_EQ(config.links[1].turnaround_ms, 2);
  EXPECT_EQ(config.links[1].slot_ms, 4);
  EXPECT_EQ(config.links[1].response_window_ms, 33);
  EXPECT_EQ(config.links[1].gap_timeout_ms, 20);
}

// A server whose transmitter is keyed at once still waits for the robot's modem.
TEST(ConfigTest, TheWindowOfAKeyedLineLetsTheRobotsModemTurnRound) {
  std::string text(kExample);
  text += "[[link]]\nname = \"s\"\nkind = \"serial\"\nport = \"/dev/ttyS0\"\nptt = \"rs485\"\n";
  text += "turnaround_ms = 20\nadapter_latency_ms = 0\n";
  EXPECT_EQ(Parse(text).links[1].response_window_ms, 43);  // 20 + 20 + 2 B
  EXPECT_EQ(Parse(text + "server_delay_ms = 30\n").links[1].response_window_ms, 53);
  EXPECT_EQ(Parse(text + "ptt_lead_ms = 15\n").links[1].response_window_ms, 48);
}

// What an adapter holds back for 50 ms arrives in pieces that far apart.
TEST(ConfigTest, TheGapTimeoutIsLongerThanTheAdapterHoldsBytesBack) {
  std::string text(kExample);
  text += "[[link]]\nname = \"s\"\nkind = \"serial\"\nport = \"/dev/ttyS0\"\n";
  EXPECT_EQ(Parse(text + "adapter_latency_ms = 16\n").links[1].gap_timeout_ms, 20);
  EXPECT_EQ(Parse(text + "adapter_latency_ms = 50\n").links[1].gap_timeout_ms, 53);  // and 2 B
}

// At 300 baud a byte takes 33.3 ms and four of them 133.3 ms.
TEST(ConfigTest, TheGapTimeoutOfASlowLineLetsItsBytesThrough) {
  std::string text(kExample);
  text += "[[link]]\nname = \"s\"\nkind = \"serial\"\nport = \"/dev/ttyS0\"\nbaud = 300\n";
  EXPECT_EQ(Parse(text).links[1].gap_timeout_ms, 134);
  EXPECT_EQ(Parse(text + "gap_timeout_ms = 67\n").links[1].gap_timeout_ms, 67);
  EXPECT_EQ(Parse(text + "gap_timeout_ms = 0\n").links[1].gap_timeout_ms, 0);
}

TEST(ConfigTest, WholeNumbersServeAsDecimalsAndDecimalsThatAreNotExactInBinaryAreExactHere) {
  std::string text(kExample);
  text.replace(text.find("10.0"), 4, "10");
  text.replace(text.find("0.33 "), 5, "0.003");
  text.replace(text.find("cell_m = 0.1"), 12, "cell_m = 0.30000000000000004");
  const Config config = Parse(text);
  EXPECT_EQ(config.engine.field.map.width_um, 10'000'000);
  EXPECT_EQ(config.engine.field.map.cell_um, 300'000);
  EXPECT_EQ(config.engine.field.antennas.distance_um, 3'000);
}

TEST(ConfigTest, TheDefaultHasATrailAndAPathAndOnePty) {
  const Result<Config> parsed = ParseConfig(DefaultConfigText(), "default");
  ASSERT_TRUE(parsed.ok()) << parsed.error();
  const Config& config = parsed.value();
  const field::FieldConfig& field = config.engine.field;
  ASSERT_EQ(field.pheromones.size(), 2u);
  EXPECT_EQ(field.pheromones[0].name, "trail");
  EXPECT_EQ(field.pheromones[0].tau_ms, 30'000);
  EXPECT_EQ(field.pheromones[1].name, "path");
  EXPECT_EQ(field.pheromones[1].tau_ms, 0);
  ASSERT_EQ(field.paths.size(), 1u);
  EXPECT_EQ(field.paths[0].type, 2);
  EXPECT_EQ(field.paths[0].count, 8);
  EXPECT_TRUE(field.paths[0].closed);
  ASSERT_EQ(config.links.size(), 1u);
  EXPECT_EQ(config.links[0].name, "radio-a");
  EXPECT_EQ(config.links[0].path, "radio-a.pty");
}

// Three points of the circuit half a metre apart lie on a circle: the smallest of these, and where.
TEST(ConfigTest, TheDefaultCircuitIsSmoothEnoughToDrive) {
  const Config config = Parse(DefaultConfigText());
  const std::vector<field::PointUm>& points = config.engine.field.paths.at(0).points;
  double smallest_m = 1e9;
  for (size_t i = 0; i < points.size(); ++i) {
    const auto at = [&](size_t j) { return points[(i + j) % points.size()]; };
    const auto side_m = [](field::PointUm a, field::PointUm b) {
      return std::hypot(static_cast<double>(b.x - a.x), static_cast<double>(b.y - a.y)) / 1e6;
    };
    const double a = side_m(at(0), at(5));
    const double b = side_m(at(5), at(10));
    const double c = side_m(at(0), at(10));
    const double s = (a + b + c) / 2;
    const double area = std::sqrt(std::max(0.0, s * (s - a) * (s - b) * (s - c)));
    smallest_m = std::min(smallest_m, a * b * c / (4 * area));
    EXPECT_GE(at(0).x, 900'000);
    EXPECT_LE(at(0).x, 9'100'000);
    EXPECT_GE(at(0).y, 900'000);
    EXPECT_LE(at(0).y, 9'100'000);
  }
  EXPECT_GT(smallest_m, 0.8);
}

TEST(ConfigTest, TheDefaultIsTheFileThatPeopleRead) {
  EXPECT_EQ(DefaultConfigText(),
            ReadFile(PHEROMONE_SOURCE_DIR "/server/config/default.toml").value());
}

TEST(ConfigTest, AFileIsReadLikeAText) {
  const Result<Config> loaded = LoadConfig(PHEROMONE_SOURCE_DIR "/server/config/default.toml");
  ASSERT_TRUE(loaded.ok()) << loaded.error();
  EXPECT_EQ(loaded.value().engine, Parse(DefaultConfigText()).engine);
}

TEST(ConfigTest, AFileThatCannotBeReadIsNamed) {
  EXPECT_EQ(LoadConfig("/nonexistent/x.toml").error(),
            "/nonexistent/x.toml: cannot be opened: No such file or directory");
  EXPECT_EQ(LoadConfig("/tmp").error(), "/tmp: cannot be read: Is a directory");
  EXPECT_EQ(LoadConfig("/dev/zero").error(), "/dev/zero: is not a regular file");
}

// Damaged text is refused or read; it never brings the reader down.
TEST(ConfigTest, MutatedTextNeverCrashesTheReader) {
  std::mt19937 random(7);  // NOLINT: the same damage every time
  const std::string original(DefaultConfigText());
  // Without its comments, so that most damage hits something.
  std::string bare;
  for (size_t i = 0; i < original.size();) {
    const size_t end = std::min(original.find('\n', i), original.size() - 1) + 1;
    std::string line = original.substr(i, end - i);
    line = line.substr(0, line.find('#'));
    bare += line.empty() || line.back() == '\n' ? line : line + '\n';
    i = end;
  }
  constexpr std::string_view kBytes = "[]{}=.,\"'#\n 0123456789-+eE_\\xn\xC3\xFF\0truefals";
  int refused = 0;
  for (int round = 0; round < 20'000; ++round) {
    std::string text = bare;
    const int changes = 1 + static_cast<int>(random() % 4);
    for (int i = 0; i < changes && !text.empty(); ++i) {
      const size_t at = random() % text.size();
      switch (random() % 5) {
        case 0:
          text.erase(at, 1 + random() % 4);
          break;
        case 1:
          text.insert(at, 1, kBytes[random() % kBytes.size()]);
          break;
        case 2:
          text[at] = kBytes[random() % kBytes.size()];
          break;
        case 3:
          text[at] = static_cast<char>(random());
          break;
        default:
          if (random() % 16 == 0) {
            text.resize(at);
          } else {
            text.insert(at, text.substr(random() % text.size(), random() % 24));
          }
          break;
      }
    }
    const Result<Config> parsed = ParseConfig(text, "m");
    if (!parsed.ok()) {
      ++refused;
      EXPECT_EQ(parsed.error().substr(0, 2), "m:") << parsed.error();
    }
  }
  EXPECT_GT(refused, 10'000);
}

TEST(ConfigTest, PrefixesOfTheDefaultAreHandled) {
  const std::string_view text = DefaultConfigText();
  for (size_t size = 0; size < text.size(); size += 5) {
    const Result<Config> parsed = ParseConfig(text.substr(0, size), "p");
    EXPECT_TRUE(parsed.ok() || parsed.error().substr(0, 2) == "p:");
  }
}

}  // namespace
}  // namespace pheromone::config
