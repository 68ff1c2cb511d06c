#include "server/daemon/live_config.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "server/base/random.h"
#include "server/config/describe.h"
#include "server/robots/links/link_config.h"

namespace pheromone::daemon {
namespace {

// The first epoch of a new state: robots must send HELLO again. With a journal, a restart continues
// in the old epoch.
uint16_t RandomEpoch(uint16_t other_than) {
  uint16_t epoch = 0;
  do {
    epoch = static_cast<uint16_t>(Random64());
  } while (epoch == 0 || epoch == other_than);
  return epoch;
}

std::vector<std::string> RestartRequired(const config::Config& present,
                                         const config::Config& next) {
  std::vector<std::string> notes;
  std::vector<links::LinkConfig> links = next.links;
  bool has_other_limits = false;  // each link has those of [limits]
  for (size_t i = 0; i < std::min(links.size(), present.links.size()); ++i) {
    links::AdmissionOptions limited = links[i].admission;
    limited.per_client_per_s = present.links[i].admission.per_client_per_s;
    limited.per_link_per_s = present.links[i].admission.per_link_per_s;
    has_other_limits = has_other_limits || limited != links[i].admission;
    links[i].admission = limited;
  }
  if (links != present.links) {
    notes.emplace_back("changed links require a restart");
  }
  if (has_other_limits) {
    notes.emplace_back(
        "changed requests_per_client_s or requests_per_link_s of [limits] require a restart");
  }
  if (next.trackers != present.trackers || next.datum != present.datum) {
    notes.emplace_back("changed trackers, or their datum, require a restart");
  }
  if (next.journal != present.journal || next.capture != present.capture) {
    notes.emplace_back("changed [journal] or [capture] settings require a restart");
  }
  if (next.cluster != present.cluster) {
    notes.emplace_back("changed [cluster] settings require a restart");
  }
  config::WebSettings web = next.web;
  if (web.tls && present.web.tls) {
    web.tls = present.web.tls;  // another certificate does not
  }
  if (next.daemon != present.daemon || next.control != present.control || web != present.web) {
    notes.emplace_back("changed [daemon], [control] or [web] settings require a restart");
  }
  return notes;
}

}  // namespace

LiveConfig::LiveConfig(config::Config config, Reload reload, engine::Service* service,
                       Captures* captures)
    : reload_(std::move(reload)),
      service_(service),
      captures_(captures),
      config_(std::move(config)),
      engine_(std::exchange(config_.engine, {})) {}

Status LiveConfig::TakeAtStart(bool state_lost) {
  PHEROMONE_TRY_STATUS(Configure(engine_, state_lost));
  Tell(config_.warnings);
  return Ok();
}

Result<config::Config> LiveConfig::Load() const {
  Result<config::Config> loaded = reload_();
  if (!loaded.ok()) {
    spdlog::error("the configuration is unchanged:\n{}", loaded.error());
  }
  return loaded;
}

Result<std::vector<std::string>> LiveConfig::ReadAgain() {
  PHEROMONE_TRY(config::Config next, Load());
  std::vector<std::string> notes = RestartRequired(config_, next);
  for (const std::string& note : notes) {
    spdlog::warn("{}", note);
  }
  // Links are identified by their position among those at the start.
  next.engine.links = engine_->links;
  const engine::SharedConfig read(std::move(next.engine));
  const auto configured = Configure(read, false);
  if (!configured.ok()) {
    const bool is_other_map = read->field.map != engine_->field.map;
    const Error error{configured.error() +
                      (is_other_map
                           ? "; a running server keeps its map: restart it, with a journal after "
                             "pheromonectl journal resample"
                           : "")};
    spdlog::error("the configuration is unchanged: {}", error);
    return error;
  }
  TakeSecrets(next);
  {
    const std::lock_guard lock(mutex_);
    engine_ = read;
  }
  captures_->SetConfigText(next.text);
  Tell(next.warnings);
  if (!configured.value().all_laid) {
    notes.emplace_back(
        "not all paths and initial rasters are deposited: the log stopped accepting changes; the "
        "rest follows when it accepts them again");
    spdlog::warn("{}", notes.back());
  }
  spdlog::info("configuration reread");
  return notes;
}

Status LiveConfig::ReadSecretsAgain() {
  PHEROMONE_TRY(const config::Config loaded, Load());
  TakeSecrets(loaded);
  return Ok();
}

void LiveConfig::TakeSecrets(const config::Config& read) {
  const std::lock_guard lock(mutex_);
  if (read.web.tls && config_.web.tls) {
    config_.web.tls = read.web.tls;
  }
  config_.keys = read.keys;
}

Status LiveConfig::ChangeTau(uint8_t type, int64_t tau_ms) {
  engine::EngineConfig next = *InEffect();
  auto& laws = next.field.pheromones;
  const auto law =
      std::find_if(laws.begin(), laws.end(), [type](const auto& it) { return it.type == type; });
  if (law == laws.end() || law->is_blend()) {
    return Error{"only a pheromone that is no blend evaporates"};
  }
  if (law->diffusion.exchange_q16 != 0) {
    return Error{"pheromone " + law->name +
                 " diffuses in steps: change its evaporation in the configuration, and reload"};
  }
  const int64_t least_ms = law->evaporation == field::Evaporation::kCounter ? 0 : 1;
  if (tau_ms < least_ms || tau_ms > field::kMaxTauMs) {
    return Error{"tau of pheromone " + law->name + ": expected " + std::to_string(least_ms) +
                 " to " + std::to_string(field::kMaxTauMs) + " ms"};
  }
  law->tau_ms = tau_ms;
  PHEROMONE_TRY_STATUS(Configure(next, false));
  spdlog::info("pheromone \"{}\": tau is {} s until the configuration is reread", law->name,
               static_cast<double>(tau_ms) / 1e3);
  return Ok();
}

config::Config LiveConfig::Get() const {
  const engine::SharedConfig in_effect = InEffect();
  const std::lock_guard lock(mutex_);
  config::Config config = config_;
  config.engine = *in_effect;
  return config;
}

// In a cluster, another server may have changed it.
engine::SharedConfig LiveConfig::InEffect() const {
  auto in_effect = service_->Inspect([](const engine::Engine& it) {
    return it.configured() ? std::optional(it.shared_config()) : std::nullopt;
  });
  const std::lock_guard lock(mutex_);
  return in_effect ? *in_effect : engine_;
}

Result<engine::Service::Configured> LiveConfig::Configure(const engine::SharedConfig& config,
                                                          bool state_lost) {
  const uint16_t epoch = service_->Inspect([](const auto& engine) { return engine.epoch(); });
  return service_->Configure(config, RandomEpoch(epoch), state_lost);
}

// The other warnings of --check are not logged at every start.
void LiveConfig::Tell(const std::vector<config::Warning>& warnings) const {
  for (const config::Warning& warning : warnings) {
    spdlog::log(warning.urgent ? spdlog::level::warn : spdlog::level::debug, "{}", warning.text);
  }
  for (const std::string& line : config::DescribeConfig(Get())) {
    spdlog::info("{}", line);
  }
}

}  // namespace pheromone::daemon
