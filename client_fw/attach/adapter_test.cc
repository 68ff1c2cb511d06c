#include "client_fw/attach/adapter.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace pheromone::attach {
namespace {

// A sysfs and a /dev with a port of that name; `latency` is what its driver tells.
class AdapterTest : public testing::Test {
 public:
  ~AdapterTest() override { std::filesystem::remove_all(root_); }

 protected:
  AdapterTest() : root_(std::filesystem::path(testing::TempDir()) / "adapter_test") {
    std::filesystem::remove_all(root_);
    std::filesystem::create_directories(root_ / "dev");
  }

  uint8_t LatencyOf(const std::string& name, const std::string& latency) {
    const auto device = root_ / "class/tty" / name / "device";
    std::filesystem::create_directories(device);
    if (!latency.empty()) {
      std::ofstream(device / "latency_timer") << latency;
    }
    std::ofstream(root_ / "dev" / name) << "";
    return AdapterLatencyMs((root_ / "dev" / name).string(), root_.string());
  }

  const std::filesystem::path root_;
};

TEST_F(AdapterTest, OneThatTellsIsBelieved) {
  EXPECT_EQ(LatencyOf("ttyUSB0", "1\n"), 1);
  EXPECT_EQ(LatencyOf("ttyUSB1", "16\n"), 16);
  EXPECT_EQ(LatencyOf("ttyUSB2", "0\n"), 1);
  EXPECT_EQ(LatencyOf("ttyUSB3", "300\n"), 255);
}

TEST_F(AdapterTest, OneThatDoesNotTellIsTakenForAUsualOne) {
  EXPECT_EQ(LatencyOf("ttyUSB0", ""), kUsualLatencyMs);
  EXPECT_EQ(LatencyOf("ttyACM0", ""), kUsualLatencyMs);
  EXPECT_EQ(LatencyOf("ttyUSB1", "quick"), kUsualLatencyMs);
}

TEST_F(AdapterTest, AUartHasNone) {
  EXPECT_EQ(LatencyOf("ttyS0", ""), 0);
  EXPECT_EQ(LatencyOf("ttyAMA0", ""), 0);
}

TEST_F(AdapterTest, ALinkIsFollowed) {
  LatencyOf("ttyUSB0", "1");
  std::filesystem::create_symlink(root_ / "dev/ttyUSB0", root_ / "dev/modem");
  EXPECT_EQ(AdapterLatencyMs((root_ / "dev/modem").string(), root_.string()), 1);
}

// It may come later.
TEST_F(AdapterTest, APortThatIsNotThereIsTakenForAUsualAdapter) {
  EXPECT_EQ(AdapterLatencyMs((root_ / "dev/ttyUSB9").string(), root_.string()), kUsualLatencyMs);
}

}  // namespace
}  // namespace pheromone::attach
