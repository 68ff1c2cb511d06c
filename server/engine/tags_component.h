// The virtual RFID tags as a component: SCAN, READ, WRITE, ERASE, SYMBOL and RESOLVE, and what an
// operator writes.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/tag_messages.h"
#include "server/engine/component.h"
#include "server/tags/store.h"

namespace pheromone::engine {

/// An operator's change of the tags. A row of the symbol tables, a block, or its end.
struct TagsChanged {
  static constexpr EventKind kKind{16};
  static constexpr uint8_t kVersion = 1;
  enum class Action : uint8_t { kDefine, kWrite, kErase };

  Action action = Action::kWrite;
  tags::Row row{tags::RowKind::kRobot, 1, 1, {}};  ///< to be defined
  uint16_t tag = 0;
  bool has_slot = false;  ///< else the drop policy chooses
  uint8_t slot = 0;
  bool has_expected = false;
  uint16_t expected = 0;  ///< the generation, as in tags::WriteRequest
  bool is_state = false;
  uint32_t lease_ms = 0;
  tags::Block block{};  ///< to be written, of any author; time 0: now

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("action", it.action, UpTo(Action::kErase));
    visit("row", it.row);
    visit("tag", it.tag);
    visit("has_slot", it.has_slot);
    visit("slot", it.slot);
    visit("has_expected", it.has_expected);
    visit("expected", it.expected);
    visit("is_state", it.is_state);
    visit("lease_ms", it.lease_ms, Within(0, tags::kMaxLeaseMs));
    visit("block", it.block);
  }
};

class TagsComponent final : public Component {
 public:
  static constexpr std::string_view kName = "tags";

  /// Of an engine that has these tags.
  static ComponentConfig ConfigOf(const tags::Settings& settings);

  const tags::Store& store() const { return store_; }

  std::unique_ptr<Component> Clone() const override {
    return std::make_unique<TagsComponent>(*this);
  }
  std::string_view name() const override { return kName; }
  std::vector<MessageRule> messages() const override;
  std::vector<EventKind> event_kinds() const override { return {TagsChanged::kKind}; }
  /// Adds the tags' part to a prepared change of the configuration, if they change.
  static Status Prepare(const SharedConfig& present, const tags::Survey& survey,
                        ConfigChanged* change);
  Status CheckConfig(const Context& context, const EngineConfig& next,
                     const ConfigPlan* plan) const override;
  void Configure(const Context& context, const Reconfiguration& change, const Output& out) override;
  protocol::Message Answer(const Context& context, LinkIndex link,
                           const protocol::Message& request) const override;
  protocol::Message Change(const Context& context, LinkIndex link,
                           const protocol::Message& request) override;
  Status Check(const Context& context, const Event& event) const override;
  void Apply(const Context& context, const Event& event, const Output& out) override;
  void Advance(const Context& context, const Output& out) override;
  std::optional<uint64_t> NextDeadline() const override { return store_.NextExpiry(); }
  uint64_t Hash() const override { return store_.hash(); }
  void Save(ByteWriter* writer) const override { store_.Save(writer); }
  void Restore(const Context& context, ByteReader* reader) override;
  std::unique_ptr<FrozenPart> Freeze(uint64_t most_kept_bytes) const override;

 private:
  const tags::Plan* CurrentIn(const ConfigPlan* plan) const;
  bool IsInRange(const Context& context, LinkIndex link, uint8_t id, int32_t x, int32_t y,
                 uint16_t tag) const;
  protocol::Message Scan(const Context& context, LinkIndex link,
                         const protocol::ScanRequest& request) const;
  protocol::Message Read(const Context& context, const protocol::TagReadRequest& request) const;
  std::optional<protocol::Message> Resolve(const protocol::ResolveRequest& request) const;
  /// What WRITE and ERASE have in common: the tag's range, who the author is, the flags.
  template <typename Request>
  protocol::Reason Admit(const Context& context, LinkIndex link, const Request& request,
                         uint8_t known_flags, int32_t* author) const;
  protocol::Reason Write(const Context& context, LinkIndex link, const protocol::Message& message,
                         protocol::Message* answer);
  protocol::Reason Erase(const Context& context, LinkIndex link, const protocol::Message& message,
                         protocol::Message* answer);
  protocol::Reason Define(const Context& context, LinkIndex link, const protocol::Message& message,
                          protocol::Message* answer);
  protocol::Message AnswerToWritten(const protocol::Message& request, uint16_t tag,
                                    uint8_t slot) const;

  tags::Store store_;
};

}  // namespace pheromone::engine
