// The state at the beginning of a file is copied into it while the server goes on, whatever its
// size, and nothing of what passes meanwhile is lost.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <random>

#include "server/base/file.h"
#include "server/core/engine/testing/random_traffic.h"
#include "server/store/capture/recorder.h"
#include "server/store/capture/testing/live.h"

namespace pheromone::capture {
namespace {

using engine::testing::Deposit;
using engine::testing::Hello;
using engine::testing::SmallConfig;
using engine::testing::Trace;
using testing::FrameOf;
using ::testing::HasSubstr;
using testing::Live;
using testing::RecordingTest;
using testing::RecordsOf;
using testing::ReplayError;

constexpr size_t kKiB = 1024;

// 20 m x 20 m in nodes of 1 cm.
engine::EngineConfig WideConfig() {
  engine::EngineConfig config = SmallConfig();
  config.field.map.width_um = 20'000'000;
  config.field.map.height_um = 20'000'000;
  config.field.map.cell_um = 10'000;
  config.field.memory_bytes = 256 << 20;
  return config;
}

field::FieldEdit Fill(int64_t from_x_um, int64_t to_x_um) {
  field::FieldEdit edit;
  edit.type = 2;
  edit.level = 64;
  edit.points = {{from_x_um, 0}, {to_x_um, 20'000'000}};
  return edit;
}

class RecorderStateTest : public RecordingTest {
 protected:
  // Lays 2001 nodes a column, 8 bytes in the state and a little more each.
  static void FillColumns(Live* live, int64_t columns) {
    constexpr int64_t kAtOnce = 500;
    for (int64_t at = 0; at < columns; at += kAtOnce) {
      const int64_t last = std::min(at + kAtOnce, columns) - 1;
      ASSERT_TRUE(live->service().Edit(Fill(at * 10'000, last * 10'000)).ok());
    }
  }

