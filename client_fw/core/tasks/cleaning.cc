#include "client_fw/core/tasks/cleaning.h"

namespace pheromone {
namespace client {

CleaningDecision Decide(const CleaningView& view, uint8_t pick) {
  uint8_t oldest[kMaxVisibleTags];
  uint8_t choices = 0;
  uint32_t oldest_s = 0;
  for (uint8_t i = 0; i < view.count; ++i) {
    const ZoneTag& tag = view.tags[i];
    if (tag.is_occupied || tag.is_closed) {
      continue;
    }
    const uint32_t cleaned_s = tag.cleaned_s > tag.wanted_s ? tag.cleaned_s : 0;
    if (choices > 0 && cleaned_s < oldest_s) {
      choices = 0;
    }
    if (choices == 0 || cleaned_s == oldest_s) {
      oldest_s = cleaned_s;
      oldest[choices++] = i;
    }
  }
  if (choices == 0) {
    return {CleaningAct::kWait, 0, 0};
  }
  if (oldest[0] == 0) {
    return {CleaningAct::kClean, 0, 1};
  }
  return {CleaningAct::kMove, oldest[pick % choices], choices};
}

}  // namespace client
}  // namespace pheromone
