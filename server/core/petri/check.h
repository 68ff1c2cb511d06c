// What is true of a net: by its structure if that decides, and by all of its reachable markings.
//
//   const Result<CheckReport> report = Check(net, {});
//   if (report.value().deadlock_free.verdict == Verdict::kRefuted)
//     ... report.value().deadlock_free.trace ...
//
// Long for large nets; no other effect. `options.progress` is called meanwhile.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/base/result.h"
#include "server/core/petri/flows.h"
#include "server/core/petri/net.h"
#include "server/core/petri/property.h"
#include "server/core/petri/state_space.h"

namespace pheromone::petri {

enum class Verdict { kProved, kRefuted, kUnknown };

struct Finding {
  enum class Method {
    kStructural,  ///< by flows or arcs, for any initial marking that they allow
    kExhaustive,  ///< all reachable markings
    kReduced,     ///< all that reduction.h leaves
    kPartial,     ///< some: a refutation, or unknown
  };

  Verdict verdict = Verdict::kUnknown;
  Method method = Method::kPartial;
  std::string because{};  ///< such as an invariant; may be empty
  /// Of a refutation (of kReachable: of a proof): transitions from the initial marking on, and then
  /// `cycle` for ever.
  std::optional<std::vector<uint32_t>> trace{};
  std::vector<uint32_t> cycle{};
  bool is_shortest = true;  ///< the trace
};

struct CheckedClaim {
  Property property;
  Finding finding;
};

struct CheckOptions {
  SearchLimits limits{};
  bool reduce = false;     ///< fires eager transitions first: see reduction.h
  bool recurrence = true;  ///< asks for liveness and reversibility, too
  Progress progress{};
};

struct CheckReport {
  Explored explored{};  ///< without states if structure decided all
  size_t key_bytes = 0;
  std::vector<uint32_t> eager{};

  FlowBasis invariants{};
  Semiflows place_semiflows{};
  Semiflows transition_semiflows{};

  Finding bounded{};
  Finding safe{};                  ///< one token at most in each place
  std::vector<uint64_t> bounds{};  ///< by place; kNoBound: not known
  Finding deadlock_free{};
  Finding quasi_live{};  ///< each transition can be fired at least once
  Finding live{};        ///< and again, whatever happened
  Finding reversible{};
  std::vector<uint32_t> dead{};  ///< transitions that are never enabled, after a full search
  std::vector<uint32_t> not_live{};
  uint64_t components = 0;  ///< strongly connected ones, after a full search
  std::vector<CheckedClaim> claims{};
};

/// Errors: a net or claim that is not well formed, or one too large.
Result<CheckReport> Check(const Net& net, const CheckOptions& options);

}  // namespace pheromone::petri
