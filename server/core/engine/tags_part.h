// The virtual RFID tags: SCAN, READ, WRITE, ERASE, SYMBOL and RESOLVE, and what an
// operator writes.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/tag_messages.h"
#include "server/core/engine/part.h"
#include "server/core/tags/store.h"

namespace pheromone::engine {

/// What nets may do to the tags: at once, as part of the event that is being applied. It is not
/// logged, since whoever applies the event does it again. Each returns false, and changes nothing,
/// if the tags do not permit it.
class TagEditor {
 public:
  TagEditor(tags::Store* store, uint64_t now_ms, int64_t utc_ms)
      : store_(store), now_ms_(now_ms), utc_ms_(utc_ms) {}

  bool Define(const tags::Row& row);
  bool Write(uint16_t tag, uint8_t slot, tags::Block block);
  bool Erase(uint16_t tag, uint8_t slot);

 private:
  tags::Store* store_;
  uint64_t now_ms_;
  int64_t utc_ms_;
};

class TagsPart {
 public:
  const tags::Store& store() const { return store_; }
  TagEditor EditAt(uint64_t now_ms, int64_t utc_ms) { return {&store_, now_ms, utc_ms}; }

  /// Adds the tags' part to a prepared change of the configuration, if they change.
  static Status Prepare(const SharedConfig& present, const tags::Survey& survey,
                        ConfigChanged* change);
  Status CheckConfig(const Context& context, const EngineConfig& next,
                     const ConfigPlan* plan) const;
  void Configure(const Context& context, const Reconfiguration& change, const Output& out);
  protocol::Message Answer(const Context& context, LinkIndex link,
                           const protocol::Message& request) const;
  protocol::Message Change(const Context& context, LinkIndex link,
                           const protocol::Message& request);
  Status Check(const Context& context, const TagsChanged& changed) const;
  void Apply(const Context& context, const TagsChanged& changed, const Output& out);
  void Advance(const Context& context, const Output& out);
  std::optional<uint64_t> NextDeadline() const { return store_.NextExpiry(); }
  uint64_t Hash() const { return store_.hash(); }
  void Save(ByteWriter* writer) const { store_.Save(writer); }
  void Restore(const Context& context, ByteReader* reader);
  std::unique_ptr<FrozenPart> Freeze(uint64_t most_kept_bytes) const;

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
  Status Check(const Context& context, const TagsChanged::Write& write) const;
  Status Check(const TagsChanged::Erase& erase) const;
  Status Check(const TagsChanged::Forget& forget) const;

  tags::Store store_;
};
static_assert(Part<TagsPart>);

}  // namespace pheromone::engine
