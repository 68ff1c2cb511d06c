#include "server/petri/pnrd.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

namespace pheromone::petri {
namespace {

struct Step {
  std::string tag;
  uint32_t from;
  uint32_t to;
};

// Ferreira et al. 2018, Fig. 3: t1 to t15, between p1 to p14.
const std::vector<Step> kRobot = {
    {"N1", 1, 2},   {"P", 2, 3},     {"N5", 3, 4},   {"S1", 4, 5},   {"Src", 5, 6},
    {"S3", 6, 7},   {"N2", 7, 8},    {"P", 8, 9},    {"N4", 9, 1},   {"N6", 3, 10},
    {"S2", 10, 11}, {"Src", 11, 12}, {"S4", 12, 13}, {"N3", 13, 14}, {"P", 14, 9},
};
constexpr uint32_t kPlaces = 14;

Net Robot() {
  Net net{.name = "robot"};
  for (uint32_t place = 1; place <= kPlaces; ++place) {
    net.places.push_back({.id = "p" + std::to_string(place), .tokens = place == 1 ? 1u : 0u});
  }
  for (size_t i = 0; i < kRobot.size(); ++i) {
    net.transitions.push_back({.id = "t" + std::to_string(i + 1),
                               .takes = {{kRobot[i].from - 1}},
                               .gives = {{kRobot[i].to - 1}},
                               .tag = kRobot[i].tag});
  }
  return net;
}

std::map<std::string, std::vector<uint32_t>> CandidatesByTag() {
  std::map<std::string, std::vector<uint32_t>> candidates;
  for (uint32_t i = 0; i < kRobot.size(); ++i) {
    candidates[kRobot[i].tag].push_back(i);
  }
  return candidates;
}

Marking At(uint32_t place) {
  Marking marking = Marking::Zero(kPlaces);
  marking[place - 1] = 1;
  return marking;
}

TEST(Pnrd, EachTagInEachPlaceIsLegalOrAnException) {
  const IncidenceMatrix incidence = IncidenceOf(Robot());
  int legal = 0;
  int conflicts = 0;
  int exceptions = 0;
  for (const auto& [tag, candidates] : CandidatesByTag()) {
    for (uint32_t place = 1; place <= kPlaces; ++place) {
      const PnrdOutcome outcome =
          StepPnrd({incidence, At(place), candidates, {}}, PnrdRule::kOneToken);
      legal += outcome.kind == PnrdOutcome::Kind::kFired;
      conflicts += outcome.kind == PnrdOutcome::Kind::kConflict;
      exceptions += outcome.kind == PnrdOutcome::Kind::kException;
      if (outcome.kind == PnrdOutcome::Kind::kFired) {
        const Step& step = kRobot[outcome.accepted[0]];
        EXPECT_EQ(step.tag, tag);
        EXPECT_EQ(step.from, place);
        EXPECT_EQ(outcome.marking, At(step.to));
      } else {
        EXPECT_EQ(outcome.marking, At(place));
      }
    }
  }
  EXPECT_EQ(legal, 15);
  EXPECT_EQ(conflicts, 0);
  EXPECT_EQ(exceptions, 153);
}

TEST(Pnrd, ForOneTransitionTheUnitVectorIsTheSameAsBeingEnabled) {
  const Net net = Robot();
  const IncidenceMatrix incidence = IncidenceOf(net);
  for (uint32_t place = 1; place <= kPlaces; ++place) {
    for (uint32_t transition = 0; transition < kRobot.size(); ++transition) {
      for (const PnrdRule rule : {PnrdRule::kOneToken, PnrdRule::kSafePlaces}) {
        const PnrdOutcome outcome = StepPnrd({incidence, At(place), {transition}, {}}, rule);
        EXPECT_EQ(outcome.kind == PnrdOutcome::Kind::kFired, IsEnabled(net, transition, At(place)));
      }
    }
  }
}

// What the paper's test alone would let through: why u is one transition.
TEST(Pnrd, ForAnyFiringVectorTheUnitVectorAcceptsJumpsLoopsAndNothing) {
  const IncidenceMatrix incidence = IncidenceOf(Robot());
  int nothing = 0;
  int loops = 0;
  int jumps = 0;
  for (uint32_t bits = 0; bits < 1u << kRobot.size(); ++bits) {
    FiringVector firings(static_cast<Eigen::Index>(kRobot.size()));
    for (uint32_t i = 0; i < kRobot.size(); ++i) {
      firings[i] = static_cast<int32_t>(bits >> i & 1);
    }
    const Marking change = StateEquation(incidence, Marking::Zero(kPlaces), firings);
    for (uint32_t place = 1; place <= kPlaces; ++place) {
      if (!IsLegal(At(place) + change, PnrdRule::kOneToken)) {
        continue;
      }
      nothing += bits == 0;
      loops += bits != 0 && change.isZero();
      jumps += !change.isZero();
    }
  }
  EXPECT_EQ(nothing, 14);
  EXPECT_EQ(loops, 28);        // trail A or B all around, from each of 14 places
  EXPECT_EQ(jumps, 214 + 15);  // 15 are the legal steps
  EXPECT_EQ(nothing + loops + jumps - 15, 256);
}

TEST(Pnrd, ConditionsChooseAmongCandidates) {
  const IncidenceMatrix incidence = IncidenceOf(Robot());
  const PnrdState state{incidence, At(3), {9, 2}, {{2, 0}, {9, 1}}};
  const PnrdOutcome both = StepPnrd(state, PnrdRule::kOneToken, 0b11);
  EXPECT_EQ(both.kind, PnrdOutcome::Kind::kConflict);
  EXPECT_EQ(both.accepted, (std::vector<uint32_t>{2, 9}));
  EXPECT_EQ(both.marking, At(3));
  EXPECT_EQ(StepPnrd(state, PnrdRule::kOneToken, 0b01).marking, At(4));
  EXPECT_EQ(StepPnrd(state, PnrdRule::kOneToken, 0b10).marking, At(10));
  EXPECT_EQ(StepPnrd(state, PnrdRule::kOneToken, 0).kind, PnrdOutcome::Kind::kException);
}

TEST(Pnrd, SafePlacesAllowSeveralTokens) {
  const IncidenceMatrix incidence = IncidenceOf(Robot());
  const PnrdState two{incidence, At(1) + At(3), {0}, {}};
  EXPECT_EQ(StepPnrd(two, PnrdRule::kOneToken).kind, PnrdOutcome::Kind::kException);
  EXPECT_EQ(StepPnrd(two, PnrdRule::kSafePlaces).marking, At(2) + At(3));
  const PnrdState full{incidence, At(1) + At(2), {0}, {}};
  EXPECT_EQ(StepPnrd(full, PnrdRule::kSafePlaces).kind, PnrdOutcome::Kind::kException);
}

// Table 1: whichever side has what, the same step comes out.
TEST(Pnrd, AnySplitBetweenTagAndReaderIsTheSame) {
  const PnrdData all{.incidence = IncidenceOf(Robot()),
                     .marking = At(3),
                     .candidates = {{2, 9}},
                     .conditions = {{{2, 0}, {9, 1}}}};
  for (uint8_t on_tag = 0; on_tag < 16; ++on_tag) {
    PnrdData tag;
    PnrdData reader;
    const auto give = [on_tag](PnrdPart part, const auto& from, auto* tag_has, auto* reader_has) {
      *((on_tag & part) != 0 ? tag_has : reader_has) = from;
    };
    give(kPnrdIncidence, all.incidence, &tag.incidence, &reader.incidence);
    give(kPnrdMarking, all.marking, &tag.marking, &reader.marking);
    give(kPnrdCandidates, all.candidates, &tag.candidates, &reader.candidates);
    give(kPnrdConditions, all.conditions, &tag.conditions, &reader.conditions);
    EXPECT_EQ(tag.parts(), on_tag);
    EXPECT_EQ(reader.parts(), 15 - on_tag);
    const Result<PnrdState> state = MergePnrd(tag, reader);
    ASSERT_TRUE(state.ok()) << state.error();
    EXPECT_EQ(StepPnrd(state.value(), PnrdRule::kOneToken, 0b10).marking, At(10));
  }
}

TEST(MergePnrd, SaysWhichPartIsMissingOrGivenTwice) {
  const PnrdData net{.incidence = IncidenceOf(Robot()), .marking = At(1)};
  const PnrdData fires{.candidates = {{0}}};
  const auto error = [](const PnrdData& tag, const PnrdData& reader) {
    const Result<PnrdState> state = MergePnrd(tag, reader);
    return state.ok() ? "" : state.error();
  };
  EXPECT_EQ(error(fires, net), "");
  EXPECT_EQ(error({}, net),
            "candidate transitions neither on the tag nor on the reader, expected on one");
  EXPECT_EQ(error(net, net), "incidence matrix on both the tag and the reader, expected on one");
  EXPECT_EQ(error({.marking = At(1), .candidates = {{0}}}, net),
            "marking on both the tag and the reader, expected on one");
  EXPECT_EQ(error({.candidates = {{15}}}, net),
            "candidate transition number 15, expected less than 15");
  EXPECT_EQ(error({.candidates = {{0}}, .conditions = {{{1, 32}}}}, net),
            "condition bit 32 of transition number 1, expected a bit up to 31 and a transition "
            "less than 15");
  EXPECT_EQ(error(fires, {.incidence = IncidenceOf(Robot()), .marking = Marking::Zero(13)}),
            "a marking of 13 places, expected as many as the incidence matrix has: 14");
}

}  // namespace
}  // namespace pheromone::petri
