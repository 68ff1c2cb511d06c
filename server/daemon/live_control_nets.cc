// The requests about Petri nets.
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "server/daemon/live_control.h"
#include "server/operators/control/engine_views.h"

namespace pheromone::daemon {
namespace {

// "robot 15 (123-233-201) at tag P: store A: the net does not permit it"
std::string TextOf(const petri::LiveException& it, const petri::LiveRules& rules,
                   const tags::SymbolTables& symbols) {
  const std::string* const unique_id = symbols.UniqueIdOf(it.robot);
  std::string text = "robot " + std::to_string(it.robot);
  text += unique_id != nullptr ? " (" + *unique_id + ")" : "";
  text += " at tag " + rules.settings.tags[it.tag].tag + ": ";
  text += it.action != 0
              ? std::string(petri::NameOf(static_cast<petri::LiveAction>(it.action))) + ": "
              : "";
  return text + std::string(petri::TextOf(it.why));
}

}  // namespace

std::vector<control::NetView> LiveControl::GetNets() const {
  return parts_.service->Inspect(
      [this](const engine::Engine& engine) { return control::NetsOf(engine, parts_.now_ms()); });
}

void LiveControl::ChangeNets(const engine::NetsChanged& change, Done done) {
  if (!Forwards(change, done)) {
    Submit(change, done);
  }
}

std::vector<std::string> LiveControl::TellRefusals() {
  std::vector<std::pair<std::string, std::string>> refusals;  // net and words
  parts_.service->Inspect([&](const engine::Engine& engine) {
    const tags::SymbolTables& symbols = engine.tags().symbols();
    std::map<std::string, uint64_t> told;
    for (const auto& [name, it] : engine.nets().nets()) {
      const uint64_t count = it.net.counts().exceptions;
      const auto before = told_refusals_.find(name);
      const uint64_t known = before != told_refusals_.end() ? std::min(before->second, count)
                             : has_told_                    ? 0
                                                            : count;
      const std::vector<petri::LiveException>& list = it.net.exceptions();
      const uint64_t fresh = std::min<uint64_t>(count - known, list.size());
      for (uint64_t i = list.size() - fresh; i < list.size(); ++i) {
        refusals.emplace_back(name, TextOf(list[i], it.net.rules(), symbols));
      }
      if (count - known > fresh) {
        refusals.emplace_back(name, "and " + std::to_string(count - known - fresh) + " before");
      }
      told[name] = count;
    }
    told_refusals_ = std::move(told);
    has_told_ = true;
  });
  std::vector<std::string> words;
  for (const auto& [name, text] : refusals) {
    board_.Publish({control::Notice::Topic::kNet, false, name, text});
    words.push_back("net \"" + name + "\": refused: " + text);
  }
  return words;
}

}  // namespace pheromone::daemon
