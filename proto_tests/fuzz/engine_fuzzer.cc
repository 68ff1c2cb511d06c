// The engine under any messages at any times, and under all that an operator, a tracker, the clocks
// and the log may do to it. It must not crash, and of what it became must hold:
//
//   - its log, applied to a fresh engine, leads to the same state hash, at the end and at each
//   place
//     where the log began another segment, and sends the same messages again;
//   - saved and restored in the midst of it, it goes on as if nothing had been;
//   - a state that was damaged is not restored, or is another one that is as good.
//
// The first byte of the input chooses the map. Then come records: a byte of time, a byte that is a
// message's length or, from 240 on, says what else happens, and what that takes (the functions of
// Session, in order). What is not there any more is zero.

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto_tests/fuzz/service_record.h"
#include "server/core/engine/config_check.h"
#include "server/core/engine/service/service.h"
#include "server/core/engine/testing/random_traffic.h"

namespace {

using namespace pheromone::engine;  // NOLINT(google-build-using-namespace)
using pheromone::ByteReader;
using pheromone::field::FieldEdit;
using pheromone::field::PheromoneLaw;
using pheromone::fuzz::MoodyLog;
using pheromone::fuzz::Recorder;
using pheromone::fuzz::Require;
using pheromone::fuzz::RequireLasting;
using pheromone::fuzz::Saved;
using pheromone::protocol::Message;
using pheromone::protocol::Reason;

// With a ninth of the nodes, so that what concerns all of them does not take long.
EngineConfig CoarseConfig(bool tight) {
  EngineConfig config = testing::RichConfig(tight);
  pheromone::field::MapGeometry& map = config.field.map;
  map.cell_um *= 3;
  config.field.initial_rasters[0].nodes =
      pheromone::field::Shared(std::vector<pheromone::field::InitialNode>{{{3, 4}, 64}});
  pheromone::field::ObstacleMask walls(map.columns(), map.rows());
  walls.BlockRow(20, 7, 30);
  walls.Set({100, 100});
  config.field.obstacles = pheromone::field::Shared(std::move(walls));
  return config;
}

class Session {
 public:
  explicit Session(std::string_view input) : input_(input) {
    const uint8_t choice = input_.U8();
    if (choice % 2 == 0) {
      config_ = testing::SmallConfig();
      config_.frames = {MakeFrame("radio-b", 1, {3'000'000, 0}, 30)};
      using pheromone::field::CellMap;
      config_.field.memory_bytes =
          4 * CellMap::kTileBytes + 2 * CellMap::kLeafBytes +
          2 * CellMap::TopBytes(config_.field.map.columns(), config_.field.map.rows());
    } else {
      config_ = CoarseConfig(choice % 4 == 3);
    }
    Start(0, {});
    Require(service_->Configure(config_, 1).ok());
  }

  void Run() {
    while (!input_.AtEnd()) {
      const uint8_t pause = input_.U8();
      boottime_ms_ += uint64_t{pause} * pause * pause;
      const uint8_t what = input_.U8();
      constexpr uint8_t kFirstOther = 240;
      if (what < kFirstOther) {
        Send(what);
      } else {
        static constexpr void (Session::*kOthers[])() = {
            &Session::Reconfigure, &Session::Command,    &Session::Observe,  &Session::Edit,
            &Session::TurnClocks,  &Session::TurnLog,    &Session::Restart,  &Session::Damage,
            &Session::GoTo,        &Session::ChangeTags, &Session::ResetNet, &Session::RevokeKeys};
        (this->*kOthers[(what - kFirstOther) % std::size(kOthers)])();
      }
      LetTimePass();
    }
    CheckCounts();
    Replay();
  }

 private:
  void Start(uint64_t start_ms, Engine engine) {
    service_ = std::make_unique<Service>(
        &log_,
        [this] {
          return ClockReading{boottime_ms_, utc_ms_};
        },
        start_ms, std::move(engine));
    service_->OnEarlierDeadline([] {});
    service_->Attach(&recorder_, [](const Engine&) {});
  }

