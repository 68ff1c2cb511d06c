// A recording of a map with four million nodes has no gap, and is replayed completely.

#include <gtest/gtest.h>

#include "server/base/testing/temporary_folder.h"
#include "server/store/capture/recorder.h"
#include "server/store/capture/testing/live.h"

namespace pheromone::capture {
namespace {

using engine::testing::Hello;
using engine::testing::Trace;
using testing::FrameOf;
using testing::Live;
using testing::ReplayError;

TEST(BigMap, IsRecordedWithoutAGapAndReplayed) {
  const TemporaryFolder folder;
  engine::EngineConfig config = engine::testing::SmallConfig();
  config.field.map.width_um = 21'000'000;
  config.field.map.height_um = 20'000'000;
  config.field.map.cell_um = 10'000;
  config.field.memory_bytes = 256 << 20;
  Live live(folder.string(), config);
  for (int64_t x_um = 0; x_um < 20'000'000; x_um += 5'000'000) {
    field::FieldEdit edit;
    edit.type = 2;
    edit.level = 64;
    edit.points = {{x_um, 0}, {x_um + 4'990'000, 20'000'000}};
    ASSERT_TRUE(live.service().Edit(edit).ok());
  }
  ASSERT_GE(live.service().Inspect([](const auto& it) { return it.field().node_count(); }),
            4'000'000u);
  live.Hear(0, FrameOf(Hello(1, 1)));
  ASSERT_TRUE(live.Record().ok());
  uint64_t heard = 0;
  const auto hear = [&] {
    ++heard;
    live.now_ms += 1;
    live.Hear(0, FrameOf(Trace(1, static_cast<uint8_t>(heard % 255 + 1),
                               static_cast<int32_t>(heard * 7919 % 20'000))));
  };
  // All the while the state is written, and after it; no more than the queue takes if the disk
  // stands still.
  while (heard < 20'000 && (heard < 5'000 || live.recorder().status().bytes < 33'000'000)) {
    hear();
  }
  live.Finish();
  EXPECT_EQ(live.recorder().status().error, "");
  EXPECT_EQ(live.recorder().status().lost, 0u);
  ASSERT_EQ(live.Files().size(), 1u);
  ReplayReport report;
  EXPECT_EQ(ReplayError(live.Files()[0], &report), "");
  EXPECT_EQ(report.messages, heard);
  EXPECT_EQ(report.state_hash, live.service().StateHash());
  RecordProperty("longest_copy_us", static_cast<int>(live.recorder().status().longest_copy_us));
}

}  // namespace
}  // namespace pheromone::capture
