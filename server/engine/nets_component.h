// Petri nets that the server executes on virtual tags: the environment's readers below them, as a
// component. server/petri/README.md, "Live nets", says what for.
//
// Each net has the author "net:NAME" on its tags. In slot 0 it keeps the trigger record of the
// robots' net, in slot 1 what it tells robots; theirs are in other slots, and are erased when they
// were read. It reads at instants half a period after the period's multiples: robots' accesses are
// between them, each at once. A record left in between makes the next instant due, as does a change
// of the advice by evaporation; otherwise nothing happens, and nothing is logged.
//
// The composed net's firings since the last Advance are in fired(), for replays and observers.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/engine/component.h"
#include "server/petri/live_net.h"
#include "server/tags/store.h"

namespace pheromone::engine {

/// An operator's change of a net: it begins anew, with all robots where they were at first. What
/// robots have left on its tags is erased.
struct NetsChanged {
  static constexpr EventKind kKind{17};
  static constexpr uint8_t kVersion = 1;
  enum class Action : uint8_t { kReset };

  Action action = Action::kReset;
  std::string net;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("action", it.action, UpTo(Action::kReset));
    visit("net", it.net);
  }
};

/// A firing of a composed net.
struct NetFiring {
  std::string_view net;     ///< its name; valid until the next event
  uint32_t transition = 0;  ///< of the composed net
  int32_t robot = 0;        ///< its author's number; 0: the environment
};

class NetsComponent final : public Component {
 public:
  static constexpr std::string_view kName = "nets";
  /// Slots that a tag of a net needs: the reader's two, and some for robots.
  static constexpr uint8_t kLeastSlots = 4;
  /// Numbers of authors from here on are given to nets, so that robots keep the low ones.
  static constexpr int32_t kFirstAuthor = 1'000'001;

  /// Of an engine that has these nets.
  static ComponentConfig ConfigOf(const petri::AllLiveSettings& settings);
  static Result<petri::AllLiveSettings> SettingsIn(const EngineConfig& config);
  /// The unique ID of a net's author, which has to be privileged.
  static std::string AuthorOf(std::string_view net) { return "net:" + std::string(net); }

  struct Instance {
    petri::LiveNet net;
    std::optional<uint64_t> due_ms{};     ///< the instant at which its tags are read
    std::optional<uint64_t> change_ms{};  ///< and the one at which the advice changes
    std::vector<uint16_t> seen{};         ///< by tag: its generation when it was looked at last
    std::vector<uint16_t> numbers{};      ///< by tag, once known; not part of the state
  };
  const std::map<std::string, Instance, std::less<>>& nets() const { return nets_; }
  /// What the last event fired, in this order. Not part of the state.
  const std::vector<NetFiring>& fired() const { return fired_; }

  std::unique_ptr<Component> Clone() const override {
    return std::make_unique<NetsComponent>(*this);
  }
  std::string_view name() const override { return kName; }
  std::vector<EventKind> event_kinds() const override { return {NetsChanged::kKind}; }
  Status CheckConfig(const Context& context, const EngineConfig& next,
                     const ConfigPlan* plan) const override;
  void Configure(const Context& context, const Reconfiguration& change, const Output& out) override;
  Status Check(const Context& context, const Event& event) const override;
  void Apply(const Context& context, const Event& event, const Output& out) override;
  void Advance(const Context& context, const Output& out) override;
  void Notice(const Context& context) override;
  std::optional<uint64_t> NextDeadline() const override;
  uint64_t Hash() const override;
  void Save(ByteWriter* writer) const override;
  void Restore(const Context& context, ByteReader* reader) override;

 private:
  void Act(const Context& context, Instance* it, const Output& out);

  std::map<std::string, Instance, std::less<>> nets_;
  std::vector<NetFiring> fired_;
};

}  // namespace pheromone::engine