  // Anything up to some 10^18, and that is more than anything may be.
  int64_t Far() {
    const int64_t number = input_.I32();
    return number * (int64_t{1} << input_.U8() % 31);
  }
  pheromone::field::PointUm FarPoint() {
    const int64_t x = Far();
    return {x, Far()};
  }

  void Send(uint8_t length) {
    Message message;
    message.length = std::min(length, pheromone::protocol::kMaxData);
    message.id = input_.U8();
    message.opcode = input_.U8();
    std::generate_n(message.data, message.length, [this] { return input_.U8(); });
    // The second link may have left.
    const auto link = static_cast<LinkIndex>(
        message.id % service_->Inspect([](const Engine& it) { return it.config().links.size(); }));
    service_->Handle(link, {&message, 1}, &out_);
  }

  // One that an operator might change to; some of them the running state cannot follow, and some
  // no file can hold.
  void Reconfigure() {
    EngineConfig next = service_->Inspect([](const Engine& it) { return it.config(); });
    const uint8_t what = input_.U8();
    const uint8_t which = input_.U8();
    if (next.field.pheromones.empty()) {
      next.field.pheromones = config_.field.pheromones;
    }
    PheromoneLaw& law = next.field.pheromones[which % next.field.pheromones.size()];
    switch (what % 16) {
      case 0:
        law.tau_ms = Far();
        break;
      case 1:
        law.max_count = input_.U16();
        break;
      case 2:
        law.evaporation = static_cast<pheromone::field::Evaporation>(which / 16 % 4);
        break;
      case 3:
        law.diffusion = {input_.U16(), input_.U16(), input_.U32(), input_.U16()};
        break;
      case 4:
        law.blend = {{input_.U8(), input_.I32()}};
        break;
      case 5:
        std::erase_if(next.field.pheromones,
                      [type = law.type](const PheromoneLaw& it) { return it.type == type; });
        break;
      case 6:
        next.field.map.cell_um = Far();
        break;
      case 7:
        next.field.antennas = {Far(), Far(), input_.U16()};
        break;
      case 8:
        next.links.resize(1 + which % 3, {"radio-" + std::to_string(which % 2), 4, 50});
        break;
      case 9:
        next.frames.push_back(MakeFrame("radio-a", which, FarPoint(), input_.U16() / 100.0));
        next.frames.back().heading =
            static_cast<uint16_t>(next.frames.back().heading + input_.U8());
        break;
      case 10:
        next.field.paths.push_back({which, input_.U16(), true, {FarPoint(), FarPoint()}});
        break;
      case 11:
        next.field.initial_rasters = {
            {which, pheromone::field::Shared(std::vector{pheromone::field::InitialNode{
                        {input_.I16(), input_.I16()}, input_.U32()}})}};
        break;
      case 12:
        next.field.memory_bytes = input_.U16() * uint64_t{64};
        break;
      case 13:
        next.pose_unit_10um = input_.U16();
        break;
      case 14:
        law.profile = static_cast<pheromone::field::Profile>(which / 16 % 3);
        law.core_um = Far();
        law.sigma_um = Far();
        law.cutoff_um = Far();
        break;
      default:
        next = config_;
    }
    // Whoever reads a configuration, from a file or a journal, does not let other ones through.
    if (CheckValues(next).ok()) {
      static_cast<void>(service_->Configure(next, which, what >= 128));
    }
  }

  void Command() {
    CommandIssued command;
    command.link = input_.U8() % 3;
    command.id = input_.U8();
    command.code = static_cast<pheromone::protocol::CommandCode>(input_.U8());
    std::generate_n(command.arguments.begin(), 2, [this] { return input_.U8(); });
    static_cast<void>(service_->Issue(command, &out_));
  }

