#include "server/operators/ctl/nets/net_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/serialize.hpp>

#include "server/core/petri/structure.h"

namespace pheromone::ctl {
namespace {

namespace json = boost::json;

using petri::CheckReport;
using petri::Finding;
using petri::Net;
using petri::Verdict;

// Longer lists are in the JSON.
constexpr size_t kMaxFlowsShown = 30;
constexpr size_t kMaxStepsShown = 200;
constexpr size_t kMaxNamed = 3;  // in the summary
constexpr size_t kMaxLine = 100;
constexpr size_t kVerdictWidth = 9;

struct Named {
  std::string name;
  std::string text;
  const Finding* finding;
};

// What is asked of each net, and then its claims.
std::vector<Named> FindingsOf(const CheckReport& report) {
  std::vector<Named> all = {
      {"bounded", "no place gets more and more tokens", &report.bounded},
      {"safe", "at most one token in each place", &report.safe},
      {"deadlock-free", "some transition can always fire", &report.deadlock_free},
      {"quasi-live", "each transition can fire at least once", &report.quasi_live},
      {"live", "each transition can always fire again later", &report.live},
      {"reversible", "the initial marking can always be reached again", &report.reversible}};
  for (const petri::CheckedClaim& claim : report.claims) {
    all.push_back({claim.property.id, claim.property.text, &claim.finding});
  }
  return all;
}

const char* NameOf(Verdict verdict) {
  return verdict == Verdict::kProved    ? "proved"
         : verdict == Verdict::kRefuted ? "refuted"
                                        : "unknown";
}

const char* NameOf(Finding::Method method) {
  switch (method) {
    case Finding::Method::kStructural:
      return "structural";
    case Finding::Method::kExhaustive:
      return "exhaustive";
    case Finding::Method::kReduced:
      return "reduced";
    case Finding::Method::kPartial:
      break;
  }
  return "partial";
}

const char* MethodOf(const CheckReport& report) {
  return NameOf(report.explored.end != petri::Explored::End::kComplete ? Finding::Method::kPartial
                : report.eager.empty() ? Finding::Method::kExhaustive
                                       : Finding::Method::kReduced);
}

double BytesPerState(const CheckReport& report) {
  return static_cast<double>(report.explored.bytes) /
         static_cast<double>(std::max<uint64_t>(report.explored.states, 1));
}

std::string TextOfSteps(const Net& net, const std::vector<uint32_t>& steps) {
  std::string text;
  for (size_t i = 0; i < steps.size() && i < kMaxStepsShown; ++i) {
    text += (i == 0 ? "" : " ") + net.transitions[steps[i]].id;
  }
  return steps.size() > kMaxStepsShown
             ? fmt::format("{} ... ({} more)", text, steps.size() - kMaxStepsShown)
             : text;
}

std::string TextOfLength(const std::vector<uint32_t>& steps) {
  return fmt::format("{} step{}", steps.size(), steps.size() == 1 ? "" : "s");
}

std::string TextOfTrace(const Net& net, const Finding& finding) {
  if (!finding.trace) {
    return "";
  }
  std::string text = fmt::format(
      "    {} {}: {}\n", finding.is_shortest ? "shortest trace," : "trace,",
      TextOfLength(*finding.trace),
      finding.trace->empty() ? "the initial marking" : TextOfSteps(net, *finding.trace));
  if (!finding.cycle.empty()) {
    text += fmt::format("    then for ever: {}\n", TextOfSteps(net, finding.cycle));
  }
  return text;
}

std::string TextOfFlows(const Net& net, const petri::Semiflows& semiflows) {
  std::string text = fmt::format("{} minimal P-semiflows{}\n", semiflows.flows.size(),
                                 semiflows.complete ? "" : ", not all");
  for (size_t i = 0; i < semiflows.flows.size() && i < kMaxFlowsShown; ++i) {
    text += "  " + petri::TextOf(net, semiflows.flows[i]) + '\n';
  }
  if (semiflows.flows.size() > kMaxFlowsShown) {
    text += fmt::format("  ... ({} more: --json)\n", semiflows.flows.size() - kMaxFlowsShown);
  }
  return text;
}

// Breaks lines at spaces; what continues a line is indented further.
std::string Wrapped(const std::string& text) {
  std::string wrapped;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size());
    std::string line = text.substr(at, end - at);
    const size_t indent = line.starts_with(' ') ? line.find_first_not_of(' ') + 2 : kVerdictWidth;
    while (line.size() > kMaxLine) {
      const size_t space = line.rfind(' ', kMaxLine);
      const bool is_inside = space != std::string::npos && line.find_first_not_of(' ') < space;
      const size_t cut = is_inside ? space : line.find(' ', kMaxLine);
      if (cut == std::string::npos) {
        break;
      }
      wrapped += line.substr(0, cut) + '\n';
      line = std::string(indent, ' ') + line.substr(cut + 1);
    }
    wrapped += line + '\n';
    at = end + 1;
  }
  return wrapped;
}