  // A robot's messages, all over the map.
  static void Walk(Live* live, int messages) {
    for (int i = 0; i < messages; ++i) {
      const auto seq = static_cast<uint8_t>(i % 255 + 1);
      const auto x = static_cast<int16_t>(i * 7919 % 20'000);
      live->now_ms += 1;
      live->Hear(0, FrameOf(i % 2 == 0 ? Trace(1, seq, x, 5'000) : Deposit(1, seq, 5'000, x)));
    }
  }

  // Waits until the recorder has come to where `there` says. Its writer is a thread of its own.
  template <typename There>
  static void Await(const Live& live, There&& there) {
    while (!there(const_cast<Live&>(live).recorder().status())) {
      std::this_thread::yield();
    }
  }
};

TEST_F(RecorderStateTest, AStateLargerThanTheQueueIsRecordedWithAllThatFollows) {
  Live live(folder_, WideConfig());
  FillColumns(&live, 150);
  live.options.queue_bytes = 100 * kKiB;
  live.Hear(0, FrameOf(Hello(1, 1)));
  ASSERT_TRUE(live.Record().ok());
  // Fits into the queue beside a state of 2.5 MB if that is not in it, however slow the disk is.
  Walk(&live, 250);
  live.Finish();
  EXPECT_EQ(live.recorder().status().error, "");
  EXPECT_EQ(live.recorder().status().lost, 0u);
  const std::vector<std::string> files = live.Files();
  ASSERT_EQ(files.size(), 1u);
  EXPECT_GT(std::get<Start>(RecordsOf(files[0])[0].record).state_bytes, 20 * 100 * kKiB);
  ReplayReport report;
  EXPECT_EQ(ReplayError(files[0], &report), "");
  EXPECT_EQ(report.messages, 250u);
}

// The edit comes after the start and before the state has been copied: it is not in it.
TEST_F(RecorderStateTest, TheStateIsThatOfTheStart) {
  Live live(folder_, WideConfig());
  FillColumns(&live, 100);
  const uint64_t hash = live.service().StateHash();
  ASSERT_TRUE(live.Record().ok());
  field::FieldEdit erase;
  erase.type = 2;
  erase.shape = field::FieldEdit::Shape::kAll;
  erase.action = field::FieldEdit::Action::kErase;
  ASSERT_TRUE(live.service().Edit(erase).ok());
  FillColumns(&live, 10);
  live.Finish();
  const std::string file = live.Files().at(0);
  EXPECT_EQ(ReplayError(file), "");
  std::string state;
  for (const Found& found : RecordsOf(file)) {
    if (const auto* portion = std::get_if<State>(&found.record)) {
      EXPECT_LE(portion->bytes.size(), kStatePortion);
      state += portion->bytes;
    }
  }
  ByteReader reader(state);
  EXPECT_EQ(engine::Engine::Restore(&reader).value().StateHash(), hash);
}

TEST_F(RecorderStateTest, SmallStatesMayBeStreamedToo) {
  engine::testing::RandomTraffic traffic(12);
  const engine::Event first = traffic.First();
  Live live(folder_, *std::get<engine::ConfigChanged>(first).config, traffic.stamp().field_time_ms);
  live.options.small_state_bytes = 0;
  live.options.file_bytes = 1;
  live.options.most_files = 0;
  ASSERT_TRUE(live.Record().ok());
  for (int i = 0; i < 2'000 || live.recorder().status().files < 4; ++i) {
    const engine::Event event =
        live.service().Inspect([&](const auto& engine) { return traffic.Next(engine); });
    live.now_ms = std::max(live.now_ms.load(), traffic.stamp().field_time_ms);
    if (const auto* request = std::get_if<engine::RequestReceived>(&event)) {
      live.Hear(request->link, FrameOf(request->message));
    } else if (const auto* edited = std::get_if<engine::FieldEdited>(&event)) {
      static_cast<void>(live.service().Edit(edited->edit));
    } else if (const auto* reversed = std::get_if<engine::EditReversed>(&event)) {
      static_cast<void>(live.service().Reverse(reversed->redo));
    }
    live.Advance();
  }
  live.Finish();
  EXPECT_EQ(live.recorder().status().error, "");
  for (const std::string& file : live.Files()) {
    EXPECT_EQ(ReplayError(file), "");
  }
}

// --- The state is frozen for one at a time.

TEST_F(RecorderStateTest, ARecordingBeginsWhenTheStateIsFree) {
  Live live(folder_, SmallConfig());
  engine::Service::Frozen other = live.service().Freeze();
  ASSERT_TRUE(live.Record().ok());
  EXPECT_TRUE(live.recorder().status().recording);
  EXPECT_FALSE(live.Record().ok());
  live.Hear(0, FrameOf(Hello(1, 1)));  // not in the recording
  EXPECT_EQ(live.recorder().status().files, 0u);
  other.reset();
  Await(live, [](const RecordingStatus& status) { return status.files == 1; });
  live.Hear(0, FrameOf(Trace(1, 1)));
  live.Finish();
  ReplayReport report;
  EXPECT_EQ(ReplayError(live.Files().at(0), &report), "");
  EXPECT_EQ(report.messages, 1u);
}

TEST_F(RecorderStateTest, ARecordingThatHasNotBegunLeavesNothingWhenItIsStopped) {
  Live live(folder_, SmallConfig());
  const engine::Service::Frozen other = live.service().Freeze();
  ASSERT_TRUE(live.Record().ok());
  ASSERT_TRUE(live.recorder().Stop().ok());
  EXPECT_FALSE(live.recorder().status().recording);
  EXPECT_TRUE(live.recorder().status().written);
  live.Finish();
  EXPECT_TRUE(live.Files().empty());
  EXPECT_TRUE(live.complaints.empty());
}

TEST_F(RecorderStateTest, AFileThatIsFullGoesOnUntilTheStateIsFree) {
  Live live(folder_, SmallConfig());
  live.options.file_bytes = 1;
  live.options.most_files = 0;
  live.Hear(0, FrameOf(Hello(1, 1)));
  ASSERT_TRUE(live.Record().ok());
  engine::Service::Frozen other = live.service().Freeze();
  Walk(&live, 200);
  Await(live, [](const RecordingStatus& status) { return status.written; });
  EXPECT_EQ(live.recorder().status().files, 1u);
  other.reset();
  while (live.recorder().status().files < 2) {
    Walk(&live, 10);
    Await(live, [](const RecordingStatus& status) { return status.written; });
  }
  live.Finish();
  EXPECT_EQ(live.recorder().status().lost, 0u);
  for (const std::string& file : live.Files()) {
    EXPECT_EQ(ReplayError(file), "");
  }
}

// --- What can go wrong.

// The map is changed between the start and the copy, for which there is no room.
TEST_F(RecorderStateTest, ARecordingWhoseStateCannotBeCopiedBeginsAnew) {
  std::filesystem::create_directories(folder_);
  engine::VolatileLog log;
  uint64_t now_ms = 1'000;
  engine::Service service(&log, [&now_ms] { return engine::ClockReading{now_ms, 0}; });
  ASSERT_TRUE(service.Configure(WideConfig(), 7).ok());
  const uint64_t first = service.Edit(Fill(0, 100'000)).value().sequence;
  Recorder recorder({&service, [] { return Live::kUtcMs * 1'000'000; },
                     [] {
                       capture::Start start;
                       start.links = {{"radio-a", 0, false}, {"radio-b", 0, false}};
                       return start;
                     },
                     [](const std::string& text) { ADD_FAILURE() << text; }});
  RecordingOptions options;
  options.folder = folder_;
  options.small_state_bytes = 0;
  options.most_kept_bytes = 0;
  ASSERT_TRUE(recorder.Start(options).ok());
  // Its records, one for each portion, are lost with the file.
  const uint64_t second = service.Edit(Fill(0, 50'000)).value().sequence;
  std::thread writer([&recorder] { recorder.Run(); });
  while (recorder.status().files < 2) {
    std::this_thread::yield();
  }
  EXPECT_TRUE(recorder.status().recording);
  EXPECT_EQ(recorder.status().begun_anew, 1u);
  EXPECT_EQ(recorder.status().lost, second - first);
  while (!recorder.status().written) {
    std::this_thread::yield();
  }
  const uint64_t third = service.Edit(Fill(50'000, 70'000)).value().sequence;
  ASSERT_TRUE(recorder.Stop().ok());
  recorder.Close();
  writer.join();
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    files.push_back(ReadFile(entry.path().string()).value());
  }
  ASSERT_EQ(files.size(), 1u);
  ReplayReport report;
  EXPECT_EQ(ReplayError(files[0], &report), "");
  EXPECT_EQ(report.events, third - second);
  EXPECT_EQ(report.state_hash, service.StateHash());
}

TEST_F(RecorderStateTest, ADiskThatFillsUpInTheMiddleOfTheStateEndsTheRecording) {
  Live live(folder_, WideConfig());
  FillColumns(&live, 100);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto signal_before = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit half{1'000'000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &half), 0);
  ASSERT_TRUE(live.Record().ok());
  Await(live, [](const RecordingStatus& status) { return !status.recording; });
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, signal_before);
  EXPECT_THAT(live.recorder().status().error, HasSubstr("cannot be written"));
  EXPECT_NE(live.service().Freeze(), nullptr) << "the state is free again";
  EXPECT_TRUE(live.Record().ok());
  live.Finish();
  EXPECT_EQ(live.recorder().status().error, "");
  EXPECT_EQ(live.complaints.size(), 1u);
}

TEST_F(RecorderStateTest, AnAnswerFromBeforeMayGoOutInTheSecondFile) {
  Live live(folder_, SmallConfig());
  live.options.file_bytes = 1;
  live.options.most_files = 0;
  live.slow = true;
  live.Hear(0, FrameOf(Hello(1, 1)));
  ASSERT_TRUE(live.Record().ok());
  while (live.recorder().status().files < 2) {
    live.Hear(1, "\x10");  // noise
    Await(live, [](const RecordingStatus& status) { return status.written; });
  }
  live.Flush();
  live.Finish();
  for (const std::string& file : live.Files()) {
    EXPECT_EQ(ReplayError(file), "");
  }
}

}  // namespace
}  // namespace pheromone::capture
