// One step of a Petri net inserted in an RFID database: the net is split between a tag and its
// reader, and capturing the tag fires a transition.
//
//   // iPNRD, Ferreira et al. 2018, section 3: the robot has the net, the tag what it fires.
//   const PnrdData tag{.candidates = {{1, 7, 14}}};
//   const PnrdData robot{.incidence = IncidenceOf(net), .marking = InitialMarking(net)};
//   Result<PnrdState> state = MergePnrd(tag, robot);
//   const PnrdOutcome outcome = StepPnrd(state.value(), PnrdRule::kOneToken);
//   if (outcome.kind == PnrdOutcome::Kind::kFired) Store(outcome.marking);
//
// M' = M + A'u, eq. (1). The paper accepts M' if it is a "unitary vector": one place has the net's
// one token. Over all u of 0 and 1 that is too weak: of the robot's net of 15 transitions
// (Fig. 3) it lets through 256 firings of nothing, of loops and of several transitions at once,
// enabled or not. So u is always one transition here, chosen from the tag's candidates; for a net
// of one token the paper's test is then the same as being enabled. Nets with several tokens need 0
// or 1 token in each place before and after. What a transition both takes and gives is not in A,
// and is not tested.
//
// Pure functions; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/base/result.h"
#include "server/petri/net.h"

namespace pheromone::petri {

/// What a tag or a reader may store, as bits: Table 1, any split.
enum PnrdPart : uint8_t {
  kPnrdIncidence = 1,
  kPnrdMarking = 2,
  kPnrdCandidates = 4,
  kPnrdConditions = 8,
};

/// A condition that a transition needs, by number: the reader's antenna, a distance, an advice.
struct PnrdCondition {
  uint32_t transition = 0;
  uint32_t bit = 0;  ///< 0 to 31
};

/// The part of the data that one side has.
struct PnrdData {
  std::optional<IncidenceMatrix> incidence{};
  std::optional<Marking> marking{};
  std::optional<std::vector<uint32_t>> candidates{};       ///< transitions that the tag may fire
  std::optional<std::vector<PnrdCondition>> conditions{};  ///< of transitions; others need none

  uint8_t parts() const;  ///< PnrdPart bits
};

/// Both sides together.
struct PnrdState {
  IncidenceMatrix incidence{};
  Marking marking{};
  std::vector<uint32_t> candidates{};
  std::vector<PnrdCondition> conditions{};
};

/// Errors: a part that neither or both have (conditions may be missing), or sizes and numbers that
/// do not fit each other.
Result<PnrdState> MergePnrd(const PnrdData& tag, const PnrdData& reader);

enum class PnrdRule {
  kOneToken,   ///< M' has one token: elementary nets, as the paper says
  kSafePlaces  ///< M and M' have 0 or 1 token in each place
};

struct PnrdOutcome {
  enum class Kind {
    kFired,
    kException,  ///< no candidate is accepted: the process is not where the tag is
    kConflict    ///< several are: `accepted` has them, and a decision has to be made
  };

  Kind kind = Kind::kException;
  Marking marking{};                 ///< M', or M unless it has fired
  std::vector<uint32_t> accepted{};  ///< candidates, rising
};

/// `held` are the bits of the conditions that hold.
PnrdOutcome StepPnrd(const PnrdState& state, PnrdRule rule, uint32_t held = 0);

/// The test of M' alone.
bool IsLegal(const Marking& marking, PnrdRule rule);

}  // namespace pheromone::petri
