// Petri nets that the server executes on virtual tags: the environment's readers below them.
// server/core/petri/README.md, "Live nets", says what for.
//
// Each net has the author "net:NAME" on its tags. In slot 0 it keeps the trigger record of the
// robots' net, in slot 1 what it tells robots; theirs are in other slots, and are erased when they
// were read. It reads at instants half a period after the period's multiples: robots' accesses are
// between them, each at once. A record left in between makes the next instant due, as does a change
// of the advice by evaporation; otherwise nothing happens, and nothing is logged.
//
// The composed net's firings since the last Advance are in fired(), for replays and observers.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/net_record.h"
#include "server/core/engine/part.h"
#include "server/core/petri/live_net.h"
#include "server/core/tags/block.h"
#include "server/core/tags/store.h"

namespace pheromone::engine {

/// A firing of a composed net.
struct NetFiring {
  std::string_view net;     ///< its name; valid until the next event
  uint32_t transition = 0;  ///< of the composed net
  int32_t robot = 0;        ///< its author's number; 0: the environment
};

/// What is written on a tag about a net: all of a block but its author and time.
using NetStatement = std::array<uint8_t, protocol::kNetStatementSize>;
NetStatement StatementOf(const tags::Block& block);

class NetsPart {
 public:
  /// Slots that a tag of a net needs: the reader's two, and some for robots.
  static constexpr uint8_t kLeastSlots = 4;
  /// Numbers of authors from here on are given to nets, so that robots keep the low ones.
  static constexpr int32_t kFirstAuthor = 1'000'001;

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

  Status CheckConfig(const Context& context, const EngineConfig& next,
                     const ConfigPlan* plan) const;
  void Configure(const Context& context, const Reconfiguration& change, const Output& out);
  Status Check(const Context& context, const NetsChanged& changed) const;
  void Apply(const Context& context, const NetsChanged& changed, const Output& out);
  void Advance(const Context& context, const Output& out);
  /// After each event, of whatever part: sees what it has changed on tags. Short.
  void Notice(const Context& context);
  std::optional<uint64_t> NextDeadline() const;
  uint64_t Hash() const;
  void Save(ByteWriter* writer) const;
  void Restore(const Context& context, ByteReader* reader);
  std::unique_ptr<FrozenPart> Freeze(uint64_t /*most_kept_bytes*/) const {
    return std::make_unique<FrozenBytes>(*this);
  }

 private:
  void Act(const Context& context, Instance* it, const Output& out);

  std::map<std::string, Instance, std::less<>> nets_;
  std::vector<NetFiring> fired_;
};

static_assert(Part<NetsPart>);

}  // namespace pheromone::engine
