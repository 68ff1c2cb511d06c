#include "client_fw/experiments/channel/experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <random>

#include "client_fw/experiments/channel/delivery.h"
#include "client_fw/swarm/path_experiment.h"
#include "client_fw/swarm/simulation.h"
#include "protocol/signing.h"
#include "server/base/hash.h"

namespace pheromone::swarm {
namespace {

constexpr uint8_t kType = 2;
constexpr int64_t kSwitchedOnWithinMs = 1'000;

// The observation of one robot from outside.
class Watch {
 public:
  Watch(const ChannelExperiment& experiment, const sim::MobileRobot* robot)
      : robot_(robot),
        continuous_(experiment.period_ms == 0),
        record_({.period_ms = experiment.period_ms == 0 ? int64_t{1} : experiment.period_ms,
                 .deadline_ms = kDeadlineMs,
                 .from_ms = kWarmUpMs,
                 .to_ms = kWarmUpMs + experiment.duration_ms}) {}

  void Look(int64_t now_ms) {
    const client::Counters& counters = robot_->counters();
    if (counters.hello_answers != hello_answers_) {
      hello_answers_ = counters.hello_answers;
      StartClock(now_ms);
    } else if (hello_answers_ == 0 && now_ms == kWarmUpMs) {
      StartClock(now_ms);  // it should have found the server by now
    }
    if (now_ms == kWarmUpMs) {
      stops_before_ = counters.fail_safe_stops;
    }
    if (counters.requests != requests_) {
      requests_ = counters.requests;
      asked_ms_ = now_ms;
    }
    if (counters.answers != answers_) {
      if (answers_ == 0) {
        first_answer_ms_ = now_ms;
      }
      answers_ = counters.answers;
      record_.OnAnswer(now_ms);
      if (now_ms > kWarmUpMs) {
        intervals_ms_.push_back(now_ms - last_answer_ms_);
        pose_ages_ms_.push_back(now_ms - asked_ms_);
      }
      last_answer_ms_ = now_ms;
    }
  }

  RobotShare Finish() {
    record_.Finish();
    return {record_.due(), record_.delivered(), record_.answers(), record_.longest_gap_ms(),
            robot_->counters().fail_safe_stops - stops_before_};
  }

  /// -1 before there was one.
  int64_t first_answer_ms() const { return first_answer_ms_; }
  const std::vector<int64_t>& gaps_ms() const { return intervals_ms_; }
  const std::vector<int64_t>& pose_ages_ms() const { return pose_ages_ms_; }
  const std::vector<int64_t>& latencies_ms() const {
    return continuous_ ? intervals_ms_ : record_.latencies_ms();
  }

 private:
  void StartClock(int64_t now_ms) {
    if (!continuous_) {
      record_.StartClock(now_ms);
    }
  }

  const sim::MobileRobot* robot_;
  bool continuous_;
  DeliveryRecord record_;
  std::vector<int64_t> intervals_ms_;
  std::vector<int64_t> pose_ages_ms_;
  int64_t first_answer_ms_ = -1;
  int64_t asked_ms_ = 0;
  uint32_t requests_ = 0;
  uint32_t stops_before_ = 0;
  int64_t last_answer_ms_ = 0;
  uint32_t hello_answers_ = 0;
  uint32_t answers_ = 0;
};

// When a robot is out of reach: alternately in and out, for random times.
class Fades {
 public:
  explicit Fades(uint64_t seed) : random_(seed) {}

  bool At(int64_t time_ns) {
    while (time_ns >= until_ns_) {
      faded_ = !faded_;
      const double share = static_cast<double>(random_() >> 11) * 0x1p-53;
      // Logarithmically even between 0.2 and 2 s: 0.78 s in the mean. In reach for 9 times that.
      const double s = 0.2 * std::pow(10.0, share);
      until_ns_ += static_cast<int64_t>((faded_ ? s : 9 * s) * 1e9);
    }
    return faded_;
  }

