// Place/transition nets with weights, read arcs and inhibitor arcs.
//
//   Net net{.name = "mutex",
//           .places = {{.id = "free", .tokens = 1}, {.id = "idle", .tokens = 2}, {.id = "busy"}},
//           .transitions = {{.id = "enter", .takes = {{0}, {1}}, .gives = {{2}}}}};
//   Marking marking = InitialMarking(net);
//   if (IsEnabled(net, 0, marking)) marking = Fire(net, 0, marking);
//
// A marking has a number of tokens for each place. Places and transitions are numbered from 0 in
// the order of the net. Plain values; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "server/base/result.h"

namespace pheromone::petri {

/// What an arc joins a transition to.
struct Arc {
  uint32_t place = 0;
  uint32_t weight = 1;

  bool operator==(const Arc&) const = default;
};

struct Place {
  std::string id;       ///< unique among places and transitions
  std::string name{};   ///< for people; may be empty
  uint32_t tokens = 0;  ///< initially
  std::string box{};    ///< a pseudo-box (Ferreira et al. 2018, section 4.1): its message's name
  std::string owner{};  ///< who fires what it feeds, such as "robot"; may be empty
  std::string tag{};    ///< where it is stored; may be empty
  std::string does{};   ///< what a robot does while it is marked; may be empty

  bool operator==(const Place&) const = default;
};

/// Enabled if all takes and reads have their tokens and no inhibitor has as many as its weight.
/// Each list names a place once at most.
struct Transition {
  std::string id;
  std::string name{};
  std::vector<Arc> takes{};
  std::vector<Arc> gives{};
  std::vector<Arc> reads{};
  std::vector<Arc> inhibitors{};
  std::string owner{};
  std::string tag{};
  std::string does{};  ///< what firing it does beside moving tokens; may be empty

  bool operator==(const Transition&) const = default;
};

/// What is claimed of a net: see property.h.
struct Claim {
  std::string id;
  std::string text;

  bool operator==(const Claim&) const = default;
};

struct Net {
  std::string name;
  std::vector<Place> places{};
  std::vector<Transition> transitions{};
  std::vector<Claim> claims{};

  bool operator==(const Net&) const = default;
};

/// Tokens by place.
using Marking = Eigen::Matrix<int32_t, Eigen::Dynamic, 1>;
/// Firings by transition: the trigger vector u of Ferreira et al. 2018, eq. (1).
using FiringVector = Eigen::Matrix<int32_t, Eigen::Dynamic, 1>;
/// Transitions x places: A of Ferreira et al. 2018, eq. (1).
using IncidenceMatrix = Eigen::Matrix<int32_t, Eigen::Dynamic, Eigen::Dynamic>;

inline constexpr uint32_t kMaxTokens = 1'000'000'000;
inline constexpr size_t kMaxNodes = 1'000'000;  ///< places, and transitions, of a net

/// What is wrong with the net: empty or repeated IDs, arcs to places that do not exist or named
/// twice in a list, weights of 0, tokens or weights above kMaxTokens.
Status CheckNet(const Net& net);

/// The place or transition of that ID; the number of them if there is none.
size_t PlaceOf(const Net& net, std::string_view id);
size_t TransitionOf(const Net& net, std::string_view id);

Marking InitialMarking(const Net& net);

/// What a transition gives less what it takes. Read and inhibitor arcs are not in it, nor is what a
/// transition both takes and gives.
IncidenceMatrix IncidenceOf(const Net& net);

bool IsEnabled(const Net& net, size_t transition, const Marking& marking);

/// The marking after an enabled transition has fired; eq. (1) for a single transition.
Marking Fire(const Net& net, size_t transition, const Marking& marking);

/// The state equation M' = M + A'u, Ferreira et al. 2018, eq. (1). Whether u can be fired in any
/// order is not asked.
Marking StateEquation(const IncidenceMatrix& incidence, const Marking& marking,
                      const FiringVector& firings);

}  // namespace pheromone::petri
