// What two states of conversation_world.h have in common if they are taken for the same.
#include <algorithm>
#include <string>
#include <vector>

#include "client_fw/verify/conversation_world.h"
#include "server/base/bytes.h"
#include "server/core/engine/event_codec.h"

namespace pheromone::verify {
namespace {

using protocol::Message;

void WriteMessages(const std::vector<Message>& messages, ByteWriter* writer) {
  std::vector<std::string> all;
  for (const Message& message : messages) {
    ByteWriter one;
    EncodeFields(message, &one);
    all.push_back(one.Take());
  }
  std::sort(all.begin(), all.end());  // any of them may be next
  writer->Count(all.size());
  for (const std::string& one : all) {
    writer->Text(one);
  }
}

// Of a robot in the engine, what the next answers depend on.
void WriteRobot(const engine::RobotState* robot, ByteWriter* writer) {
  writer->Flag(robot != nullptr);
  if (robot != nullptr) {
    writer->U16(robot->epoch);
    writer->U16(robot->hello.nonce);
    writer->U16(robot->previous_nonce.value_or(0));
    writer->U8(robot->last_opcode);
    writer->U8(robot->last_seq);
    writer->U16(robot->last_crc);
    EncodeFields(robot->last_answer, writer);
  }
}

}  // namespace

std::string ConversationWorld::Key() const {
  ByteWriter writer;
  for (const int left : {left_.changes, left_.warm_resets, left_.power_losses, left_.crashes,
                         left_.turned_away, left_.silences, left_.other_robots, made_, pending_}) {
    writer.U8(static_cast<uint8_t>(left));
  }
  writer.U16(memory_.nonce);
  writer.U16(memory_.epoch);
  writer.U8(memory_.seq);
  writer.U8(memory_.opcode);
  // What is not pending is built anew before it is sent.
  const bool pends_tag = IsOfTags(memory_.opcode);
  const uint8_t length = pends_tag ? memory_.tag_length : memory_.length;
  for (uint8_t i = 0; memory_.opcode != 0 && i < length; ++i) {
    writer.U8(pends_tag ? memory_.tag_data[i] : memory_.data[i]);
  }
  writer.Flag(memory_.numbered);
  writer.Flag(robot_.requests().greeted);
  writer.U8(robot_.state().flags);
  writer.Flag(robot_.state().events != 0);
  writer.Flag(robot_.requests().event_turn);
  writer.U8(robot_.awaited_opcode());
  writer.U8(robot_.query_phase());
  writer.U8(exchange_.state);
  writer.Flag(exchange_.is_pending);
  if (exchange_.state == client::TagExchange::kAsked) {
    EncodeFields(exchange_.message, &writer);
  }
  for (const auto* const engine : {&server_, &durable_}) {
    WriteRobot((**engine)->robots().Find(0, kChangesRobot), &writer);
    writer.Flag((**engine)->robots().Find(0, kChangesRobot + 1) != nullptr);
    for (int change = 0; change < made_; ++change) {  // nothing else changes the map
      writer.U32(TimesMade(**engine, change));
    }
    writer.U16(is_of_tags() ? GenerationOn(***engine) : uint16_t{0});
  }
  writer.Flag(server_ == durable_);
  writer.U8(static_cast<uint8_t>(left_.rounds));
  writer.Flag(robot_.in_rounds());
  const int awaited = robot_.awaited_round();
  writer.U8(awaited < 0 ? uint8_t{0} : static_cast<uint8_t>(awaited - number_));
  writer.Flag(awaited >= 0);
  writer.U8(robot_.awaited_place());
  writer.U8(static_cast<uint8_t>(4 * turns_ + 2 * place_ + (other_was_heard_ ? 1 : 0)));
  for (const engine::Outgoing& answer : answered_) {
    writer.Flag(answer.durable_at > (*durable_)->sequence());
    EncodeFields(answer.message, &writer);
  }
  WriteMessages(held_, &writer);
  WriteMessages(to_server_, &writer);
  WriteMessages(to_robot_, &writer);
  for (const Told told : told_) {
    writer.U8(static_cast<uint8_t>(told));
  }
  writer.Text(fault_);
  return writer.Take();
}

}  // namespace pheromone::verify