std::string ListOf(const std::vector<std::string>& names) {
  std::string text;
  for (size_t i = 0; i < std::min(names.size(), kMaxNamed); ++i) {
    text += (i == 0 ? "" : ", ") + names[i];
  }
  return names.size() > kMaxNamed ? fmt::format("{} and {} more", text, names.size() - kMaxNamed)
                                  : text;
}

std::string SummaryOfClaims(const CheckReport& report) {
  std::vector<std::string> refuted;
  std::vector<std::string> unknown;
  for (const petri::CheckedClaim& claim : report.claims) {
    if (claim.finding.verdict != Verdict::kProved) {
      (claim.finding.verdict == Verdict::kRefuted ? refuted : unknown).push_back(claim.property.id);
    }
  }
  const size_t count = report.claims.size();
  if (count == 0) {
    return "no claims";
  }
  if (refuted.empty() && unknown.empty()) {
    return count == 1 ? "the claim proved" : fmt::format("all {} claims proved", count);
  }
  std::string text;
  for (const auto& [verdict, names] : {std::pair("refuted", &refuted), {"unknown", &unknown}}) {
    if (!names->empty()) {
      text += fmt::format("{}{} of {} claim{} {}: {}", text.empty() ? "" : "; ", names->size(),
                          count, count == 1 ? "" : "s", verdict, ListOf(*names));
    }
  }
  return text;
}

// Where a trace to a marking that is not safe puts more than one token.
std::string UnsafePlace(const Net& net, const std::vector<uint32_t>& trace) {
  std::vector<int64_t> tokens;
  for (const petri::Place& place : net.places) {
    tokens.push_back(place.tokens);
  }
  for (const uint32_t step : trace) {
    for (const petri::Arc& arc : net.transitions[step].takes) {
      tokens[arc.place] -= arc.weight;
    }
    for (const petri::Arc& arc : net.transitions[step].gives) {
      tokens[arc.place] += arc.weight;
    }
  }
  const auto most = std::max_element(tokens.begin(), tokens.end());
  return fmt::format("place {} can have {} tokens",
                     net.places[static_cast<size_t>(most - tokens.begin())].id, *most);
}

std::string WhyRefuted(const Net& net, const CheckReport& report, const Finding& finding) {
  if (&finding == &report.safe && finding.trace) {
    return ": " + UnsafePlace(net, *finding.trace);
  }
  if (&finding == &report.deadlock_free && finding.trace) {
    return ": stuck after " + TextOfLength(*finding.trace);
  }
  std::vector<std::string> names;
  for (const uint32_t transition : &finding == &report.quasi_live ? report.dead
                                   : &finding == &report.live     ? report.not_live
                                                                  : std::vector<uint32_t>()) {
    names.push_back(net.transitions[transition].id);
  }
  return names.empty() ? "" : ": " + ListOf(names);
}

json::array IdsOf(const Net& net, const std::vector<uint32_t>& transitions) {
  json::array ids;
  for (const uint32_t transition : transitions) {
    ids.emplace_back(net.transitions[transition].id);
  }
  return ids;
}

json::value ValueOf(Verdict verdict) {
  return verdict == Verdict::kUnknown ? json::value(nullptr)
                                      : json::value(verdict == Verdict::kProved);
}

json::object ObjectOf(const Net& net, const Named& named) {
  const Finding& finding = *named.finding;
  json::object object{{"id", named.name},
                      {"text", named.text},
                      {"verdict", NameOf(finding.verdict)},
                      {"method", NameOf(finding.method)},
                      {"because", finding.because}};
  if (finding.trace) {
    object["trace"] = IdsOf(net, *finding.trace);
    object["shortest"] = finding.is_shortest;
    if (!finding.cycle.empty()) {
      object["cycle"] = IdsOf(net, finding.cycle);
    }
  }
  return object;
}

json::array FlowsOf(const std::vector<petri::Flow>& flows, const auto& nodes) {
  json::array all;
  for (const petri::Flow& flow : flows) {
    json::object weights;
    for (const petri::FlowTerm& term : flow.terms) {
      weights[nodes[term.index].id] = term.weight;
    }
    all.emplace_back(std::move(weights));
  }
  return all;
}

}  // namespace

