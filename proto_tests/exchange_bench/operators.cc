#include "proto_tests/exchange_bench/operators.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>
#include <thread>
#include <utility>
#include <vector>

#include "proto_tests/exchange_bench/operator_stage.h"

namespace pheromone::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPause{100};  // between two of the same request
constexpr int kNodes = 3163;                      // along a side: 10^7 of them
constexpr int kTauS = 900'000;
constexpr double kCellM = kCellMm / 1000.0;

struct PointM {
  double x = 0;
  double y = 0;
};

std::string Stroke(const std::vector<PointM>& points, double radius_m) {
  std::string list;
  for (const PointM point : points) {
    list += fmt::format("{}[{:.3f}, {:.3f}]", list.empty() ? "" : ", ", point.x, point.y);
  }
  return fmt::format(R"({{"pheromone": "paint", "points_m": [{}], "radius_m": {:.3f}}})", list,
                     radius_m);
}

std::string Area(double side_m) {
  return fmt::format(R"({{"pheromone": "paint", "area_m": [0, 0, {0:.3f}, {0:.3f}]}})", side_m);
}

std::string All() {
  return R"({"pheromone": "paint", "all": true})";
}

std::string Ring(double side_m, int count, double radius_m) {
  std::vector<PointM> points;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / (count - 1);
    points.push_back({side_m / 2 * (1 + std::cos(angle)), side_m / 2 * (1 + std::sin(angle))});
  }
  return Stroke(points, radius_m);
}

// To and fro across a diagonal from (margin, margin), each stretch `width_m` long.
std::string Zigzag(double side_m, double width_m, double margin_m, double radius_m) {
  constexpr int kPoints = 1024;
  std::vector<PointM> points;
  const double offset = width_m / 2 / std::numbers::sqrt2;
  for (int i = 0; i < kPoints; ++i) {
    const double along = offset + (side_m - 2 * offset) * i / (kPoints - 1);
    const double across = i % 2 == 0 ? offset : -offset;
    points.push_back({margin_m + along + across, margin_m + along - across});
  }
  return Stroke(points, radius_m);
}

// There and back again over the whole map, a point every half a cell: as long as all paths together
// may be is a million cells, and a file may have a million points.
void WritePath(double side_m, const std::string& path) {
  constexpr int kPoints = 1'000'000;
  std::ofstream file(path);
  const int steps = static_cast<int>(side_m / (kCellM / 2));
  std::string text;
  for (int i = 0; i < kPoints; ++i) {
    const int row = i / steps;
    const int step = row % 2 == 0 ? i % steps : steps - 1 - i % steps;
    text += fmt::format("{:.2f},{:.2f}\n", step * kCellM / 2, row * kCellM);
  }
  file << text;
}

// Several who look at the largest picture that is permitted, together ten times a second.
class Viewers {
 public:
  explicit Viewers(const OperatorStage& stage) {
    constexpr int kViewers = 10;
    for (int i = 0; i < kViewers; ++i) {
      threads_.emplace_back([this, &stage, i] { Look(stage, i); });
    }
  }
  Viewers(const Viewers&) = delete;
  Viewers& operator=(const Viewers&) = delete;
  ~Viewers() { End(); }

  /// What became of them.
  std::string End() {
    stopping_ = true;
    for (std::thread& thread : threads_) {
      thread.join();
    }
    threads_.clear();
    return fmt::format("{} whole pictures and {} failures", pictures_.load(), failures_.load());
  }
  std::chrono::nanoseconds longest() const { return longest_.load(); }

 private:
  // 2000 x 2000 nodes: as many cells as a picture may have.
  void Look(const OperatorStage& stage, int which) {
    const double side_m = std::min(stage.side_m(), 1999 * kCellM);
    const std::string target = fmt::format(
        "/api/v1/field?pheromone=3&format=png&nodes_per_cell=1&area_m=0,0,{0:.3f},{0:.3f}", side_m);
    std::this_thread::sleep_for(which * kPause);
    for (auto next = Clock::now(); !stopping_; next += std::chrono::seconds(1)) {
      const HttpAnswer answer = stage.Get(target);
      ++(answer.status == 200 ? pictures_ : failures_);
      std::chrono::nanoseconds longest = longest_;
      while (answer.time > longest && !longest_.compare_exchange_weak(longest, answer.time)) {
      }
      while (!stopping_ && Clock::now() < next + std::chrono::seconds(1)) {
        std::this_thread::sleep_for(kPause / 10);
      }
    }
  }

  std::atomic<bool> stopping_ = false;
  std::atomic<int> pictures_ = 0;
  std::atomic<int> failures_ = 0;
  std::atomic<std::chrono::nanoseconds> longest_{};
  std::vector<std::thread> threads_;
};