 private:
  std::mt19937_64 random_;
  bool faded_ = true;
  int64_t until_ns_ = 0;
};

// The server is station 0, the robots follow.
std::function<double(int, int, int64_t)> PathError(const ChannelExperiment& experiment,
                                                   uint64_t seed) {
  const Air air = experiment.air;
  if (air.bad_robot == 0 && air.from_server == 0 && air.to_server == 0 && !air.fades) {
    return nullptr;
  }
  auto fades = std::make_shared<std::vector<Fades>>();
  for (int i = 0; i <= experiment.robots; ++i) {
    fades->emplace_back(seed * 1000 + static_cast<uint64_t>(i));
  }
  return [air, fades](int from, int to, int64_t time_ns) {
    const auto faded = [&](int robot) {
      return robot != 0 && (*fades)[static_cast<size_t>(robot)].At(time_ns);
    };
    if (air.fades && (faded(from) || faded(to))) {
      return 1.0;
    }
    double arrives = 1;
    arrives *= from == 1 || to == 1 ? 1 - air.bad_robot : 1;
    arrives *= from == 0 ? 1 - air.from_server : 1;
    arrives *= to == 0 ? 1 - air.to_server : 1;
    return 1 - arrives;
  };
}

ExchangeSize ExchangeOf(const ChannelExperiment& experiment) {
  const int added = experiment.is_signed ? protocol::kSignature : 0;
  return {kSenseExchange.request + added, kSenseExchange.answer + added};
}

// The share of exchanges of which both frames arrive, in the mean of the robots.
double WholeExchanges(const ChannelExperiment& experiment) {
  const Air& air = experiment.air;
  const auto frame = [&](int bytes, double besides) {
    // A burst may begin with each byte, or be in progress.
    const double begins = air.byte_error / (air.burst_bytes * (1 - air.byte_error));
    const double next = air.burst_bytes > 1 ? 1 - begins : 1 - air.byte_error;
    return (1 - air.byte_error) * std::pow(next, bytes - 1) * std::pow(1 - besides, bytes);
  };
  const ExchangeSize size = ExchangeOf(experiment);
  const double good = frame(size.request, air.to_server) * frame(size.answer, air.from_server) *
                      (air.fades ? 0.9 : 1.0);
  const double bad = good * std::pow(1 - air.bad_robot, size.request + size.answer);
  return (good * (experiment.robots - 1) + bad) / experiment.robots;
}

SimulationConfig SetUp(const ChannelExperiment& experiment, uint64_t seed) {
  std::mt19937_64 random(seed);
  SimulationConfig config;
  config.engine = EngineConfigOf(PathExperiment{});
  config.engine.links = {experiment.timing.Link("radio-a")};
  config.radio.baud = experiment.timing.baud;
  config.radio.turnaround_ns = experiment.timing.turnaround_ns;
  config.radio.carrier_detect = experiment.timing.carrier_detect;
  config.radio.byte_error = experiment.air.byte_error;
  config.radio.burst_bytes = experiment.air.burst_bytes;
  config.radio.path_error = PathError(experiment, seed);
  config.radio.block_loss = experiment.frame_loss;
  config.radio.seed = random();
  config.server.delay_ns = experiment.timing.server_delay_ns;
  config.server.adapter_ns = experiment.timing.adapter_ns;
  config.server.keyed = experiment.timing.keyed;
  config.server.lead_ns = experiment.timing.lead_ns;
  const auto first_id = static_cast<int>(random() % 100);
  std::mt19937_64 keys(~seed);  // another one, so that all else is as in a run without
  for (int i = 0; i < experiment.robots; ++i) {
    RobotConfig robot;
    robot.client.id = static_cast<uint8_t>(1 + first_id + i);
    robot.client.boot_counter = static_cast<uint16_t>(random());
    robot.client.type = kType;
    robot.client.speed_mm_s = 0;
    robot.client.period_ms = std::max<uint16_t>(1, experiment.period_ms);
    robot.client.fail_safe_ms = experiment.fail_safe_ms;
    robot.client.rounds = experiment.access == Access::kRounds && i >= experiment.simple;
    // Somewhere on the path from (1, 2) to (9, 6), facing anywhere.
    const double along = static_cast<double>(random() % 1000) / 1000;
    robot.start = {1 + 8 * along, 2 + 4 * along,
                   static_cast<double>(random() % 360) * std::numbers::pi / 180};
    const auto power_on_ms = static_cast<int64_t>(random() % kSwitchedOnWithinMs);
    robot.power_on_ms = experiment.together ? 0 : power_on_ms;
    config.robots.push_back(robot);
    if (experiment.is_signed) {
      signing::Key key{};
      std::generate(key.begin(), key.end(), [&] { return static_cast<uint8_t>(keys()); });
      config.keys.emplace(robot.client.id, key);
    }
  }
  for (int i = 0; i < experiment.hidden_pairs && 2 * i + 1 < experiment.robots; ++i) {
    config.hidden_pairs.emplace_back(2 * i, 2 * i + 1);
  }
  return config;
}

// The value below which `share` of the sorted values lie (nearest rank).
int64_t Quantile(const std::vector<int64_t>& sorted, double share) {
  if (sorted.empty()) {
    return 0;
  }
  const double rank = std::round(share * static_cast<double>(sorted.size() - 1));
  return sorted[static_cast<size_t>(rank)];
}

uint64_t HashOf(const ChannelRun& run, uint64_t state_hash) {
  uint64_t hash = state_hash;
  for (const RobotShare& share : run.robots) {
    for (const int64_t figure :
         {share.due, share.delivered, share.answers, share.longest_gap_ms, share.fail_safe_stops}) {
      hash = HashStep(hash, static_cast<uint64_t>(figure));
    }
  }
  for (const int64_t latency_ms : run.latencies_ms) {
    hash = HashStep(hash, static_cast<uint64_t>(latency_ms));
  }
  return HashStep(HashStep(hash, run.requests), run.collided_blocks);
}

}  // namespace

std::string NameOf(const Air& air) {
  std::string name;
  const auto add = [&name](double share, const char* what) {
    if (share > 0) {
      name += fmt::format("{}{:g} %{}", name.empty() ? "" : ", ", 100 * share, what);
    }
  };
  add(air.byte_error, "");
  if (air.burst_bytes > 1) {
    name += fmt::format(" in bursts of {:g}", air.burst_bytes);
  }
  add(air.bad_robot, " of one robot");
  add(air.from_server, " from the server");
  add(air.to_server, " to the server");
  add(air.fades ? 0.1 : 0, " of the time in fades");
  return name.empty() ? "-" : name;
}

ChannelRun MeasureChannel(const ChannelExperiment& experiment, uint64_t seed) {
  Simulation simulation(SetUp(experiment, seed));
  std::vector<Watch> watches;
  for (size_t i = 0; i < simulation.robot_count(); ++i) {
    watches.emplace_back(experiment, &simulation.robot(i));
  }
  const int64_t end_ms = kWarmUpMs + experiment.duration_ms;
  for (int64_t ms = 1; ms <= end_ms; ++ms) {
    simulation.RunTo(ms);
    for (Watch& watch : watches) {
      watch.Look(ms);
    }
  }
  ChannelRun run;
  for (size_t i = 0; i < watches.size(); ++i) {
    run.robots.push_back(watches[i].Finish());
    const auto append = [](const std::vector<int64_t>& from, std::vector<int64_t>* to) {
      to->insert(to->end(), from.begin(), from.end());
    };
    append(watches[i].latencies_ms(), &run.latencies_ms);
    append(watches[i].gaps_ms(), &run.gaps_ms);
    append(watches[i].pose_ages_ms(), &run.pose_ages_ms);
    const int64_t first_ms = watches[i].first_answer_ms();
    const bool all = first_ms >= 0 && run.time_to_order_ms >= 0;
    run.time_to_order_ms = all ? std::max(run.time_to_order_ms, first_ms) : -1;
    run.goodput += static_cast<double>(run.robots.back().answers) * 1000 /
                   static_cast<double>(experiment.duration_ms);
    run.requests += simulation.robot(i).counters().requests;
  }
  run.collided_blocks = simulation.medium().counters().collided_blocks;
  run.late_answers = simulation.server().counters().late_answers;
  if (experiment.is_signed) {
    const signing::SigningCounters& refused = simulation.signing().counters();
    run.refused = refused.unsigned_frames + refused.unknown_robots + refused.wrong_tags;
    for (size_t i = 0; i < simulation.robot_count(); ++i) {
      run.refused += simulation.robot(i).counters().forged;
    }
  }
  run.utilisation = simulation.medium().Utilisation();
  run.hash = HashOf(run, simulation.state_hash());
  return run;
}

ChannelSummary Summarise(const ChannelExperiment& experiment, const std::vector<ChannelRun>& runs) {
  ChannelSummary sum;
  sum.experiment = experiment;
  sum.seeds = static_cast<int>(runs.size());
  sum.peak = experiment.timing.PeakRate(ExchangeOf(experiment));
  sum.ideal = experiment.timing.IdealRate(ExchangeOf(experiment), experiment.robots);
  const double peak_s = 1 / sum.peak + static_cast<double>(experiment.timing.adapter_ns) * 1e-9;
  sum.lossy_bound = WholeExchanges(experiment) / peak_s;
  if (experiment.period_ms != 0) {
    const double in_reach = experiment.air.fades ? 0.9 : 1.0;
    sum.lossy_bound =
        std::min(sum.lossy_bound, in_reach * experiment.robots * 1000.0 / experiment.period_ms);
    sum.ideal = std::min(sum.ideal, experiment.robots * 1000.0 / experiment.period_ms);
  }
  sum.worst_goodput = sum.worst_delivered = sum.worst_robot_delivered = sum.worst_robot_share = 1e9;
  std::vector<int64_t> latencies_ms;
  double answers = 0;
  double requests = 0;
  for (const ChannelRun& run : runs) {
    int64_t run_due = 0;
    int64_t run_delivered = 0;
    int64_t run_answers = 0;
    int64_t least_answers = INT64_MAX;
    for (const RobotShare& robot : run.robots) {
      run_due += robot.due;
      run_delivered += robot.delivered;
      run_answers += robot.answers;
      least_answers = std::min(least_answers, robot.answers);
      sum.longest_gap_ms = std::max(sum.longest_gap_ms, robot.longest_gap_ms);
      sum.fail_safe_stops += robot.fail_safe_stops;
      sum.worst_robot_delivered = std::min(
          sum.worst_robot_delivered, static_cast<double>(robot.delivered) /
                                         static_cast<double>(std::max<int64_t>(1, robot.due)));
    }
    const double delivered =
        static_cast<double>(run_delivered) / static_cast<double>(std::max<int64_t>(1, run_due));
    sum.delivered += delivered / sum.seeds;
    sum.worst_delivered = std::min(sum.worst_delivered, delivered);
    sum.goodput += run.goodput / sum.seeds;
    sum.worst_goodput = std::min(sum.worst_goodput, run.goodput);
    sum.worst_robot_share =
        std::min(sum.worst_robot_share, static_cast<double>(least_answers) * experiment.robots /
                                            static_cast<double>(std::max<int64_t>(1, run_answers)));
    sum.utilisation += run.utilisation / sum.seeds;
    answers += run.goodput;
    requests += static_cast<double>(run.requests) * 1000 /
                static_cast<double>(experiment.duration_ms + kWarmUpMs);
    latencies_ms.insert(latencies_ms.end(), run.latencies_ms.begin(), run.latencies_ms.end());
    sum.pose_ages_ms.insert(sum.pose_ages_ms.end(), run.pose_ages_ms.begin(),
                            run.pose_ages_ms.end());
    sum.gaps_ms.insert(sum.gaps_ms.end(), run.gaps_ms.begin(), run.gaps_ms.end());
    const bool all = run.time_to_order_ms >= 0 && sum.time_to_order_ms >= 0;
    sum.time_to_order_ms = all ? std::max(sum.time_to_order_ms, run.time_to_order_ms) : -1;
    sum.hash = HashStep(sum.hash, run.hash);
  }
  sum.requests_per_answer = answers > 0 ? requests / answers : 0;
  std::sort(latencies_ms.begin(), latencies_ms.end());
  std::sort(sum.pose_ages_ms.begin(), sum.pose_ages_ms.end());
  std::sort(sum.gaps_ms.begin(), sum.gaps_ms.end());
  sum.pose_age_p50_ms = Quantile(sum.pose_ages_ms, 0.5);
  sum.p50_ms = Quantile(latencies_ms, 0.5);
  sum.p99_ms = Quantile(latencies_ms, 0.99);
  return sum;
}

}  // namespace pheromone::swarm