std::string TextOfReport(const Net& net, const CheckReport& report, double seconds) {
  const petri::Explored& explored = report.explored;
  std::string text = fmt::format(
      "{}: {} places, {} transitions\n{} states, {} edges; {}, {:.3g} s, {:.1f} bytes a state\n",
      net.name.empty() ? "net" : net.name, net.places.size(), net.transitions.size(),
      explored.states, explored.transitions, MethodOf(report), seconds, BytesPerState(report));
  if (!report.eager.empty()) {
    text += fmt::format("{} transitions fired as soon as they are enabled\n", report.eager.size());
  }
  for (const Named& named : FindingsOf(report)) {
    const Finding& finding = *named.finding;
    text += fmt::format("{:<8} {}{} ({}{})\n", NameOf(finding.verdict), named.name,
                        named.text.empty() ? "" : ": " + named.text, NameOf(finding.method),
                        finding.because.empty() ? "" : ": " + finding.because);
    text += TextOfTrace(net, finding);
    if (named.finding == &report.quasi_live && !report.dead.empty()) {
      text += fmt::format("    never enabled: {}\n", TextOfSteps(net, report.dead));
    }
  }
  text += fmt::format("{} independent P-invariants{}\n", report.invariants.flows.size(),
                      report.invariants.complete ? "" : " were not found: numbers too large");
  text += TextOfFlows(net, report.place_semiflows);
  return Wrapped(text + SummaryOf(net, report) + '\n');
}

std::string SummaryOf(const Net& net, const CheckReport& report) {
  std::vector<std::string> unknown;
  std::string proved;
  std::string refuted;
  for (const Named& named : FindingsOf(report)) {
    const Finding& finding = *named.finding;
    if (finding.verdict == Verdict::kUnknown) {
      unknown.push_back(named.name);
    } else if (finding.verdict == Verdict::kRefuted) {
      refuted += "; not " + named.name + WhyRefuted(net, report, finding);
    } else {
      proved += (proved.empty() ? "" : ", ") + named.name;
    }
    if (named.finding == &report.reversible) {
      break;  // what comes next are claims
    }
  }
  std::string text = SummaryOfClaims(report) + refuted;
  text += !refuted.empty() || proved.empty() ? "" : "; " + proved;
  for (size_t i = 0; i < unknown.size(); ++i) {
    text += (i == 0 ? "; unknown: " : ", ") + unknown[i];
  }
  return text;
}

std::string JsonOfReport(const Net& net, const CheckReport& report, double seconds) {
  json::array properties;
  for (const Named& named : FindingsOf(report)) {
    properties.emplace_back(ObjectOf(net, named));
  }
  json::object bounds;
  for (size_t place = 0; place < net.places.size(); ++place) {
    bounds[net.places[place].id] = report.bounds[place] == petri::kNoBound
                                       ? json::value(nullptr)
                                       : json::value(report.bounds[place]);
  }
  const json::object all{
      {"name", net.name},
      {"summary", SummaryOf(net, report)},
      {"net", json::object{{"places", net.places.size()}, {"transitions", net.transitions.size()}}},
      {"states", report.explored.states},
      {"transitions", report.explored.transitions},
      {"components", report.components},
      {"deadlock", report.deadlock_free.verdict == Verdict::kUnknown
                       ? json::value(nullptr)
                       : json::value(report.deadlock_free.verdict == Verdict::kRefuted)},
      {"safe", ValueOf(report.safe.verdict)},
      {"properties", std::move(properties)},
      {"bounds", std::move(bounds)},
      {"dead_transitions", IdsOf(net, report.dead)},
      {"transitions_not_live", IdsOf(net, report.not_live)},
      {"eager_transitions", IdsOf(net, report.eager)},
      {"independent_invariants", report.invariants.flows.size()},
      {"p_semiflows", FlowsOf(report.place_semiflows.flows, net.places)},
      {"t_semiflows", FlowsOf(report.transition_semiflows.flows, net.transitions)},
      {"p_semiflows_complete", report.place_semiflows.complete},
      {"t_semiflows_complete", report.transition_semiflows.complete},
      {"seconds", seconds},
      {"bytes_per_state", BytesPerState(report)},
      {"method", MethodOf(report)}};
  return json::serialize(all) + '\n';
}

const Finding* FindingNamed(const CheckReport& report, const std::string& name) {
  for (const Named& named : FindingsOf(report)) {
    if (named.name == name) {
      return named.finding;
    }
  }
  return nullptr;
}

bool AllProved(const CheckReport& report) {
  return std::all_of(report.claims.begin(), report.claims.end(),
                     [](const auto& claim) { return claim.finding.verdict == Verdict::kProved; });
}

}  // namespace pheromone::ctl