  void Observe() {
    PoseObserved seen;
    seen.link = input_.U8() % 3;
    seen.id = input_.U8();
    seen.pose = {FarPoint(), input_.U16()};
    seen.valid_ms = input_.U32();
    static_cast<void>(service_->Observe({&seen, 1}));
  }

  void GoTo() {
    const auto link = static_cast<LinkIndex>(input_.U8() % 3);
    const uint8_t id = input_.U8();
    const uint32_t tolerance_um = input_.U32();
    static_cast<void>(tolerance_um == 0 ? service_->CancelGoal(link, id)
                                        : service_->SetGoal(link, id, FarPoint(), tolerance_um));
  }

  void ResetNet() {
    const bool is_known = input_.U8() % 2 == 0;
    static_cast<void>(service_->Submit(NetsChanged{is_known ? "gate" : "gote"}, &out_));
  }

  void RevokeKeys() {
    KeysRevoked change;
    change.keys.resize(input_.U8() % 4);
    for (RevokedKey& key : change.keys) {
      key = {input_.U8(), {input_.U8()}};
    }
    static_cast<void>(service_->Submit(change, &out_));
  }

  void ChangeTags() {
    const uint8_t kind = input_.U8() % 4;
    const uint16_t tag = input_.U8();
    const uint8_t slot = input_.U8();
    const uint8_t has = input_.U8();  // bit 0: a slot; 1: an expected generation; 2: is_state
    const auto expected = (has & 2) != 0 ? std::optional(input_.U16()) : std::nullopt;
    TagsChanged change;
    if (kind == 0) {
      TagsChanged::Write write{.tag = tag, .expected = expected, .is_state = (has & 4) != 0};
      if ((has & 1) != 0) {
        write.slot = slot;
      }
      write.lease_ms = input_.U32();
      write.block = {input_.I32(),
                     input_.U32(),
                     {input_.I32(), input_.I32()},
                     {input_.I32(), input_.I32()},
                     {input_.I32(), input_.I32()}};
      change.change = write;
    } else if (kind == 1) {
      change.change = TagsChanged::Erase{tag, slot, expected};
    } else if (kind == 3) {
      const uint8_t id = input_.U8();
      change.change = TagsChanged::Forget{{id == 0 ? "" : "radio-a", id}};
    } else {
      pheromone::tags::Row row{
          static_cast<pheromone::tags::RowKind>(input_.U8()), input_.I32(), input_.I32(), {}};
      const uint8_t length = input_.U8();
      row.text.assign(length, static_cast<char>(input_.U8()));
      change.change = TagsChanged::Define{row};
    }
    static_cast<void>(service_->Submit(change, &out_));
  }

  void Edit() {
    FieldEdit edit;
    edit.type = input_.U8();
    edit.shape = static_cast<FieldEdit::Shape>(input_.U8());
    edit.action = static_cast<FieldEdit::Action>(input_.U8());
    edit.level = input_.U32();
    edit.radius_um = Far();
    const uint8_t points = input_.U8();
    if (points == 253 || points == 254) {
      static_cast<void>(service_->Reverse(points == 254));
      return;
    }
    if (points >= 128) {
      edit.continues = last_edit_;
    }
    edit.points.resize(points == 255 ? 1025 : points % 8);
    std::generate_n(edit.points.begin(), points % 8, [this] { return FarPoint(); });
    const auto made = service_->Edit(edit);
    last_edit_ = made.ok() ? made.value().edit : last_edit_;
  }

  void TurnClocks() {
    boottime_ms_ += static_cast<uint64_t>(Far());
    utc_ms_ = Far();
  }

  void TurnLog() {
    const uint8_t mood = input_.U8();
    log_.refusal = mood % 4 == 0 ? Reason::kReadOnly : Reason::kNone;
    log_.rotation_due = mood / 4 % 2 != 0;
    log_.durable = log_.DurableSequence();
    log_.lags = mood / 8 % 2 != 0;
    service_->Release(&out_);
  }

