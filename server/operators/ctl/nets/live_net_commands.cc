#include "server/operators/ctl/nets/live_net_commands.h"

#include <fmt/format.h>

#include <vector>

#include <boost/json/serialize.hpp>

#include "server/base/percent.h"
#include "server/operators/ctl/json_read.h"
#include "server/operators/ctl/table.h"
#include "server/operators/ctl/tags/tag_data.h"
#include "server/operators/ctl/units.h"

namespace pheromone::ctl {
namespace {

namespace json = boost::json;

std::string SourceText(const json::value& net) {
  return At(net, "source").is_null() ? "endless" : std::to_string(CountAt(net, "source"));
}

std::string AgoText(const json::value& net, std::string_view key) {
  return At(net, key).is_null() ? "never" : Duration(NumberAt(net, key)) + " ago";
}

// "15 (0a:0b)", or its number alone.
std::string RobotText(const json::value& value, const tags::SymbolTables& tables) {
  if (value.is_null()) {
    return "-";
  }
  const auto number = static_cast<int32_t>(value.to_number<double>());
  const std::string* const unique_id = tables.UniqueIdOf(number);
  return unique_id != nullptr ? fmt::format("{} ({})", number, *unique_id) : std::to_string(number);
}

std::string AckText(const json::value& ack, const tags::SymbolTables& tables) {
  return ack.is_null() ? "-"
                       : fmt::format("record {} of {} {}, amount {}", CountAt(ack, "seq"),
                                     RobotText(At(ack, "robot"), tables), TextAt(ack, "outcome"),
                                     CountAt(ack, "amount"));
}

void PrintTrail(const json::value& net, std::string_view trail) {
  const json::value& it = At(net, trail);
  fmt::print("trail {}: {:.3f}, last deposit {}\n", trail, NumberAt(it, "concentration"),
             AgoText(it, "since_deposit_s"));
}

void PrintMarking(const json::value& net) {
  std::string marking;
  if (const json::object* const places = At(net, "marking").if_object()) {
    for (const auto& place : *places) {
      const auto tokens = place.value().to_number<double>();
      marking += (marking.empty() ? "" : ", ") + std::string(place.key());
      marking += tokens > 1 ? fmt::format(" {}", tokens) : "";
    }
  }
  fmt::print("marking: {}\n", marking);
}

}  // namespace

int ListNets(const ServerOptions& options) {
  const JsonReply reply = CallJson(options, "GET", "/api/v1/nets");
  if (IsDone(options, reply)) {
    return reply.exit_status;
  }
  std::vector<std::vector<std::string>> rows{
      {"NET", "LAW", "ADVICE", "A", "B", "SOURCE", "DEPOSITS", "FIRINGS", "LAST", "EXCEPTIONS"}};
  for (const json::value& net : ItemsAt(reply.value, "nets")) {
    rows.push_back({TextAt(net, "name"), TextAt(net, "law"), TextAt(net, "advice"),
                    fmt::format("{:.3f}", NumberAt(At(net, "A"), "concentration")),
                    fmt::format("{:.3f}", NumberAt(At(net, "B"), "concentration")), SourceText(net),
                    std::to_string(CountAt(net, "deposits")),
                    std::to_string(CountAt(net, "firings")), AgoText(net, "since_firing_s"),
                    std::to_string(CountAt(net, "exceptions"))});
  }
  PrintTable(rows);
  return 0;
}

int ShowNet(const ServerOptions& options, const std::string& name) {
  const JsonReply reply = CallJson(options, "GET", "/api/v1/nets?net=" + PercentEncode(name));
  if (IsDone(options, reply)) {
    return reply.exit_status;
  }
  tags::SymbolTables tables;
  if (const int failed = FetchTables(options, &tables); failed != 0) {
    return failed;
  }
  const json::value& net = reply.value;
  fmt::print("{}: {}, {} places, {} transitions, read every {} ms\n", TextAt(net, "name"),
             TextAt(net, "net"), CountAt(net, "places"), CountAt(net, "transitions"),
             CountAt(net, "period_ms"));
  fmt::print("law {}, rate {:g}, dead band {:g}: advice {}\n", TextAt(net, "law"),
             NumberAt(net, "rate"), NumberAt(net, "dead_band"), TextAt(net, "advice"));
  PrintTrail(net, "A");
  PrintTrail(net, "B");
  fmt::print("source: {}; {} taken, {} deposited in {} deposits\n", SourceText(net),
             CountAt(net, "taken"), CountAt(net, "deposited"), CountAt(net, "deposits"));
  fmt::print("{} firings, the last one {}; {} records, {} exceptions\n", CountAt(net, "firings"),
             AgoText(net, "since_firing_s"), CountAt(net, "records"), CountAt(net, "exceptions"));
  if (CountAt(net, "restored") + CountAt(net, "blocked") != 0) {
    fmt::print("its blocks were replaced {} times by others, and {} times a full tag took none\n",
               CountAt(net, "restored"), CountAt(net, "blocked"));
  }
  PrintMarking(net);
  std::vector<std::vector<std::string>> rows{{"TAG", "WAITING", "GREEN", "LAST"}};
  for (const json::value& tag : ItemsAt(net, "tags")) {
    rows.push_back({TextAt(tag, "tag"), RobotText(At(tag, "waiting"), tables),
                    FlagAt(tag, "green") ? "yes" : "no", AckText(At(tag, "last"), tables)});
  }
  PrintTable(rows);
  for (const json::value& it : ItemsAt(net, "last_exceptions")) {
    fmt::print("exception {}: robot {} at tag {}: {}{}\n", AgoText(it, "ago_s"),
               RobotText(At(it, "robot"), tables), TextAt(it, "tag"),
               At(it, "action").is_null() ? "" : TextAt(it, "action") + ": ", TextAt(it, "why"));
  }
  return 0;
}

int ResetNet(const ServerOptions& options, const std::string& name) {
  const JsonReply reply =
      CallJson(options, "POST", "/api/v1/nets",
               json::serialize(json::object{{"action", "reset"}, {"net", name}}));
  if (reply.exit_status == 0 && options.json) {
    fmt::print("{}", reply.text);
  }
  return reply.exit_status;
}

}  // namespace pheromone::ctl
