// What takes longest of conversation_test.cc's proofs.

#include <gtest/gtest.h>

#include "client_fw/verify/conversation_world.h"
#include "client_fw/verify/testing/proofs.h"

namespace pheromone::verify {
namespace {

TEST(TagNetwork, ThroughAWarmResetPowerLossAndACrash) {
  constexpr size_t kMaxStates = 2'000'000;
  ExpectProof(ExploreConversation(
      {.kind = ChangeKind::kWrite, .changes = 2, .warm_resets = 1, .power_losses = 1, .crashes = 1},
      kMaxStates));
}

}  // namespace
}  // namespace pheromone::verify