  // As a restart does it that lost nothing.
  void Restart() {
    const std::string state = service_->Inspect(Saved);
    const uint64_t hash = service_->StateHash();
    ByteReader reader(state);
    auto restored = Engine::Restore(&reader);
    reader.ExpectEnd();
    Require(restored.ok() && reader.ok() && restored.value().StateHash() == hash &&
            Saved(restored.value()) == state);
    const Stamp last = log_.events.back().first;
    const uint64_t resumed_ms = FieldClock::ResumeAt(last, Far(), input_.U8() % 2 == 0);
    CheckCounts();
    Require(resumed_ms >= last.field_time_ms && resumed_ms <= kMaxFieldTimeMs);
    Start(resumed_ms, std::move(restored.value()));
  }

  // A few bytes of what is saved become others. What follows a count that was made larger is read
  // as something else, and so on: seldom a state, and never a crash.
  void Damage() {
    std::string state = service_->Inspect(Saved);
    const size_t size = state.size();
    for (uint8_t left = input_.U8() % 4; left > 0; --left) {
      state[input_.U32() % size] = static_cast<char>(input_.U8());
    }
    const uint32_t cut = input_.U16();
    const std::string_view whole = state;
    ByteReader reader(whole.substr(0, cut == 0 ? size : cut));
    const auto restored = Engine::Restore(&reader);
    if (restored.ok()) {
      RequireLasting(restored.value());
    }
  }

  // What is due is done; a deadline and its distance tell the same.
  void LetTimePass() {
    const auto left_ms = service_->MillisecondsToDeadline();
    const size_t before = log_.events.size();
    service_->AdvanceIfDue(&out_);
    Require(left_ms == 0u || log_.events.size() == before);
    service_->Release(&out_);
  }

  // What is counted by opcode and by robot is what came.
  void CheckCounts() const {
    const uint64_t requests = service_->counters().requests;
    service_->InspectTraffic([&](const Engine& engine, const Traffic& traffic) {
      uint64_t by_opcode = 0;
      uint64_t by_robot = 0;
      for (const uint64_t count : traffic.by_opcode()) {
        by_opcode += count;
      }
      const auto links = static_cast<LinkIndex>(engine.config().links.size());
      for (LinkIndex link = 0; link < links; ++link) {
        traffic.ForEachOf(link, [&](uint8_t id, const RobotTraffic& robot) {
          Require(traffic.Find(link, id) == &robot);
          by_robot += robot.requests;
        });
      }
      Require(traffic.Find(9, 1) == nullptr);
      Require(by_opcode == requests && by_robot <= requests);
      Require(engine.sequence() == log_.events.size());
    });
    Require(service_->FindLink("radio-a") == LinkIndex{0} && !service_->FindLink("radio-z"));
  }

  void Replay() const {
    Engine replayed;
    std::vector<Outgoing> again;
    auto segment = log_.segments.begin();
    for (size_t i = 0; i < log_.events.size(); ++i) {
      for (; segment != log_.segments.end() && segment->events == i; ++segment) {
        Require(replayed.StateHash() == segment->hash);
      }
      const auto& [stamp, event] = log_.events[i];
      Require(replayed.Check(event).ok());
      replayed.Apply(i + 1, stamp, event, &again);
    }
    Require(replayed.StateHash() == service_->StateHash());
    Require(std::equal(again.begin(), again.end(), recorder_.sent.begin(), recorder_.sent.end(),
                       [](const Outgoing& a, const Outgoing& b) {
                         return a.link == b.link && a.durable_at == b.durable_at &&
                                testing::SameMessage(a.message, b.message);
                       }));
  }

  ByteReader input_;
  EngineConfig config_;
  MoodyLog log_;
  Recorder recorder_;
  uint64_t boottime_ms_ = 1;
  int64_t utc_ms_ = 0;
  uint64_t last_edit_ = 0;
  std::unique_ptr<Service> service_;
  std::vector<Outgoing> out_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  Session(std::string_view(reinterpret_cast<const char*>(data), size)).Run();
  return 0;
}
