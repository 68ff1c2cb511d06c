// Of several servers with one log: what another one orders, and what is passed on to it.

#include <utility>

#include "server/core/engine/service/service.h"

namespace pheromone::engine {

using protocol::Message;
using protocol::Reason;

bool Service::IsForwarded(const RequestReceived& received, const Asker& asker) {
  if (!forward_ || asker.is_forwarded || !forward_(received)) {
    return false;
  }
  forwarded_[{received.link, received.message.id}] = asker;
  ++counters_.forwarded;
  return true;
}

Status Service::Follow(const Stamp& stamp, Event event, std::vector<Outgoing>* out) {
  const bool is_edit = std::holds_alternative<FieldEdited>(event);
  if (is_edit || std::holds_alternative<ConfigChanged>(event)) {
    std::optional<SharedConfig> present;
    tags::Survey survey;
    {
      const std::lock_guard lock(mutex_);
      if (engine_.configured()) {
        present = engine_.shared_config();
        survey = engine_.Look();
      }
    }
    if (present) {
      PHEROMONE_TRY_STATUS(is_edit ? Engine::Prepare(*present, &event)
                                   : Engine::Prepare(*present, survey, &event));
    }
  }
  std::vector<Outgoing> made;
  const std::lock_guard lock(mutex_);
  PHEROMONE_TRY_STATUS(engine_.Check(event));
  clock_.Follow(stamp, read_clock_());
  const uint64_t sequence = Order(stamp, event, &made);
  awaited_works_.erase(sequence);
  if (configured_ && std::holds_alternative<ConfigChanged>(event)) {
    configured_();
  }
  const auto* received = std::get_if<RequestReceived>(&event);
  if (received != nullptr) {
    const Observer::Outcome outcome{sequence, Reason::kNone};
    NotifyOfBatch(stamp, received->link, {&received->message, 1}, {&outcome, 1}, made);
  }
  const size_t before = out->size();
  for (const Outgoing& it : made) {
    if (it.message.opcode == protocol::kCommand) {
      const RobotTraffic* robot = traffic_.Find(it.link, it.message.id);
      if (it.message.id == protocol::kBroadcastId || (robot != nullptr && !robot->elsewhere)) {
        out->push_back(it);
      }
    } else {
      AppendForwarded(it, out);
    }
  }
  HoldBack(out, before);
  return Ok();
}

void Service::AppendForwarded(Outgoing answer, std::vector<Outgoing>* out) {
  const auto waits = forwarded_.extract({answer.link, answer.message.id});
  if (!waits.empty()) {
    answer.asker = waits.mapped();
    out->push_back(std::move(answer));
  }
}

std::vector<HeardPose> Service::PosesSince(uint64_t since_ms) const {
  std::vector<HeardPose> poses;
  const std::lock_guard lock(mutex_);
  traffic_.ForEachHeard(since_ms, [&poses](const HeardPose& it) { poses.push_back(it); });
  return poses;
}

void Service::NotePoses(std::span<const HeardPose> poses) {
  const std::lock_guard lock(mutex_);
  for (const HeardPose& it : poses) {
    if (it.link < engine_.config().links.size()) {
      traffic_.NoteElsewhere(it);
    }
  }
}

void Service::AnswerForwarded(LinkIndex link, const Message& message, std::vector<Outgoing>* out) {
  const std::lock_guard lock(mutex_);
  AppendForwarded({link, 0, message, {}}, out);
}

}  // namespace pheromone::engine
