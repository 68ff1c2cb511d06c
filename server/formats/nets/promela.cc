#include "server/formats/nets/promela.h"

#include <map>

#include "server/base/message.h"

namespace pheromone::nets {
namespace {

using petri::Arc;
using petri::Net;
using petri::Transition;

std::string VariableOf(uint32_t place) {
  return "p" + std::to_string(place);
}

std::string Comment(const std::string& id) {
  std::string text = Quoted(id);
  for (size_t at = text.find("*/"); at != std::string::npos; at = text.find("*/")) {
    text.insert(at + 1, " ");
  }
  return "/* " + text + " */";
}

std::string GuardOf(const Transition& transition) {
  std::string guard;
  const auto add = [&](const Arc& arc, const char* comparison) {
    guard += (guard.empty() ? "" : " && ") + VariableOf(arc.place) + comparison +
             std::to_string(arc.weight);
  };
  for (const Arc& arc : transition.takes) {
    add(arc, " >= ");
  }
  for (const Arc& arc : transition.reads) {
    add(arc, " >= ");
  }
  for (const Arc& arc : transition.inhibitors) {
    add(arc, " < ");
  }
  return guard.empty() ? "true" : guard;
}

std::string EffectOf(const Transition& transition, const std::string& bound) {
  std::map<uint32_t, int64_t> changes;
  for (const Arc& arc : transition.takes) {
    changes[arc.place] -= arc.weight;
  }
  for (const Arc& arc : transition.gives) {
    changes[arc.place] += arc.weight;
  }
  std::string effect;
  for (const auto& [place, change] : changes) {
    const std::string variable = VariableOf(place);
    const std::string after =
        variable + (change < 0 ? " - " : " + ") + std::to_string(change < 0 ? -change : change);
    if (change > 0) {  // written so that it does not overflow
      effect += " assert(" + variable + " <= " + bound + " - " + std::to_string(change) + ");";
    }
    if (change != 0) {
      effect += " " + variable + " = " + after + ";";
    }
  }
  return effect.empty() ? " skip" : effect;
}

}  // namespace

Result<std::string> ToPromela(const Net& net, const PromelaOptions& options) {
  constexpr uint32_t kMaxByte = 255;
  constexpr uint32_t kMaxShort = 32'767;
  if (options.bound > petri::kMaxTokens) {
    return Error{"a bound of " + std::to_string(options.bound) + ", expected at most " +
                 std::to_string(petri::kMaxTokens)};
  }
  const std::string type = options.bound <= kMaxByte    ? "byte"
                           : options.bound <= kMaxShort ? "short"
                                                        : "int";
  const std::string bound = std::to_string(options.bound);
  std::string text = Comment(net.name) + "\n";
  for (uint32_t place = 0; place < net.places.size(); ++place) {
    const petri::Place& it = net.places[place];
    if (it.tokens > options.bound) {
      return Error{"place \"" + it.id + "\" has " + std::to_string(it.tokens) +
                   " tokens, expected at most the bound " + bound};
    }
    text += type + " " + VariableOf(place) + " = " + std::to_string(it.tokens) + ";  " +
            Comment(it.id) + "\n";
  }
  text += "\nactive proctype net() {\n  do\n";
  if (!options.assertion.empty()) {
    text += "  :: !(" + options.assertion + ") -> assert(false)\n";
  }
  for (const Transition& transition : net.transitions) {
    text += "  :: d_step { " + GuardOf(transition) + " ->" + EffectOf(transition, bound) + " }  " +
            Comment(transition.id) + "\n";
  }
  if (net.transitions.empty()) {
    text += "  :: false\n";
  }
  return text + "  od\n}\n";
}

}  // namespace pheromone::nets
