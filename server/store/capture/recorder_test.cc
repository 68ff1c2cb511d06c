// What passes a server is recorded such that a replay finds everything the same; and what is not
// the same, it finds.

#include "server/store/capture/recorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "server/core/engine/testing/random_traffic.h"
#include "server/store/capture/testing/live.h"

namespace pheromone::capture {
namespace {

using engine::testing::Deposit;
using engine::testing::Hello;
using engine::testing::Sense;
using engine::testing::SmallConfig;
using engine::testing::Trace;
using testing::FileOf;
using testing::FrameOf;
using ::testing::HasSubstr;
using testing::Live;
using testing::RecordingTest;
using testing::RecordsOf;
using testing::ReplayError;
using ::testing::StartsWith;

class RecorderTest : public RecordingTest {};

// --- Everything that can happen, for ten minutes of the field's time.

// Frames cut anywhere, some of them damaged, some with a pause in which the rest times out.
class Radio {
 public:
  explicit Radio(uint64_t seed) : random_(seed) {}

  void Send(Live* live, size_t at, std::string frame) {
    if (Below(20) == 0) {
      frame[Below(frame.size())] ^= static_cast<char>(1 << Below(8));
    }
    if (Below(10) == 0) {
      frame.insert(0, std::string("\x10\x33\x02", 1 + Below(3)));
    }
    while (!frame.empty()) {
      const size_t size = Below(3) == 0 ? 1 + Below(frame.size()) : frame.size();
      live->Hear(at, frame.substr(0, size));
      frame.erase(0, size);
      live->now_ms += Below(30) == 0 ? 21 : Below(2);
    }
  }
  uint64_t Below(uint64_t limit) { return random_() % limit; }

