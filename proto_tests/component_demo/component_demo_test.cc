// A component is added from one folder: its message, its event, its configuration key and its state
// pass through the engine, the service, the codec and the configuration file, none of which names
// it.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include "proto_tests/component_demo/visits.h"
#include "server/engine/config_check.h"
#include "server/engine/engine.h"
#include "server/engine/event_codec.h"
#include "server/engine/frozen_state.h"
#include "server/engine/service.h"
#include "server/engine/testing/bench.h"
#include "server/engine/testing/scripted_log.h"

namespace pheromone {
namespace {

using engine::Engine;
using engine::Outgoing;
using visits::Visits;

engine::ComponentList Components() {
  engine::ComponentList components = engine::StandardComponents();
  components.emplace_back(std::make_unique<Visits>());
  return components;
}

const Visits& VisitsOf(const Engine& engine) {
  return dynamic_cast<const Visits&>(*engine.components().back());
}

Result<config::Config> Parsed(const std::string& section) {
  constexpr char kRest[] =
      "[map]\nwidth_m = 10.0\nheight_m = 10.0\ncell_m = 0.1\n"
      "[antennas]\nbias_m = 0.33\n"
      "[[pheromone]]\ntype = 1\nname = \"trail\"\ncore_m = 0.1\nsigma_m = 0.4\ntau_s = 30.0\n"
      "quantum = 0.125\nmaximum = 1.0\n"
      "[[link]]\nname = \"radio-a\"\nkind = \"pty\"\npath = \"radio.pty\"\n";
  return config::ParseConfig(kRest + section, "file.toml", std::nullopt,
                             std::span(&visits::kSection, 1));
}

protocol::Message Visit(uint8_t id, uint8_t seq, uint8_t station) {
  protocol::Message message;
  message.id = id;
  message.opcode = visits::kVisit;
  message.length = 2;
  message.data[0] = seq;
  message.data[1] = station;
  return message;
}

int CountIn(const protocol::Message& answer) {
  return answer.opcode == visits::kVisitAnswer ? answer.data[1] + 256 * answer.data[2] : -1;
}

std::string Saved(const Engine& engine) {
  ByteWriter writer;
  engine.Save(&writer);
  return writer.Take();
}

class ComponentDemo : public ::testing::Test {
 protected:
  ComponentDemo() {
    engine::EngineConfig config = Parsed("[visits]\nforget_after_s = 5\n").value().engine;
    Apply(engine::ConfigChanged{std::move(config), 7});
    Handle(engine::testing::Hello(1, 1));
    Handle(engine::testing::Hello(2, 1));
  }

  // As it comes out of the log.
  std::vector<Outgoing> Apply(const engine::Event& event) {
    ByteWriter writer;
    EncodeEvent(event, &writer);
    ByteReader reader(writer.bytes());
    const engine::Event logged = engine::DecodeEvent(&reader);
    reader.ExpectEnd();
    EXPECT_TRUE(reader.ok()) << reader.error();
    EXPECT_TRUE(engine_.Check(logged).ok()) << engine_.Check(logged).error();
    std::vector<Outgoing> out;
    engine_.Apply(engine_.sequence() + 1, {now_ms_, 0}, logged, &out);
    return out;
  }

  protocol::Message Handle(const protocol::Message& message) {
    std::vector<Outgoing> out;
    if (engine_.Classify(0, message) == engine::Handling::kChange) {
      out = Apply(engine::RequestReceived{0, message});
    } else {
      engine_.Answer({now_ms_, 0}, 0, message, &out);
    }
    return out.at(0).message;
  }

