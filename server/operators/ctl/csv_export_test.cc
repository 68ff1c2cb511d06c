#include "server/operators/ctl/csv_export.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "server/base/file.h"
#include "server/base/testing/temporary_folder.h"
#include "server/core/engine/testing/bench.h"
#include "server/store/capture/testing/live.h"

namespace pheromone::ctl {
namespace {

TEST(CsvExportTest, AHaltThatIsNotInTheLogHasTheTimeOfTheRecordsAroundIt) {
  const TemporaryFolder folder;
  const std::string captures = folder / "captures";
  capture::testing::Live live(captures, engine::testing::SmallConfig());
  ASSERT_TRUE(live.Record().ok());
  live.now_ms = 2500;
  live.Hear(0, capture::testing::FrameOf(engine::testing::Hello(1, 1)));
  const protocol::Message halt = engine::testing::MessageOf(
      protocol::Command{protocol::kBroadcastId, 0, protocol::CommandCode::kHalt, {}});
  live.recorder().Unlogged(0, halt);
  live.Deliver({{0, 0, halt}});
  live.Finish();
  const std::string file = std::filesystem::directory_iterator(captures)->path();

  ASSERT_EQ(ExportCsv({file}, {.folder = folder / "out"}), 0);
  // 2.5 s after 1'700'000'000 s, which is 2023-11-14T22:13:20Z.
  EXPECT_THAT(ReadFile(folder / "out/events.csv").value(),
              ::testing::EndsWith("2.500,2023-11-14T22:13:22.500Z,operator,radio-a,,command,,"
                                  "\"halt, of all; not logged\"\n"));
}

}  // namespace
}  // namespace pheromone::ctl
