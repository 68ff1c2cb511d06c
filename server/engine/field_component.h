// The pheromone field as a component: SENSE, DEPOSIT and TRACE, and the operator's edits.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "server/engine/component.h"
#include "server/field/field.h"

namespace pheromone::engine {

class FieldComponent final : public Component {
 public:
  /// Not before the first configuration.
  const field::Field& field() const { return *field_; }

  /// As Engine::Prepare.
  static Status Prepare(const SharedConfig& present, Event* event);

  /// As Engine::CheckEdit.
  Status CheckEdit(const field::FieldEdit& edit) const;

  /// As in Field.
  bool busy() const override { return field_ != nullptr && field_->busy(); }
  bool ReleaseMemory() { return field_ != nullptr && field_->ReleaseMemory(); }

  std::unique_ptr<Component> Clone() const override;
  std::string_view name() const override { return "field"; }
  std::vector<MessageRule> messages() const override;
  std::vector<EventKind> event_kinds() const override { return {EventKind::kFieldEdited}; }
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
  std::optional<uint64_t> NextDeadline() const override;
  uint64_t Hash() const override { return field_ != nullptr ? field_->hash() : 0; }
  void Save(ByteWriter* writer) const override { field_->Save(writer); }
  void Restore(const Context& context, ByteReader* reader) override;
  std::unique_ptr<FrozenPart> Freeze(uint64_t most_kept_bytes) const override;

 private:
  std::optional<field::Intensities> Sense(const Context& context, LinkIndex link, uint8_t id,
                                          uint8_t type, const field::PoseUm& pose,
                                          field::SenseError* error) const;
  protocol::Message Deposit(const Context& context, LinkIndex link,
                            const protocol::Message& message);
  protocol::Message Trace(const Context& context, LinkIndex link, const protocol::Message& message);

  std::unique_ptr<field::Field> field_;
};

}  // namespace pheromone::engine
