// The daemon's recordings: what the operator who starts or ends one can rely on.

#include "server/daemon/captures.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "server/base/file.h"
#include "server/base/testing/temporary_folder.h"
#include "server/core/engine/testing/bench.h"
#include "server/store/capture/reader.h"

namespace pheromone::daemon {
namespace {

// What a start or an end came to, once the disk has it.
Status AwaitDisk(const Captures& captures) {
  for (;;) {
    if (const std::optional<Status> settled = captures.Settled()) {
      return *settled;
    }
    std::this_thread::yield();
  }
}

class CapturesTest : public ::testing::Test {
 protected:
  CapturesTest() : service_(&log_, [] { return engine::ClockReading{0, 0}; }) {
    config_.engine = engine::testing::SmallConfig();
    config_.links.resize(2);
    config_.capture = {.folder = folder_ / "captures", .file_mb = 1, .most_files = 0};
    EXPECT_TRUE(service_.Configure(config_.engine, 7).ok());
  }

  // What the records of a file are, one after the other, up to its end or the first mistake.
  static std::vector<capture::Record> RecordsOf(const std::string& path) {
    const std::string bytes = ReadFile(path).value();
    bool given = false;
    capture::CaptureReader reader(
        [&]() -> std::string_view {
          return std::exchange(given, true) ? std::string_view() : std::string_view(bytes);
        },
        path);
    std::vector<capture::Record> records;
    for (;;) {
      const auto next = reader.Next();
      if (!next.ok() || !next.value()) {
        return records;
      }
      records.push_back(next.value()->record);
    }
  }

  const TemporaryFolder folder_;
  engine::VolatileLog log_;
  engine::Service service_;
  config::Config config_;
};

TEST_F(CapturesTest, OnceStartedAFileIsThereAndOnceEndedItIsWhole) {
  Captures captures(&service_, config_);
  EXPECT_FALSE(captures.View().recording);
  EXPECT_EQ(captures.View().folder,
            std::filesystem::path(config_.capture.folder).lexically_normal().string());
  ASSERT_TRUE(captures.Start().ok());
  ASSERT_TRUE(AwaitDisk(captures).ok());
  const control::CaptureView during = captures.View();
  EXPECT_TRUE(during.recording);
  EXPECT_EQ(during.files, 1u);
  EXPECT_TRUE(std::filesystem::exists(during.file));
  EXPECT_FALSE(captures.Start().ok());

  std::vector<engine::Outgoing> out;
  service_.Handle(0, std::vector{engine::testing::Hello(3, 9)}, &out);
  ASSERT_TRUE(captures.Stop().ok());
  ASSERT_TRUE(AwaitDisk(captures).ok());
  EXPECT_FALSE(captures.View().recording);
  const std::vector<capture::Record> records = RecordsOf(during.file);
  ASSERT_FALSE(records.empty());
  EXPECT_TRUE(std::holds_alternative<capture::Start>(records.front()));
  const auto* const end = std::get_if<capture::End>(&records.back());
  ASSERT_NE(end, nullptr);
  EXPECT_EQ(end->state_hash, service_.StateHash());
  EXPECT_FALSE(captures.Stop().ok());
}

// A limit to the size of files does to a process what a full disk does.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  ~FullDisk() { setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

TEST_F(CapturesTest, AFullDiskIsToldToWhoStartsAndToWhoLooksLaterAndIsForgottenWhenItHasRoom) {
  Captures captures(&service_, config_);
  for (const rlim_t room : {rlim_t{0}, rlim_t{300}}) {  // not for the header; for no more than that
    const FullDisk full(room);
    ASSERT_TRUE(captures.Start().ok());
    const Status told = AwaitDisk(captures);
    ASSERT_FALSE(told.ok());
    EXPECT_NE(told.error().find("cannot be written: File too large"), std::string::npos)
        << told.error();
    EXPECT_FALSE(captures.View().recording);
    EXPECT_EQ(captures.View().error, told.error());
    EXPECT_FALSE(captures.Stop().ok());
  }
  ASSERT_TRUE(captures.Start().ok());
  EXPECT_TRUE(AwaitDisk(captures).ok());
  EXPECT_EQ(captures.View().error, "");
}

}  // namespace
}  // namespace pheromone::daemon
