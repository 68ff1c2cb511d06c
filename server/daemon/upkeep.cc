#include "server/daemon/upkeep.h"

#include <malloc.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <utility>

#include "server/daemon/describe.h"
#include "server/daemon/service_manager.h"
#include "server/daemon/system_clock.h"

namespace pheromone::daemon {
namespace {

using std::chrono::milliseconds;

// The minimum interval between reports of the same problem.
constexpr milliseconds kBetweenReports{1000};
// The pause between two portions of released memory.
constexpr milliseconds kBetweenReleases{2};

size_t CountRobots(const engine::Engine& engine) {
  size_t count = 0;
  engine.robots().ForEach([&count](auto&&...) { ++count; });
  return count;
}

}  // namespace

void Upkeep::Stop() {
  is_stopped_ = true;
  second_.cancel();
  releaser_.cancel();
}

void Upkeep::BeReady() {
  told_ = DescribeState();
  service_manager::Ready(told_);
}

std::string Upkeep::DescribeState() const {
  const size_t robots =
      parts_.service->Inspect([](const engine::Engine& engine) { return CountRobots(engine); });
  return fmt::format("{} of {} links up, robots {}", parts_.links->CountUp(),
                     parts_.links->links().size(), robots);
}

void Upkeep::Start() {
  second_.expires_after(kBetweenReports);
  second_.async_wait([this](const boost::system::error_code& error) {
    if (error || is_stopped_) {
      return;
    }
    const uint64_t field_ms = parts_.service->Inspect(
        [this](const engine::Engine& /*engine*/) { return parts_.service->FieldTimeInside(); });
    parts_.journal->ReportStall();
    NoteClock(field_ms);
    parts_.control->SampleLinks();
    parts_.control->TellWhatChanged();
    ReportTrouble();
    ReportFieldTime(field_ms);
    ReleaseMemory();
    if (std::string state = DescribeState(); state != told_) {
      told_ = std::move(state);
      service_manager::Tell(told_);
    }
    Start();
  });
}

std::string Upkeep::Trouble() const {
  return DescribeTrouble(
      parts_.service->Inspect([](const engine::Engine& engine) { return engine.counters(); }));
}

// At most once for each second in which its count has increased.
void Upkeep::ReportTrouble() {
  for (const std::string& refusal : parts_.control->TellRefusals()) {
    spdlog::warn("{}", refusal);
  }
  std::string trouble = Trouble();
  if (trouble != trouble_) {
    trouble_ = std::move(trouble);
    spdlog::warn("so far: {}", trouble_);
  }
}

// Once, when it happens.
void Upkeep::ReportFieldTime(uint64_t field_ms) {
  const std::string trouble = TroubleWithFieldTime(field_ms);
  if (!trouble.empty() && !has_reported_field_time_) {
    spdlog::error("{}", trouble);
  }
  has_reported_field_time_ = !trouble.empty();
}

// What field time is by this machine's clock. One note waits at a time.
void Upkeep::NoteClock(uint64_t field_ms) {
  const int64_t utc_ms = ReadSystemClocks().utc_ms;
  if (!parts_.is_member || notes_clock_ ||
      parts_.journal->membership().IsClockNoted(field_ms, utc_ms)) {
    return;
  }
  notes_clock_ = true;
  const bool is_taken = parts_.operations->Add([this, field_ms, utc_ms] {
    parts_.journal->membership().NoteClock(field_ms, utc_ms);
    notes_clock_ = false;
  });
  if (!is_taken) {
    notes_clock_ = false;
  }
}

// In portions, and finally the unused memory of the heap.
void Upkeep::ReleaseMemory() {
  if (is_releasing_) {
    return;
  }
  is_releasing_ = parts_.service->ReleaseMemory();
  if (is_releasing_) {
    ReleaseMore();
  }
}

void Upkeep::ReleaseMore() {
  releaser_.expires_after(kBetweenReleases);
  releaser_.async_wait([this](const boost::system::error_code& error) {
    if (error || is_stopped_) {
      return;
    }
    if (parts_.service->ReleaseMemory()) {
      ReleaseMore();
    } else {
      is_releasing_ = false;
      (void)parts_.operations->Add([] { malloc_trim(0); });  // if there is no room, the next time
    }
  });
}

void Upkeep::Summarise() const {
  for (const std::string& line : DescribeCounters(parts_.service->counters())) {
    spdlog::info("{}", line);
  }
  if (const std::string trouble = Trouble(); !trouble.empty()) {
    spdlog::info("{}", trouble);
  }
  parts_.links->Summarise();
  const auto [robots, time_ms] = parts_.service->Inspect([](const engine::Engine& engine) {
    return std::pair(CountRobots(engine), engine.field_time_ms());
  });
  spdlog::info("robots {}, last change at field time {} ms, state hash {:016x}", robots, time_ms,
               parts_.service->StateHash());
  spdlog::info("stopped");
}

}  // namespace pheromone::daemon
