#include "client_fw/swarm/capacity.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "client_fw/core/medium/medium_access.h"
#include "protocol/signing.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kStepMs = 50;
constexpr double kRoundsShare = 1.2;  // of PeakRate
// A request has a signature. A ROUND has one, and ten answers at most, so there are more of them:
// 13 robots at 9600 baud were answered 30 times a second, which makes it four bytes for an answer.
constexpr ExchangeSize kSignedExchange{kSenseExchange.request + protocol::kSignature,
                                       kSenseExchange.answer + 4};
constexpr double kGapShare = 0.9;  // of the fail-safe time; the rest is for lost frames

double MsToS(int64_t ms) {
  return static_cast<double>(ms) / 1000;
}

}  // namespace

int64_t LeastPeriodMs(const ChannelLoad& load) {
  if (load.access == LinkKind::kMediumAccess) {
    const double peak_rate =
        load.timing.PeakRate(load.is_signed ? kSignedExchange : kSenseExchange);
    return std::llround(load.robots * 1000 / (kRoundsShare * peak_rate));
  }
  client::MediumState medium{};  // of a robot that has heard all others
  medium.window_ms = load.window_ms;
  medium.slot_ms = load.slot_ms;
  for (int id = 1; id < load.robots; ++id) {
    medium.census.Hear(static_cast<uint8_t>(id));
  }
  return client::ContentionPeriodMs(medium, static_cast<uint32_t>(load.timing.baud));
}

int64_t FittingPeriodMs(const ChannelLoad& load) {
  return (LeastPeriodMs(load) + kStepMs - 1) / kStepMs * kStepMs;
}

bool Fits(const ChannelLoad& load) {
  return static_cast<double>(std::max(load.period_ms, LeastPeriodMs(load))) <=
         kGapShare * static_cast<double>(load.fail_safe_ms);
}

std::string WhyItDoesNotFit(const ChannelLoad& load) {
  if (Fits(load)) {
    return "";
  }
  const bool rounds = load.access == LinkKind::kMediumAccess;
  std::string text = fmt::format(
      "{} robots on a channel of {} baud{} are answered every {:.2f} s each, {}, but they stop if "
      "they are not answered for {:.2f} s (fail-safe).",
      load.robots, load.timing.baud,
      rounds ? "" : fmt::format(" with a response window of {} ms", load.window_ms),
      MsToS(LeastPeriodMs(load)), rounds ? "in rounds" : "by contention", MsToS(load.fail_safe_ms));
  std::vector<std::string> remedies;
  ChannelLoad better = load;
  better.access = LinkKind::kMediumAccess;
  if (!rounds && LeastPeriodMs(better) < LeastPeriodMs(load)) {
    remedies.push_back(fmt::format(
        "medium_access = true in the server's [[link]], and a restart (in rounds they are answered "
        "every {:.2f} s)",
        MsToS(LeastPeriodMs(better))));
  }
  int fitting = load.robots;
  for (better = load; fitting > 1 && !Fits(better);) {
    better.robots = --fitting;
  }
  if (Fits(better)) {
    remedies.push_back(fmt::format("{} such links ({} robots fit on one)",
                                   (load.robots + fitting - 1) / fitting, fitting));
  }
  if (const int64_t period_ms = FittingPeriodMs(load); period_ms <= kMaxPeriodMs) {
    remedies.push_back(fmt::format("a period of {:.2f} s with a fail-safe of {:.2f} s",
                                   MsToS(period_ms), MsToS(2 * period_ms)));
  }
  return text +
         (remedies.empty() ? "" : fmt::format(" What helps: {}.", fmt::join(remedies, "; or ")));
}

}  // namespace pheromone::swarm
