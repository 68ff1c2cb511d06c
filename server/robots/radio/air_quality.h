// How ROUNDs are best sent: plain, or coded so that they arrive although bytes are damaged
// (protocol/coded_frame.h).
//
//   air.Count(form, used, &robot);         // each turn of a robot that is there
//   const RoundForm form = air.Choose(robots);
//
// A robot that did not use its turn has not received the ROUND that granted it. An answer takes two
// ROUNDs, so a form is worth to a robot its rate times the square of the share that arrives there:
// somewhat more, as an answer may be said again, but an exponent of 1.5 chose no better.
// The form is chosen for which the product of this over all robots is greater (proportional
// fairness): one robot in bad air counts, but not more than all others. The other form is tried now
// and then where it may be better. No clock; not thread-safe.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace pheromone::radio {

enum class RoundForm : uint8_t { kPlain, kCoded };

/// The share of ROUNDs that a robot did not receive, by form. At first it counts as one that has
/// received some; what it uses and what not soon outweighs them.
struct Reception {
  static constexpr int kReceived = 3;

  std::array<double, 2> lost{};
  std::array<int, 2> turns{kReceived, kReceived};

  double LostOf(RoundForm form) const { return lost[static_cast<size_t>(form)]; }
};

class AirQuality {
 public:
  RoundForm form() const { return form_; }

  /// Whether `robot` used the turn that a ROUND of this form granted.
  void Count(RoundForm form, bool used, Reception* robot) {
    double& lost = robot->lost[static_cast<size_t>(form)];
    int& turns = robot->turns[static_cast<size_t>(form)];
    turns = std::min(turns + 1, kTurns);
    lost += ((used ? 0.0 : 1.0) - lost) / std::min(turns, form == form_ ? kTurns : kTrialTurns);
    if (form != form_ && !used) {
      trial_is_good_ = false;
    }
  }

  /// The form of the next ROUND. `for_each` calls its argument with the Reception of each robot.
  /// `may_try`: the other form may be tried by this ROUND.
  template <typename ForEach>
  RoundForm Choose(const ForEach& for_each, bool may_try = true) {
    double coding_is_better = 0;  // the logarithm of the ratio of the products
    double plain = 0;
    double hysteresis = 0;
    for_each([&](const Reception& robot) {
      const double arrives = Arrives(robot, RoundForm::kPlain);
      plain += arrives + kCost;
      coding_is_better += Arrives(robot, RoundForm::kCoded) - arrives - kCost;
      hysteresis += kHysteresis;
    });
    const RoundForm other = form_ == RoundForm::kPlain ? RoundForm::kCoded : RoundForm::kPlain;
    const double other_is_better =
        other == RoundForm::kCoded ? coding_is_better : -coding_is_better;
    ++since_change_;
    if (other_is_better > hysteresis) {
      // Trials can mislead; those that have done so lately become rarer.
      interval_ = since_change_ < 8 * interval_ ? std::min(2 * interval_, kRarest) : kTrialInterval;
      form_ = other;
      since_change_ = 0;
      rounds_ = 0;
      trial_is_good_ = false;
      return form_;
    }
    const bool may_be_better = form_ == RoundForm::kCoded || plain < 0;
    if (!may_try || ++rounds_ < (trial_is_good_ ? interval_ / 16 : interval_) || !may_be_better) {
      return form_;
    }
    // Not always after as many rounds, or it would be the turns of always the same robots.
    rounds_ = -(++trials_ % 4);
    trial_is_good_ = true;  // until one of its turns is not used
    return other;
  }

 private:
  static constexpr int kTrialInterval = 64;
  static constexpr int kRarest = 1024;
  static constexpr double kCost = 0.13;  // of coding: the logarithm of the rates' ratio
  static constexpr double kHysteresis = 0.03;
  // Over how many turns of a robot is averaged, about.
  static constexpr int kTurns = 32;
  static constexpr int kTrialTurns = 12;

  static double Arrives(const Reception& robot, RoundForm form) {
    return 2 * std::log(std::max(0.01, 1 - robot.LostOf(form)));
  }

  RoundForm form_ = RoundForm::kPlain;
  int interval_ = kTrialInterval;
  int since_change_ = kRarest;  // rounds
  int rounds_ = 0;              // since the last trial
  int trials_ = 0;
  bool trial_is_good_ = false;
};

}  // namespace pheromone::radio
