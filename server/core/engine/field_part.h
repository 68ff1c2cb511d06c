// The pheromone field as a part: SENSE, DEPOSIT and TRACE, and the operator's edits.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "server/core/engine/part.h"
#include "server/core/field/field.h"

namespace pheromone::engine {

class FieldPart {
 public:
  FieldPart() = default;
  FieldPart(const FieldPart& other)
      : field_(other.field_ != nullptr ? other.field_->Clone() : nullptr) {}
  FieldPart(FieldPart&&) noexcept = default;
  FieldPart& operator=(const FieldPart& other) { return *this = FieldPart(other); }
  FieldPart& operator=(FieldPart&&) noexcept = default;
  ~FieldPart() = default;

  /// Not before the first configuration.
  const field::Field& field() const { return *field_; }

  /// As Engine::Prepare.
  static Status Prepare(const SharedConfig& present, Event* event);

  /// As Engine::CheckEdit.
  Status CheckEdit(const field::FieldEdit& edit) const;

  /// As in Field.
  bool busy() const { return field_ != nullptr && field_->busy(); }
  uint64_t TakeCost() { return field_ != nullptr ? field_->TakeCost() : 0; }
  bool ReleaseMemory() { return field_ != nullptr && field_->ReleaseMemory(); }

  Status CheckConfig(const Context& context, const EngineConfig& next,
                     const ConfigPlan* plan) const;
  void Configure(const Context& context, const Reconfiguration& change, const Output& out);
  protocol::Message Answer(const Context& context, LinkIndex link,
                           const protocol::Message& request) const;
  protocol::Message Change(const Context& context, LinkIndex link,
                           const protocol::Message& request);
  Status Check(const Context& context, const FieldEdited& edited) const;
  void Apply(const Context& context, const FieldEdited& edited, const Output& out);
  Status Check(const Context& context, const EditReversed& reversed) const;
  void Apply(const Context& context, const EditReversed& reversed, const Output& out);
  void ForgetEdits() { field_->ForgetEdits(); }
  void Advance(const Context& context, const Output& out);
  std::optional<uint64_t> NextDeadline() const;
  uint64_t Hash() const { return field_ != nullptr ? field_->hash() : 0; }
  void Save(ByteWriter* writer) const { field_->Save(writer); }
  void Restore(const Context& context, ByteReader* reader);
  std::unique_ptr<FrozenPart> Freeze(uint64_t most_kept_bytes) const;

 private:
  std::optional<field::Intensities> Sense(const Context& context, LinkIndex link, uint8_t id,
                                          uint8_t type, const field::PoseUm& pose,
                                          field::SenseError* error) const;
  protocol::Message Deposit(const Context& context, LinkIndex link,
                            const protocol::Message& message);
  protocol::Message Trace(const Context& context, LinkIndex link, const protocol::Message& message);

  std::unique_ptr<field::Field> field_;
};

static_assert(Part<FieldPart>);

}  // namespace pheromone::engine