 private:
  std::mt19937_64 random_;
};

void Happen(Live* live, Radio* radio, const engine::Event& event) {
  std::vector<engine::Outgoing> out;
  if (const auto* request = std::get_if<engine::RequestReceived>(&event)) {
    radio->Send(live, request->link, FrameOf(request->message));
  } else if (const auto* command = std::get_if<engine::CommandIssued>(&event)) {
    static_cast<void>(live->service().Issue(*command, &out));
  } else if (const auto* edited = std::get_if<engine::FieldEdited>(&event)) {
    static_cast<void>(live->service().Edit(edited->edit));
  } else if (const auto* reversed = std::get_if<engine::EditReversed>(&event)) {
    static_cast<void>(live->service().Reverse(reversed->redo));
  } else if (std::holds_alternative<engine::KeysRevoked>(event)) {
    static_cast<void>(live->service().Submit(event, &out));
  } else if (const auto* seen = std::get_if<engine::PoseObserved>(&event)) {
    live->service().Observe({seen, 1});
  } else if (const auto* change = std::get_if<engine::ConfigChanged>(&event)) {
    static_cast<void>(live->service().Configure(change->config, change->new_epoch));
  }
  live->Deliver(out);
  live->Advance();
}

TEST_F(RecorderTest, TenMinutesOfEverythingAreReplayedToTheByte) {
  engine::testing::RandomTraffic traffic(42);
  const engine::Event first = traffic.First();
  Live live(folder_, *std::get<engine::ConfigChanged>(first).config, traffic.stamp().field_time_ms);
  live.options.file_bytes = 1;  // as often as can be: with each twice the state's size
  live.options.most_files = 0;
  Radio radio(43);
  ASSERT_TRUE(live.Record().ok());
  const uint64_t end_ms = live.now_ms + 600'000;
  while (live.now_ms < end_ms || live.recorder().status().files < 4) {  // when, is the writer's
    const engine::Event event =
        live.service().Inspect([&](const auto& engine) { return traffic.Next(engine); });
    live.now_ms = std::max(live.now_ms.load(), traffic.stamp().field_time_ms);
    live.slow = radio.Below(4) == 0;
    if (radio.Below(10) == 0) {
      live.log().GetStuck();
      live.log().admit =
          radio.Below(4) == 0 ? protocol::Reason::kReadOnly : protocol::Reason::kNone;
    } else if (radio.Below(4) == 0) {
      live.log().Heal();
      live.log().admit = protocol::Reason::kNone;
      live.Release();
    }
    Happen(&live, &radio, event);
    if (radio.Below(50) == 0 && !live.conversations[0].queue.empty()) {
      live.recorder().Dropped(0, live.conversations[0].queue.back());
      live.conversations[0].queue.pop_back();
    }
    if (radio.Below(3) == 0) {
      radio.Send(&live, radio.Below(2), FrameOf(traffic.AnySense()));
    }
  }
  live.slow = true;  // the end finds an answer under way
  live.Hear(0, FrameOf(Hello(1, 1)));
  live.Finish();
  EXPECT_EQ(live.recorder().status().error, "");
  ReplayReport sum;
  const std::vector<std::string> files = live.Files();
  for (const std::string& file : files) {
    ReplayReport report;
    ASSERT_EQ(ReplayError(file, &report), "");
    sum.answers += report.answers;
    sum.events += report.events;
    sum.dropped += report.dropped;
    sum.under_way += report.under_way;
  }
  const uint64_t hash = live.service().StateHash();
  EXPECT_EQ(std::get<End>(RecordsOf(files.back()).back().record).state_hash, hash);
  EXPECT_GT(files.size(), 3u);
  EXPECT_GT(sum.answers, 1'500u);
  EXPECT_GT(sum.events, 500u);
  EXPECT_GT(sum.dropped, 3u);
  EXPECT_GT(sum.under_way, 0u);
}

// --- Answers that wait for the log.

TEST_F(RecorderTest, AnswersThatAStuckLogHoldsBackAreReplayedWhateverBecomesOfThem) {
  Live live(folder_, SmallConfig());
  live.Hear(0, FrameOf(Hello(2, 1)));
  live.log().GetStuck();
  live.Hear(0, FrameOf(Trace(2, 1)));  // waits, and nobody records yet
  ASSERT_TRUE(live.Record().ok());
  live.Hear(0, FrameOf(Trace(2, 1)));  // joins it
  live.Hear(0, FrameOf(Hello(1, 1)));
  live.Hear(0, FrameOf(Hello(1, 1)));                         // joins, 1 is not sent
  live.Hear(0, FrameOf(Trace(1, 1)) + FrameOf(Trace(1, 1)));  // in its place, 2 more are not sent
  live.log().admit = protocol::Reason::kReadOnly;
  live.Hear(0, FrameOf(Trace(1, 1)));  // busy, and the one that waited is not sent
  live.Hear(0, FrameOf(Trace(1, 2)));  // read-only
  live.log().admit = protocol::Reason::kNone;
  live.Hear(0, FrameOf(Trace(1, 1)));  // waits again
  live.log().Heal();
  live.Release();
  live.Hear(0, FrameOf(Sense(1)));
  live.Finish();
  ReplayReport report;
  EXPECT_EQ(ReplayError(live.Files().at(0), &report), "");
  EXPECT_EQ(report.dropped, 4u);
  EXPECT_EQ(report.under_way, 0u);
  EXPECT_EQ(report.from_before, 0u);
  EXPECT_EQ(report.answers, 5u);  // robot 2, busy, read-only, TRACE 1, SENSE
}

// --- A small recording, and what replay says to changes in it.

class SmallRecording : public RecorderTest {
 protected:
  // HELLO, two TRACEs of two robots, a command with a retry, SENSE.
  std::vector<Found> Make() {
    Live live(folder_, SmallConfig());
    EXPECT_TRUE(live.Record().ok());
    live.Hear(0, FrameOf(Hello(1, 1)) + FrameOf(Hello(2, 1)));
    live.Hear(0, FrameOf(Trace(1, 1)) + FrameOf(Trace(2, 1)));
    live.now_ms += 40;
    live.Hear(0, FrameOf(Trace(1, 2, 5100)));
    std::vector<engine::Outgoing> out;
    EXPECT_TRUE(live.service().Issue({0, 1, protocol::CommandCode::kHalt, {}}, &out).ok());
    live.Deliver(out);
    live.now_ms += engine::RobotsPart::kFirstRetryMs;
    live.Advance();
    live.Hear(0, FrameOf(Sense(2)));
    live.Finish();
    std::vector<Found> records = RecordsOf(live.Files().at(0));
    EXPECT_EQ(ReplayError(FileOf(records)), "");
    return records;
  }

  template <typename T>
  static std::vector<size_t> PlacesOf(const std::vector<Found>& records) {
    std::vector<size_t> places;
    for (size_t i = 0; i < records.size(); ++i) {
      if (std::holds_alternative<T>(records[i].record)) {
        places.push_back(i);
      }
    }
    return places;
  }

  static std::vector<size_t> PacketsOf(const std::vector<Found>& records, Direction direction) {
    std::vector<size_t> places = PlacesOf<Packet>(records);
    std::erase_if(places, [&](size_t at) {
      return std::get<Packet>(records[at].record).direction != direction;
    });
    return places;
  }
};

TEST_F(SmallRecording, TwoMessagesThatChangedPlacesAreFound) {
  std::vector<Found> records = Make();
  auto& batch = std::get<Batch>(records[PlacesOf<Batch>(records)[1]].record);
  ASSERT_EQ(batch.messages.size(), 2u);
  std::swap(batch.messages[0], batch.messages[1]);
  EXPECT_THAT(ReplayError(FileOf(records)), HasSubstr("expected the message"));
  std::swap(batch.messages[0].message, batch.messages[1].message);
  EXPECT_THAT(ReplayError(FileOf(records)), HasSubstr("expected change"));
}

TEST_F(SmallRecording, TwoRecordsThatChangedPlacesAreFoundWhereverTheyAre) {
  const std::vector<Found> records = Make();
  for (size_t i = 0; i + 1 < records.size(); ++i) {
    std::vector<Found> swapped = records;
    std::swap(swapped[i], swapped[i + 1]);
    std::string bytes = EncodeFileHeader({{"radio-a", 0, false}, {"radio-b", 0, false}}, "test");
    for (const Found& found : swapped) {
      bytes += EncodeRecord(found.record, found.number);  // each keeps its number
    }
    EXPECT_THAT(ReplayError(bytes), ::testing::AnyOf(HasSubstr("not replayable from here"),
                                                     HasSubstr("the start record is missing")));
  }
}

TEST(CaptureReader, ReadsNoMoreThanAFileHeaderMayHaveBeforeTheStart) {
  const std::string section = EncodeFileHeader({}, "test");
  const std::string link = EncodeFileHeader({{"radio-a", 0, false}}, "test").substr(section.size());
  size_t read = 0;
  CaptureReader reader(
      [&]() -> std::string_view {
        const std::string& next = read == 0 ? section : link;
        read += next.size();
        return next;  // without end
      },
      "lab.pcapng");
  EXPECT_THAT(reader.Next().ErrorOr(""), HasSubstr("more than 1 MiB before the start record"));
  EXPECT_LE(read, kMaxFileHeader + 2 * link.size());
}

TEST_F(SmallRecording, TwoBatchesThatChangedPlacesAreFoundAlsoIfNumberedAnew) {
  std::vector<Found> records = Make();
  const std::vector<size_t> at = PlacesOf<Batch>(records);
  std::swap(records[at[1]], records[at[2]]);
  EXPECT_THAT(ReplayError(FileOf(records)), HasSubstr("expected"));
}

TEST_F(SmallRecording, ARecordThatIsMissingIsNamed) {
  const std::vector<Found> records = Make();
  for (size_t i = 1; i + 1 < records.size(); ++i) {
    std::string bytes = EncodeFileHeader({{"radio-a", 0, false}, {"radio-b", 0, false}}, "test");
    for (const Found& found : records) {
      bytes += found.number == records[i].number ? "" : EncodeRecord(found.record, found.number);
    }
    EXPECT_THAT(ReplayError(bytes), HasSubstr("not replayable from here: record " +
                                              std::to_string(i + 1) + " is missing"));
  }
}

TEST_F(SmallRecording, AnAnswerWithAnotherByteIsTheFirstDifference) {
  std::vector<Found> records = Make();
  const size_t at = PacketsOf(records, Direction::kToRobots)[1];
  auto& packet = std::get<Packet>(records[at].record);
  const std::string good = packet.bytes;
  const protocol::Message wrong =
      engine::testing::MessageOf(protocol::TraceAnswer{1, 1, false, 1, 1, 2});
  packet.bytes = FrameOf(wrong);
  const std::string error = ReplayError(FileOf(records));
  EXPECT_THAT(error, StartsWith("record " + std::to_string(at + 1) + ", after packet " +
                                std::to_string(records[at].packet - 1) + ", 0.000000000 s"));
  EXPECT_THAT(error, HasSubstr("link radio-a, connection 1: expected 10 02 01 B1 01"));
  EXPECT_THAT(error, HasSubstr("found 10 02 01 B1 01 01 00 02 00"));
  packet.bytes = good + "\x10";
  EXPECT_THAT(ReplayError(FileOf(records)), HasSubstr("expected whole frames"));
}

TEST_F(SmallRecording, AnAnswerThatWasNeverWrittenIsMissedAtTheEnd) {
  std::vector<Found> records = Make();
  for (const size_t at : PacketsOf(records, Direction::kToRobots)) {
    std::vector<Found> fewer = records;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(at));
    EXPECT_THAT(ReplayError(FileOf(fewer)), HasSubstr("expected no more, found 10 02"));
  }
}

TEST_F(SmallRecording, AnotherTimeOfABatchOrAnEventIsFound) {
  std::vector<Found> records = Make();
  const size_t first = PlacesOf<Batch>(records).front();
  std::get<Batch>(records[first].record).stamp.field_time_ms = 1'000'000;
  EXPECT_THAT(ReplayError(FileOf(records)), HasSubstr("field time decreases"));
  records = Make();
  auto& events = std::get<EventApplied>(records[PlacesOf<EventApplied>(records).back()].record);
  ASSERT_TRUE(std::holds_alternative<engine::Advance>(events.event));
  events.stamp.field_time_ms -= 1;  // too early for the retry
  EXPECT_NE(ReplayError(FileOf(records)), "");
}

TEST_F(SmallRecording, AnotherHashAtTheEndIsFound) {
  std::vector<Found> records = Make();
  std::get<End>(records.back().record).state_hash ^= 1;
  EXPECT_THAT(ReplayError(FileOf(records)), HasSubstr("expected the state hash"));
  records.pop_back();
  EXPECT_THAT(ReplayError(FileOf(records)), HasSubstr("no end"));
}

TEST_F(SmallRecording, CutAtAnyByteItGivesWhatIsWholeAndSaysSo) {
  const std::string bytes = FileOf(Make());
  const size_t all = RecordsOf(bytes).size();
  for (size_t size = 0; size < bytes.size(); ++size) {
    std::string error;
    EXPECT_LT(RecordsOf(bytes.substr(0, size), &error).size(), all);
    EXPECT_NE(ReplayError(bytes.substr(0, size)), "");
    EXPECT_EQ(error.find("\n"), std::string::npos);
  }
}

TEST_F(SmallRecording, NoDamagedByteGoesUnseenWhereItMatters) {
  const std::string bytes = FileOf(Make());
  ReplayReport good;
  ASSERT_EQ(ReplayError(bytes, &good), "");
  std::mt19937 random(7);
  for (size_t at = 0; at < bytes.size(); ++at) {
    std::string damaged = bytes;
    damaged[at] ^= static_cast<char>(1 << random() % 8);
    ReplayReport report;
    if (ReplayError(damaged, &report).empty()) {  // padding, or the name of an interface
      EXPECT_EQ(report.answer_bytes, good.answer_bytes);
      EXPECT_EQ(report.state_hash, good.state_hash);
    }
  }
}

// --- Beginning and ending while the server runs.

TEST_F(RecorderTest, ARecordingMayBeginInTheMiddleOfAFrameAndOfAnAnswer) {
  Live live(folder_, SmallConfig());
  live.Hear(0, FrameOf(Hello(1, 1)));
  live.slow = true;
  live.Hear(0, FrameOf(Trace(1, 1)));
  // The cut lies between the two bytes of a doubled DLE, before a false beginning of a frame.
  const std::string frame = FrameOf(Deposit(1, 2, 0x1110, 0x0202));
  const size_t cut = frame.find("\x10\x10\x11") + 1;
  live.Hear(0, frame.substr(0, cut));
  ASSERT_TRUE(live.Record().ok());
  live.Hear(0, frame.substr(cut));
  live.Flush();
  live.Finish();
  ReplayReport report;
  const std::string file = live.Files().at(0);
  EXPECT_EQ(ReplayError(file, &report), "");
  EXPECT_EQ(report.messages, 1u);
  EXPECT_EQ(report.answers, 2u);
  EXPECT_EQ(report.from_before, 1u);
}

TEST_F(RecorderTest, APauseInAnOpenFrameTimesOutInTheReplayToo) {
  for (const uint64_t pause_ms : {20u, 21u}) {
    std::filesystem::remove_all(folder_);
    Live live(folder_, SmallConfig());
    const std::string frame = FrameOf(Hello(1, 1));
    live.Hear(0, frame.substr(0, 5));
    ASSERT_TRUE(live.Record().ok());
    live.now_ms += pause_ms;
    live.Hear(0, frame.substr(5));
    live.Finish();
    ReplayReport report;
    EXPECT_EQ(ReplayError(live.Files().at(0), &report), "");
    EXPECT_EQ(report.messages, pause_ms == 20 ? 1u : 0u);
  }
}

TEST_F(RecorderTest, TwoRecordingsAreTwoFilesAndEachStandsByItself) {
  Live live(folder_, SmallConfig());
  EXPECT_FALSE(live.recorder().Stop().ok());
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(live.Record().ok());
    EXPECT_FALSE(live.Record().ok());
    EXPECT_TRUE(live.recorder().status().recording);
    live.Hear(0, FrameOf(Hello(1, 1)) + FrameOf(Trace(1, 1)));
    ASSERT_TRUE(live.recorder().Stop().ok());
    live.Hear(0, FrameOf(Trace(1, 2)));
    live.now_ms += 2'000;
  }
  live.Finish();
  ASSERT_EQ(live.Files().size(), 2u);
  for (const std::string& file : live.Files()) {
    ReplayReport report;
    EXPECT_EQ(ReplayError(file, &report), "");
    EXPECT_EQ(report.messages, 2u);
  }
}

TEST_F(RecorderTest, DatagramsThatAreReadTogetherMayBeOneBatch) {
  Live live(folder_, SmallConfig());
  live.datagrams = true;
  ASSERT_TRUE(live.Record().ok());
  std::vector<engine::Outgoing> out;
  const std::vector<protocol::Message> batch = {Hello(1, 1), Hello(2, 1)};
  live.recorder().BeginRead();
  for (const protocol::Message& message : batch) {
    Connection peer{0, message.id, 0};
    const std::string bytes = FrameOf(message) + "\x10\x02\x01";  // cut off, and never continued
    live.recorder().Read(&peer, {reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()}, 0,
                         protocol::FrameDecoder(0));
  }
  live.service().Handle(0, batch, &out);
  live.Deliver(out);
  live.recorder().EndRead();
  live.Finish();
  ReplayReport report;
  EXPECT_EQ(ReplayError(live.Files().at(0), &report), "");
  EXPECT_EQ(report.messages, 2u);
}

TEST_F(RecorderTest, WhatTheLinkTurnsAwayIsNotMissed) {
  Live live(folder_, SmallConfig());
  ASSERT_TRUE(live.Record().ok());
  auto& on = live.conversations[0];
  const std::string bytes = FrameOf(Sense(9));
  const std::span span(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size());
  live.recorder().BeginRead();
  live.recorder().Read(&on.line, span, 0, on.decoder);
  live.recorder().Rejected(0, Sense(9), protocol::Reason::kBusy);
  const std::string busy = FrameOf(engine::ErrorMessage(Sense(9), protocol::Reason::kBusy));
  live.recorder().Wrote(on.line, {reinterpret_cast<const uint8_t*>(busy.data()), busy.size()});
  live.recorder().EndRead();
  live.Finish();
  EXPECT_EQ(ReplayError(live.Files().at(0)), "");
}

// --- Limits.

TEST_F(RecorderTest, AHaltThatTheLogDoesNotKnowIsReplayedAndNothingElseMayGoLikeIt) {
  Live live(folder_, SmallConfig());
  ASSERT_TRUE(live.Record().ok());
  live.Hear(0, FrameOf(Hello(1, 1)));
  const protocol::Message halt = engine::testing::MessageOf(
      protocol::Command{protocol::kBroadcastId, 0, protocol::CommandCode::kHalt, {}});
  for (int i = 0; i < 3; ++i) {
    live.recorder().Unlogged(0, halt);
    live.Deliver({{0, 0, halt}});
  }
  live.Hear(0, FrameOf(Sense(1)));
  live.Finish();
  std::vector<Found> records = RecordsOf(live.Files().at(0));
  EXPECT_EQ(ReplayError(FileOf(records)), "");
  std::vector<Found> without = records;
  std::erase_if(without,
                [](const Found& it) { return std::holds_alternative<Unlogged>(it.record); });
  EXPECT_THAT(ReplayError(FileOf(without)), HasSubstr("found 10 02 FF D1"));
  for (Found& found : records) {
    if (auto* unlogged = std::get_if<Unlogged>(&found.record)) {
      unlogged->sent.message.id = 1;
    }
  }
  EXPECT_THAT(ReplayError(FileOf(records)), HasSubstr("expected a halt to all robots"));
}

TEST_F(RecorderTest, WhatDoesNotFitIntoTheQueueIsAGapInTheFile) {
  Live live(folder_, SmallConfig());
  live.options.queue_bytes = 2'000;  // the start is let in, then a read; not what comes of it
  ASSERT_TRUE(live.Record().ok());
  const std::string read(1'990, '\0');
  for (int i = 0; i < 1000 && live.recorder().status().lost == 0; ++i) {
    live.Hear(0, read);
  }
  EXPECT_GT(live.recorder().status().lost, 0u);
  live.Finish();
  EXPECT_THAT(ReplayError(live.Files().at(0)), HasSubstr("not replayable from here"));
}

TEST_F(RecorderTest, OnlyTheLatestFilesAreKept) {
  Live live(folder_, SmallConfig());
  live.options.most_files = 2;
  std::filesystem::create_directories(folder_);
  std::ofstream(folder_ + "/pheromone-notes.pcapng") << "of someone else";
  for (int i = 0; i < 4; ++i) {
    ASSERT_TRUE(live.Record().ok());
    ASSERT_TRUE(live.recorder().Stop().ok());
    live.now_ms += 1'000;
  }
  live.Finish();
  EXPECT_EQ(live.recorder().status().error, "");
  const std::vector<std::string> files = live.Files();
  ASSERT_EQ(files.size(), 3u);
  EXPECT_EQ(files[2], "of someone else");
  const auto start = std::get<Start>(RecordsOf(files[0])[0].record);
  EXPECT_EQ(start.utc_ns, (Live::kUtcMs + 2'000) * 1'000'000);
}

TEST_F(RecorderTest, AFolderThatIsNotThereIsSaid) {
  Live live(folder_, SmallConfig());
  std::filesystem::remove_all(folder_);
  const Status status = live.Record();
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error(), HasSubstr("expected a folder for recordings"));
}

TEST_F(RecorderTest, AFileThatCannotBeMadeEndsTheRecordingAndNothingElse) {
  Live live(folder_, SmallConfig());
  live.options.file_bytes = 1;
  ASSERT_TRUE(live.Record().ok());
  // At once, as the writer may be about to make the next file in it.
  std::filesystem::rename(folder_, folder_ + "-gone");
  std::filesystem::remove_all(folder_ + "-gone");
  live.Hear(0, FrameOf(Hello(1, 1)));
  for (uint8_t seq = 1; live.recorder().status().error.empty(); ++seq) {
    live.Hear(0, FrameOf(Trace(1, seq)));
    std::this_thread::yield();
  }
  EXPECT_FALSE(live.recorder().status().recording);
  EXPECT_THAT(live.recorder().status().error, HasSubstr("cannot be created"));
  const uint64_t changes = live.service().counters().changes;
  live.Hear(0, FrameOf(Deposit(1, 200)));
  EXPECT_GE(live.service().counters().changes, changes);
  std::filesystem::create_directories(folder_);
  EXPECT_TRUE(live.Record().ok());  // and it may begin again
  live.Finish();
  EXPECT_EQ(live.complaints.size(), 1u);
}

// The service detaches an observer that throws; what was recorded until then stays.
TEST_F(RecorderTest, WithoutMemoryTheRecordingEndsAndAnotherMayBegin) {
  Live live(folder_, SmallConfig());
  ASSERT_TRUE(live.Record().ok());
  live.Hear(0, FrameOf(Hello(1, 1)));
  live.service().Detach(&live.recorder());
  live.recorder().OnFailure();
  EXPECT_FALSE(live.recorder().status().recording);
  EXPECT_EQ(live.recorder().status().error, "out of memory");
  EXPECT_EQ(live.recorder().status().lost, 1u);
  live.Hear(0, FrameOf(Trace(1, 1)));  // in neither file
  live.now_ms += 1'000;
  ASSERT_TRUE(live.Record().ok());
  EXPECT_EQ(live.recorder().status().error, "");
  live.Hear(0, FrameOf(Trace(1, 2)));
  live.Finish();
  const std::vector<std::string> files = live.Files();
  ASSERT_EQ(files.size(), 2u);
  const auto batches = [&](size_t file) {
    size_t count = 0;
    for (const Found& found : RecordsOf(files[file])) {
      count += std::holds_alternative<Batch>(found.record) ? 1u : 0u;
    }
    return count;
  };
  EXPECT_EQ(batches(0), 1u);
  EXPECT_EQ(batches(1), 1u);
  EXPECT_EQ(ReplayError(files[1]), "");
}

}  // namespace
}  // namespace pheromone::capture