  uint64_t now_ms_ = 1'000;
  Engine engine_{Components()};
};

TEST_F(ComponentDemo, ItsMessageIsAnsweredExactlyOnce) {
  EXPECT_EQ(CountIn(Handle(Visit(1, 1, 9))), 1);
  EXPECT_EQ(CountIn(Handle(Visit(1, 1, 9))), 1) << "a repeated request";
  EXPECT_EQ(CountIn(Handle(Visit(2, 1, 9))), 2);
  EXPECT_EQ(engine::testing::ReasonOf(Handle(Visit(1, 1, 8))), protocol::Reason::kSequenceReused);
  EXPECT_EQ(engine::testing::ReasonOf(Handle(Visit(3, 1, 9))), protocol::Reason::kSayHello);
  protocol::Message too_long = Visit(1, 2, 9);
  too_long.length = 3;
  EXPECT_EQ(engine::testing::ReasonOf(Handle(too_long)), protocol::Reason::kBadLength);
}

TEST_F(ComponentDemo, AnEngineWithoutItDoesNotKnowItsMessageNorItsEvent) {
  engine::testing::Bench bench;
  bench.Handle(engine::testing::Hello(1, 1));
  EXPECT_EQ(bench.HandleForReason(Visit(1, 1, 9)), protocol::Reason::kUnknownOpcode);
  EXPECT_EQ(bench.engine.Check(engine::ToEvent(visits::Reset{9})).error(),
            "unknown event kind 200");
}

TEST_F(ComponentDemo, ItsEventChangesItsStateThroughTheLog) {
  EXPECT_EQ(engine_.Check(engine::ToEvent(visits::Reset{9})).error(), "station 9 has no visits");
  Handle(Visit(1, 1, 9));
  Apply(engine::ToEvent(visits::Reset{9}));
  EXPECT_EQ(CountIn(Handle(Visit(1, 2, 9))), 1);
  EXPECT_EQ(engine_.Check(engine::ComponentEvent{visits::Reset::kKind, 1, "too long"}).error(),
            "a reset of visits: trailing bytes");
  EXPECT_EQ(engine_.Check(engine::ComponentEvent{visits::Reset::kKind, 2, "\x09"}).error(),
            "a reset of visits: version 2, expected at most 1");
}

TEST_F(ComponentDemo, ItsDeadlineAndItsKeyOfTheConfigurationCount) {
  Handle(Visit(1, 1, 9));
  EXPECT_EQ(engine_.NextDeadline(), 6'000u);
  now_ms_ = 6'000;
  Apply(engine::Advance{});
  EXPECT_EQ(VisitsOf(engine_).CountOf(9), std::nullopt);
  engine::EngineConfig config = Parsed("").value().engine;  // 60 s
  ASSERT_TRUE(CheckValues(config).ok());
  Apply(engine::ConfigChanged{config, 8});
  Handle(Visit(1, 2, 9));
  EXPECT_EQ(VisitsOf(engine_).NextDeadline(), engine_.field_time_ms() + 60'000);
}

TEST_F(ComponentDemo, AWrongKeyIsNamed) {
  EXPECT_EQ(
      Parsed("[visits]\nforget_after_s = 0\n").error(),
      "file.toml:20:18: visits.forget_after_s: found 0, expected a number from 0.001 to 86400");
  EXPECT_EQ(Parsed("[visit]\n").error(), "file.toml:19:2: visit: unknown key, expected visits?");
  engine::EngineConfig config = engine_.config();
  config.components[0].bytes = "not it";
  EXPECT_EQ(engine_.CheckConfig(config).error(), "visits: unexpected end of data");
  EXPECT_EQ(Engine().CheckConfig(engine_.config()).error(),
            "unknown component \"visits\" in the configuration");
}

TEST_F(ComponentDemo, ItsStateIsSavedFrozenCopiedAndHashed) {
  const uint64_t before = engine_.StateHash();
  Handle(Visit(1, 1, 9));
  EXPECT_NE(engine_.StateHash(), before);
  const std::string bytes = Saved(engine_);
  ByteReader reader(bytes);
  Result<Engine> restored = Engine::Restore(&reader, Components());
  ASSERT_TRUE(restored.ok()) << restored.error();
  EXPECT_EQ(VisitsOf(restored.value()).CountOf(9), 1);
  EXPECT_EQ(Saved(restored.value()), bytes);
  std::string copied;
  const auto frozen = engine_.Freeze(engine::FrozenState::kMaxKeptBytes);
  const Engine branch = engine_;
  Handle(Visit(1, 2, 9));
  while (frozen->CopySome(&copied)) {
  }
  EXPECT_EQ(copied, bytes);
  EXPECT_EQ(Saved(branch), bytes) << "a copy is a state of its own";
  EXPECT_EQ(VisitsOf(engine_).CountOf(9), 2);
  ByteReader again(bytes);
  EXPECT_EQ(Engine::Restore(&again).error(), "unknown component \"visits\" in the configuration");
}

TEST_F(ComponentDemo, AStateWhoseConfigurationItRefusesIsRefused) {
  std::string bytes = Saved(engine_);
  const std::string settings = engine_.config().components[0].bytes;
  bytes.replace(bytes.find(settings), settings.size(), std::string(settings.size(), '\0'));
  ByteReader reader(bytes);
  EXPECT_EQ(Engine::Restore(&reader, Components()).error(),
            "visits: forget_after_ms is 0, expected 1 to 86400000");
}

TEST_F(ComponentDemo, AStateFromBeforeItCameIsRead) {
  engine::testing::Bench bench;
  bench.Handle(engine::testing::Hello(1, 1));
  const std::string bytes = Saved(bench.engine);
  ByteReader reader(bytes);
  const Result<Engine> restored = Engine::Restore(&reader, Components());
  ASSERT_TRUE(restored.ok()) << restored.error();
  EXPECT_EQ(restored.value().StateHash(), bench.engine.StateHash());
}

TEST(ComponentDemoService, AnOperatorsChangeGoesThroughTheLog) {
  engine::testing::ScriptedLog log;
  engine::Service service(
      &log, [] { return engine::ClockReading{}; }, 0, Engine(Components()));
  ASSERT_TRUE(service.Configure(Parsed("").value().engine, 7).ok());
  std::vector<Outgoing> out;
  const std::vector<protocol::Message> batch = {engine::testing::Hello(1, 1), Visit(1, 1, 9)};
  service.Handle(0, batch, &out);
  const Result<uint64_t> refused = service.Submit(engine::ToEvent(visits::Reset{8}), &out);
  EXPECT_EQ(refused.error(), "station 8 has no visits");
  const Result<uint64_t> reset = service.Submit(engine::ToEvent(visits::Reset{9}), &out);
  ASSERT_TRUE(reset.ok()) << reset.error();
  EXPECT_EQ(reset.value(), service.Inspect([](const Engine& it) { return it.sequence(); }));
}

// Whoever adds a component should need its folder, a message in the protocol, and a row in each of
// two lists: nothing else may have to name it.
TEST(ComponentDemoFiles, NothingOutsideTheFolderNamesTheComponent) {
  namespace fs = std::filesystem;
  const fs::path root = PHEROMONE_SOURCE_DIR;
  std::set<std::string> naming;
  for (const char* const top : {"protocol", "server", "client_fw", "proto_tests"}) {
    for (const fs::directory_entry& it : fs::recursive_directory_iterator(root / top)) {
      const std::string extension = it.path().extension();
      if (!it.is_regular_file() || (extension != ".h" && extension != ".cc")) {
        continue;
      }
      std::ifstream file(it.path());
      const std::string text((std::istreambuf_iterator<char>(file)),
                             std::istreambuf_iterator<char>());
      if (text.find("visits::") != std::string::npos ||
          text.find("pheromone::visits") != std::string::npos) {
        naming.insert(it.path().lexically_relative(root).string());
      }
    }
  }
  EXPECT_EQ(naming, (std::set<std::string>{"proto_tests/component_demo/component_demo_test.cc",
                                           "proto_tests/component_demo/visits.cc",
                                           "proto_tests/component_demo/visits.h"}));
  for (const std::string& file : naming) {
    std::cout << "named in " << file << '\n';
  }
}

}  // namespace
}  // namespace pheromone
