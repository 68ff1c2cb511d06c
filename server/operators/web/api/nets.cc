#include "server/operators/web/api/nets.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "server/core/petri/evaporation.h"
#include "server/core/petri/live_net.h"
#include "server/operators/control/json_text.h"
#include "server/operators/control/views.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;
using control::NetView;

double FromMilli(int64_t milli) {
  return static_cast<double>(milli) / 1e3;
}

std::string_view AdviceText(petri::Advice advice) {
  return advice == petri::Advice::kA ? "01" : advice == petri::Advice::kB ? "10" : "00";
}

json::value SecondsSince(uint64_t then_ms, uint64_t now_ms) {
  return FromMilli(static_cast<int64_t>(now_ms - std::min(then_ms, now_ms)));
}

json::object TrailToJson(const NetView& view, const petri::Trail& trail) {
  const petri::Evaporation evaporation = view.net.rules().settings.evaporation();
  return {{"concentration", FromMilli(petri::ConcentrationAt(evaporation, trail, view.now_ms))},
          {"stored", FromMilli(trail.stored_milli)},
          {"since_deposit_s", trail.stored_milli != 0 ? SecondsSince(trail.since_ms, view.now_ms)
                                                      : json::value(nullptr)}};
}

json::object NetToJson(const NetView& view) {
  const petri::LiveNet& net = view.net;
  const petri::LiveSettings& settings = net.rules().settings;
  const petri::LiveCounts& counts = net.counts();
  return {{"name", settings.name},
          {"net", settings.net.name},
          {"places", settings.net.places.size()},
          {"transitions", settings.net.transitions.size()},
          {"robot_hash", settings.robot_hash},
          {"period_ms", settings.period_ms},
          {"law", petri::NameOf(settings.law)},
          {"rate", FromMilli(settings.rate_milli)},
          {"dead_band", FromMilli(settings.dead_band_milli)},
          {"advice", AdviceText(net.Advised())},
          {"A", TrailToJson(view, net.trails().a)},
          {"B", TrailToJson(view, net.trails().b)},
          {"source", settings.has_source ? json::value(net.source_left()) : json::value(nullptr)},
          {"firings", counts.firings},
          {"since_firing_s", counts.firings != 0 ? SecondsSince(net.last_firing_ms(), view.now_ms)
                                                 : json::value(nullptr)},
          {"records", counts.records},
          {"repeats", counts.repeats},
          {"exceptions", counts.exceptions},
          {"deposits", counts.deposits},
          {"deposited", counts.deposited},
          {"taken", counts.taken},
          {"restored", counts.restored},
          {"blocked", counts.blocked},
          {"robots", net.robots().size()}};
}

std::string_view OutcomeText(petri::LiveOutcome outcome) {
  return outcome == petri::LiveOutcome::kAccepted  ? "accepted"
         : outcome == petri::LiveOutcome::kRefused ? "refused"
                                                   : "none";
}

json::value AckToJson(const petri::LiveAck& ack) {
  return ack.robot == 0 ? json::value(nullptr)
                        : json::value(json::object{{"robot", ack.robot},
                                                   {"seq", ack.seq},
                                                   {"outcome", OutcomeText(ack.outcome)},
                                                   {"amount", ack.amount}});
}

json::array TagsToJson(const petri::LiveNet& net) {
  json::array tags;
  const petri::LiveSettings& settings = net.rules().settings;
  for (size_t i = 0; i < settings.tags.size(); ++i) {
    const petri::LiveTag& tag = settings.tags[i];
    const bool is_green = net.SignsAt(i).green;
    tags.push_back(json::object{
        {"tag", tag.tag},
        {"in_net", tag.in_net},
        {"fires", json::array(tag.candidates.begin(), tag.candidates.end())},
        {"waiting", net.tags()[i].waiting.robot != 0 ? json::value(net.tags()[i].waiting.robot)
                                                     : json::value(nullptr)},
        {"green", is_green},
        {"last", AckToJson(net.tags()[i].last)}});
  }
  return tags;
}

json::array ExceptionsToJson(const NetView& view) {
  json::array list;
  const petri::LiveSettings& settings = view.net.rules().settings;
  for (const petri::LiveException& it : view.net.exceptions()) {
    list.push_back(json::object{
        {"ago_s", SecondsSince(it.at_ms, view.now_ms)},
        {"tag", settings.tags[it.tag].tag},
        {"robot", it.robot},
        {"seq", it.seq},
        {"action", it.action != 0
                       ? json::value(petri::NameOf(static_cast<petri::LiveAction>(it.action)))
                       : json::value(nullptr)},
        {"why", petri::TextOf(it.why)}});
  }
  return list;
}

json::object WholeToJson(const NetView& view) {
  json::object net = NetToJson(view);
  json::object marking;  // of the places that have tokens
  const petri::LiveSettings& settings = view.net.rules().settings;
  for (size_t i = 0; i < settings.net.places.size(); ++i) {
    if (view.net.marking()[i] != 0) {
      marking[settings.net.places[i].id] = view.net.marking()[i];
    }
  }
  net["tags"] = TagsToJson(view.net);
  net["marking"] = std::move(marking);
  net["last_exceptions"] = ExceptionsToJson(view);
  return net;
}

}  // namespace

json::value NetsToJson(const std::vector<NetView>& nets) {
  json::array all;
  for (const NetView& net : nets) {
    all.push_back(WholeToJson(net));
  }
  return json::object{{"nets", std::move(all)}};
}

Response ReadNets(const control::Control& control, Parameters* fields) {
  const bool has_name = fields->Has("net");
  const auto name = has_name ? fields->String("net") : std::nullopt;
  fields->AllowOnly({"net"});
  const std::vector<NetView> nets = control.GetNets();
  const auto found = std::find_if(nets.begin(), nets.end(), [&](const NetView& it) {
    return it.net.rules().settings.name == name;
  });
  if (name && found == nets.end()) {
    fields->Expected("net", "the name of a net");
  }
  if (fields->problem()) {
    return Refuse(400, *fields->problem());
  }
  if (name) {
    return {.body = ToText(WholeToJson(*found))};
  }
  json::array all;
  for (const NetView& net : nets) {
    all.push_back(NetToJson(net));
  }
  return {.body = ToText(json::object{{"nets", std::move(all)}})};
}

void ChangeNets(control::Control* control, Parameters* fields, Respond respond) {
  engine::NetsChanged change;
  const auto action = fields->String("action");
  if (action && *action != "reset") {
    fields->Expected("action", "reset");
  }
  change.net = fields->String("net").value_or("");
  fields->AllowOnly({"action", "net"});
  if (Refused(*fields, respond)) {
    return;
  }
  control->ChangeNets(change, Report(std::move(respond)));
}

}  // namespace pheromone::web