class OperatorRows {
 public:
  OperatorRows(const OperatorOptions& options, OperatorStage* stage, Report* report)
      : options_(options), stage_(*stage), report_(report) {}

  void Edits();
  void Reloads();
  void Pictures();
  void Snapshots(const std::string& where);
  void Captures(const std::string& where);
  void Tau(const std::string& where);
  void EraseAll(const std::string& where);

 private:
  using Make = std::function<HttpAnswer(int time)>;

  void Row(const std::string& name, const Make& make, bool once = false);
  void Paint(const std::string& name, const std::string& body) {
    Row(name, [&](int) { return stage_.Post("/api/v1/paint", body); });
  }
  void Add(const std::string& name, std::vector<SteadyResult> alone,
           std::vector<SteadyResult> beside, const std::string& outcome,
           std::chrono::nanoseconds time);
  bool Settle();

  const OperatorOptions& options_;
  OperatorStage& stage_;
  Report* report_;
};

// Why a request was not done.
std::string Problem(const HttpAnswer& answer) {
  // {"error": {"what": ..., "where": ..., "expected": ...}}
  constexpr std::string_view kWhat = "\"what\":\"";
  const size_t what = answer.body.find(kWhat);
  if (what == std::string::npos) {
    return answer.body;
  }
  const size_t begin = what + kWhat.size();
  return "refused: " + answer.body.substr(begin, answer.body.find('"', begin) - begin);
}

// What became of requests that were made again and again, in words.
class Outcome {
 public:
  void Count(const HttpAnswer& answer) {
    longest_ = std::max(longest_, answer.time);
    if (answer.status == 200) {
      ++done_;
    } else {
      ++not_done_;
      problem_ = Problem(answer);
    }
  }

  std::chrono::nanoseconds longest() const { return longest_; }
  std::string Words() const {
    std::string words = done_ > 0 ? fmt::format("done {} times", done_) : "";
    if (not_done_ > 0) {
      words += fmt::format("{}{} times {}", done_ > 0 ? ", " : "", not_done_, problem_);
    }
    return words;
  }

 private:
  int done_ = 0;
  int not_done_ = 0;
  std::string problem_;
  std::chrono::nanoseconds longest_{};
};

// False if the server is stuck.
bool OperatorRows::Settle() {
  return stage_.robots().AwaitAnswers(options_.patience);
}

// The request is made again and again, or `once`, for as long as the robots were alone. What it
// begins and does not wait for is in that time too.
void OperatorRows::Row(const std::string& name, const Make& make, bool once) {
  const auto length =
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options_.seconds));
  if (!Settle()) {
    stage_.Restart();
    Settle();
  }
  stage_.robots().Take();
  std::this_thread::sleep_for(length);
  std::vector<SteadyResult> alone = stage_.robots().Take();
  stage_.watchdog().TakeLongest();
  const auto begin = Clock::now();
  Outcome outcome;
  bool finished = true;
  int times = 0;
  do {
    const HttpAnswer answer = make(times);
    outcome.Count(answer);
    finished = answer.status != 0;
    ++times;
    std::this_thread::sleep_for(kPause);
  } while (!once && finished && Clock::now() < begin + length);
  if (finished) {
    std::this_thread::sleep_until(begin + length);
    Settle();
  }
  Add(name, std::move(alone), stage_.robots().Take(), outcome.Words(), outcome.longest());
  if (!finished) {
    stage_.Restart();
  }
}

void OperatorRows::Add(const std::string& name, std::vector<SteadyResult> alone,
                       std::vector<SteadyResult> beside, const std::string& outcome,
                       std::chrono::nanoseconds time) {
  const std::chrono::milliseconds unfed = stage_.watchdog().TakeLongest();
  Report::Say(fmt::format("operator {}: {}; longest {:.1f} ms; {} ms between two signs of life",
                          name, outcome, std::chrono::duration<double, std::milli>(time).count(),
                          unfed.count()));
  for (size_t i = 0; i < beside.size(); ++i) {
    SteadyResult& robot = beside[i];
    BesideRow row{
        {"durable", robot.robot + " beside: " + name, 1},
        std::move(alone[i].times),
        robot.stops,
        robot.refused == 0 ? outcome : fmt::format("{}; {} ERRORs", outcome, robot.refused),
        time,
        unfed};
    row.row.right = robot.right;
    row.row.wrong = robot.wrong;
    row.row.lost = robot.lost;
    row.row.late = robot.late;
    row.row.times = std::move(robot.times);
    report_->Add(std::move(row));
  }
}

