#include "server/robots/links/port_holder.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "server/robots/links/port.h"
#include "server/robots/links/testing/link_bench.h"

namespace pheromone::links {
namespace {

// A /proc made by hand: processes with a name and what they have open.
class PortHolderTest : public ::testing::Test {
 protected:
  void AddProcess(const std::string& id, const std::string& name,
                  const std::vector<std::string>& open) {
    const std::filesystem::path process = folder_ / id;
    std::filesystem::create_directories(process / "fd");
    std::ofstream(process / "comm") << name << '\n';
    for (size_t i = 0; i < open.size(); ++i) {
      std::filesystem::create_symlink(open[i], process / "fd" / std::to_string(i));
    }
  }
  std::string Describe() { return DescribeHolders("/dev/ttyUSB0", folder_ / "."); }

  TemporaryFolder folder_;
};

TEST_F(PortHolderTest, WhoHasTheDeviceOpenIsNamed) {
  AddProcess("12", "bash", {"/dev/pts/0", "/dev/ttyUSB1"});
  AddProcess("4711", "picocom", {"/dev/pts/0", "/dev/ttyUSB0"});
  EXPECT_EQ(Describe(), "held by picocom (process 4711)");
}

TEST_F(PortHolderTest, ModemManagerComesWithAdvice) {
  AddProcess("612", "ModemManager", {"/dev/ttyUSB0"});
  EXPECT_EQ(Describe(),
            "held by ModemManager (process 612); to exclude ModemManager, see pheromoned.toml(5), "
            "\"[[link]]\"");
}

TEST_F(PortHolderTest, OneThatCannotBeLookedIntoIsSuspectedIfItIsModemManager) {
  AddProcess("612", "ModemManager", {});
  EXPECT_EQ(Describe(),
            "held by a program that cannot be determined, possibly ModemManager, which is running; "
            "to exclude ModemManager, see pheromoned.toml(5), \"[[link]]\"");
}

TEST_F(PortHolderTest, WhereNothingIsKnownThatIsSaid) {
  EXPECT_EQ(Describe(), "held by a program that cannot be determined");
  EXPECT_EQ(DescribeHolders("/dev/ttyUSB0", folder_ / "none"),
            "held by a program that cannot be determined");
}

TEST_F(PortHolderTest, ARealProcessIsFoundAndThisOneIsNot) {
  const std::string file = folder_ / "device";
  const Descriptor own(open(file.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0600));
  EXPECT_EQ(DescribeHolders(file).find("held by a program that cannot"), 0u);
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t child = fork();
  if (child == 0) {
    const int handle = open(file.c_str(), O_RDWR);
    static_cast<void>(!write(ready[1], "", handle >= 0 ? 1 : 0));
    pause();
  }
  close(ready[1]);
  char byte = 0;
  EXPECT_EQ(read(ready[0], &byte, 1), 1);
  close(ready[0]);
  const std::string text = DescribeHolders(file);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_NE(text.find("(process " + std::to_string(child) + ", since "), std::string::npos) << text;
}

}  // namespace
}  // namespace pheromone::links
