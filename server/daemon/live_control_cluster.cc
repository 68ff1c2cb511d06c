// Of several servers: an operator's change that another one has passed on, and the lead.

#include <type_traits>
#include <utility>
#include <variant>

#include "server/daemon/live_control.h"

namespace pheromone::daemon {
namespace {

using cluster::OperatorResult;
using Finish = std::function<void(OperatorResult)>;

OperatorResult Refused(const std::string& why) {
  OperatorResult result;
  result.text = why;
  return result;
}

// What is left of an outcome is filled in by `fill`.
template <typename T, typename Fill>
control::Control::DoneWith<T> Telling(const Finish& finish, Fill fill) {
  return [finish, fill](const Result<T>& outcome) {
    if (!outcome.ok()) {
      finish(Refused(outcome.error()));
      return;
    }
    OperatorResult result;
    result.ok = true;
    fill(outcome.value(), &result);
    finish(result);
  };
}

control::Control::Done Telling(const Finish& finish) {
  return [finish](const Status& done) {
    if (!done.ok()) {
      finish(Refused(done.error()));
      return;
    }
    OperatorResult result;
    result.ok = true;
    finish(result);
  };
}

}  // namespace

void LiveControl::Accept(const cluster::OperatorChange& change, const Finish& done) {
  const Finish finish = [done, number = change.number](OperatorResult result) {
    result.number = number;
    done(std::move(result));
  };
  const auto with_link = [&](engine::LinkIndex link, const auto& make) {
    if (link < parts_.link_configs->size()) {
      make((*parts_.link_configs)[link].name);
    } else {
      finish(Refused("unknown link number " + std::to_string(link) +
                     ", expected one of the configuration that all servers share"));
    }
  };
  std::visit(
      [&](const auto& it) {
        using Change = std::decay_t<decltype(it)>;
        if constexpr (std::is_same_v<Change, engine::FieldEdited>) {
          Edit(it.edit, Telling<control::EditOutcome>(finish, [](const auto& made, auto* result) {
                 result->nodes = static_cast<int64_t>(made.nodes);
                 result->changed = made.changed;
                 result->edit = made.edit;
               }));
        } else if constexpr (std::is_same_v<Change, engine::EditReversed>) {
          Reverse(it.redo,
                  Telling<control::ReverseOutcome>(finish, [](const auto& made, auto* result) {
                    result->info = made.edit;
                    result->text = made.pheromone;
                    result->changed = made.changed;
                  }));
        } else if constexpr (std::is_same_v<Change, engine::CommandIssued>) {
          with_link(it.link, [&](const std::string& link) {
            Issue(link, it.id, it.code, it.arguments, Telling(finish));
          });
        } else if constexpr (std::is_same_v<Change, cluster::GoalRequest>) {
          with_link(it.link, [&](const std::string& link) {
            SetGoal(link, it.id, it.point, it.tolerance_um, Telling(finish));
          });
        } else if constexpr (std::is_same_v<Change, cluster::GoalCancellation>) {
          with_link(it.link,
                    [&](const std::string& link) { CancelGoal(link, it.id, Telling(finish)); });
        } else if constexpr (std::is_same_v<Change, engine::TagsChanged>) {
          ChangeTags(it, Telling(finish));
        } else if constexpr (std::is_same_v<Change, engine::NetsChanged>) {
          ChangeNets(it, Telling(finish));
        } else if constexpr (std::is_same_v<Change, engine::KeysRevoked>) {
          Revoke(it, Telling(finish));
        } else if constexpr (std::is_same_v<Change, cluster::TauChange>) {
          ChangeTau(it.type, it.tau_ms, Telling(finish));
        } else {
          static_assert(std::is_same_v<Change, cluster::ReloadRequest>);
          Reload(Telling<std::vector<std::string>>(
              finish, [](const auto& notes, auto* result) { result->notes = notes; }));
        }
      },
      change.change);
}

void LiveControl::HaltHere() {
  SendHaltsUnlogged(engine::RobotsPart::kBroadcastTransmissions);
}

void LiveControl::StepDown(std::string_view successor, Done done) {
  if (parts_.cluster) {
    parts_.cluster->step_down(successor, std::move(done));
  } else {
    Control::StepDown(successor, std::move(done));
  }
}

}  // namespace pheromone::daemon