// The widths are such that what may be touched is: 2^20 nodes, in a box of 2^22.
void OperatorRows::Edits() {
  constexpr double kBoxM = 2000 * kCellM;
  const double side_m = stage_.side_m();
  Paint("line across the map", Stroke({{0, 0}, {side_m, side_m}}, 0.05));
  Paint("line across the map, 4.4 m wide", Stroke({{0, 0}, {side_m, side_m}}, 2.2));
  Paint("line across 40 m, 6.6 m wide", Stroke({{3.3, 3.3}, {kBoxM - 3.3, kBoxM - 3.3}}, 3.3));
  Paint("area of 2^20 nodes", Area(1023 * kCellM));
  Paint("area of the whole map", Area(side_m));
  Paint("the whole map", All());
  Paint("ring of 300 points, 20 m wide", Ring(20, 300, 0.05));
  Paint("ring of 1000 points, 40 m wide", Ring(kBoxM, 1000, 0.05));
  Paint("zigzag of 1024 points", Zigzag(kBoxM, 400 * kCellM, 0, 0.02));
  Paint("zigzag of 1024 points, radius 4 m", Zigzag(600 * kCellM, 600 * kCellM, 4, 4));
}

void OperatorRows::Reloads() {
  const std::string folder = stage_.folder();
  const auto reload = [this](const std::string& name, const std::string& more) {
    Row(name, [&](int time) { return stage_.Reload(kTauS, time % 2 == 0 ? more : ""); });
    stage_.Reload(kTauS);
  };
  const auto import = [](const std::string& file) {
    return fmt::format("[[print]]\npheromone = \"paint\"\nfile = \"{}\"\n", file);
  };
  WriteWhitePicture(1980, folder + "/import.pgm");
  reload("import of 1980 x 1980 nodes", import("import.pgm"));
  WriteWhitePicture(kNodes, folder + "/import.pgm");
  reload("import of the whole map", import("import.pgm"));
  WritePath(stage_.side_m(), folder + "/path.csv");
  reload("reload with a path of 10^6 points",
         "[[path]]\npheromone = \"paint\"\nfile = \"path.csv\"\n");
}

void OperatorRows::Pictures() {
  Row(
      "10 largest pictures a second",
      [&](int) {
        Viewers viewers(stage_);
        std::this_thread::sleep_for(std::chrono::duration<double>(options_.seconds));
        HttpAnswer answer{200, ""};
        Report::Say(viewers.End());
        answer.time = viewers.longest();
        return answer;
      },
      true);
}

void OperatorRows::Snapshots(const std::string& where) {
  Row("snapshot" + where, [&](int) { return stage_.Post("/api/v1/snapshot", "{}"); });
}

void OperatorRows::Captures(const std::string& where) {
  Row("start of a recording" + where, [&](int time) {
    return stage_.Post("/api/v1/capture",
                       time % 2 == 0 ? R"({"action": "start"})" : R"({"action": "stop"})");
  });
  stage_.Post("/api/v1/capture", R"({"action": "stop"})");
}

void OperatorRows::Tau(const std::string& where) {
  Row("reload with another tau" + where,
      [&](int time) { return stage_.Reload(kTauS + 1 + time % 2); });
}

void OperatorRows::EraseAll(const std::string& where) {
  Row(
      "erase-all" + where, [&](int) { return stage_.Post("/api/v1/erase", All()); }, true);
}

}  // namespace

void RunOperators(const OperatorOptions& options, Report* report) {
  {
    OperatorStage stage(options, kNodes);
    stage.Restart();
    OperatorRows rows(options, &stage, report);
    rows.Edits();
    rows.Reloads();
    const auto fill = [&] {
      const int parts = stage.Fill();
      Report::Say(fmt::format("operator painted the map in {} parts: {:.0f} MiB", parts,
                              stage.StatusNumber("used_bytes") / 1048576));
    };
    fill();
    rows.Pictures();
    rows.Snapshots(", 10^7 nodes");
    fill();
    rows.Captures(", 10^7 nodes");
    fill();
    rows.Tau(", 10^7 nodes");
    fill();
    rows.EraseAll(", 10^7 nodes");
  }
  OperatorStage stage(options, SideBeyond(options.field_mib));
  stage.Restart();
  OperatorRows rows(options, &stage, report);
  const auto fill = [&] {
    stage.Fill();
    Report::Say(fmt::format("operator painted the map to its limit: {:.0f} of {} MiB",
                            stage.StatusNumber("used_bytes") / 1048576, options.field_mib));
  };
  const std::string where = fmt::format(", {} MiB", options.field_mib);
  fill();
  rows.Snapshots(where);
  fill();
  rows.Captures(where);
  fill();
  rows.Tau(where);
  fill();
  rows.EraseAll(where);
}

}  // namespace pheromone::bench
