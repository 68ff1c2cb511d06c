#include "client_fw/core/tasks/cleaning.h"

namespace pheromone {
namespace client {

CleaningDecision Decide(const CleaningView& view, uint8_t pick) {
  uint8_t oldest[kMaxVisibleTags];
  uint8_t choices = 0;
  for (uint8_t i = 0; i < view.count; ++i) {
    const ZoneTag& tag = view.tags[i];
    if (tag.is_occupied) {
      continue;
    }
    if (choices > 0 && tag.cleaned_s < view.tags[oldest[0]].cleaned_s) {
      choices = 0;
    }
    if (choices == 0 || tag.cleaned_s == view.tags[oldest[0]].cleaned_s) {
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
