#include "server/operators/ctl/halt_commands.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include <boost/json/object.hpp>
#include <boost/json/serialize.hpp>

#include "server/operators/ctl/json_read.h"

namespace pheromone::ctl {
namespace {

namespace json = boost::json;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kStandPatience{5};
constexpr std::chrono::seconds kResumePatience{20};
// A robot stands if this many requests from it had the same pose, over at least this time.
constexpr uint64_t kSamePoses = 3;
constexpr std::chrono::milliseconds kSameFor{700};
constexpr useconds_t kBetweenGlancesUs = 150'000;

std::string NameOf(const json::value& client) {
  return fmt::format("robot {} on {}", CountAt(client, "id"), TextAt(client, "link"));
}

bool IsSilent(const json::value& client) {
  return TextAt(At(client, "state"), "is") == "silent";
}

// Whether each robot stands, looked at again and again.
class Watch {
 public:
  // What is not known to stand yet.
  std::vector<std::string> Look(const json::array& clients) {
    std::vector<std::string> open;
    for (const json::value& client : clients) {
      if (IsSilent(client)) {
        continue;
      }
      Seen& seen = robots_[NameOf(client)];
      const std::string pose = json::serialize(At(client, "pose"));
      const uint64_t requests = CountAt(client, "requests");
      if (pose != seen.pose) {
        seen = {pose, requests, Clock::now()};
      }
      if (requests < seen.requests + kSamePoses || Clock::now() < seen.since + kSameFor) {
        open.push_back(NameOf(client));
      }
    }
    return open;
  }

 private:
  struct Seen {
    std::string pose = {};
    uint64_t requests = 0;
    Clock::time_point since;
  };
  std::map<std::string, Seen> robots_;
};

int TellFailures(const std::vector<std::string>& failures) {
  for (const std::string& failure : failures) {
    fmt::print("  {}\n", failure);
  }
  return failures.empty() ? 0 : kFailed;
}

// Whether this server passes its halts on to a node.
bool IsPassedOnTo(const std::string& node, const json::value& cluster) {
  const json::array& peers = ItemsAt(cluster, "peers");
  return std::any_of(peers.begin(), peers.end(), [&](const json::value& peer) {
    return FlagAt(peer, "up") && TextAt(peer, "node") == node;
  });
}

// The node that sends on a link; if it is not known, those that may. None: nobody does, and it may
// be this server at any moment.
std::vector<std::string> SendersOf(const json::value& link, const json::value& cluster) {
  const std::string owner = TextAt(link, "owner");
  if (!owner.empty() && owner != TextAt(cluster, "node")) {
    return {owner};
  }
  std::vector<std::string> nodes;
  if (IsElsewhere(link)) {
    for (const json::value& node : ItemsAt(link, "nodes")) {
      nodes.emplace_back(TextOf(node));
    }
  }
  return nodes;
}

}  // namespace

HaltedLinks DescribeHaltedLinks(const json::value& answer, const json::value& cluster) {
  const size_t told = ItemsAt(answer, "links").size();
  size_t here = told;
  HaltedLinks links;
  for (const json::value& link : ItemsAt(answer, "down")) {
    const std::string name = TextAt(link, "name");
    const bool is_standby = TextAt(link, "role") == "standby";
    if (!is_standby && !IsElsewhere(link)) {
      ++here;
      links.all_told = false;
      links.text +=
          fmt::format("  {} is down: {}; its robots were not told\n", name, TextAt(link, "state"));
      continue;
    }
    const std::vector<std::string> senders = SendersOf(link, cluster);
    const bool is_passed_on =
        !senders.empty() && std::all_of(senders.begin(), senders.end(),
                                        [&](const auto& it) { return IsPassedOnTo(it, cluster); });
    links.all_told &= is_passed_on;
    links.text +=
        senders.empty()
            ? fmt::format("  {} is on standby, and no node sends there; its robots were not told\n",
                          name)
            : fmt::format("  {} is {} node {}, {}\n", name, is_standby ? "on standby for" : "at",
                          fmt::join(senders, " or "),
                          is_passed_on          ? "to which the halt was passed on"
                          : senders.size() == 1 ? "which is not connected; its robots were not told"
                                                : "not all of which are connected; its robots may "
                                                  "not have been told");
  }
  links.text =
      fmt::format("halt sent on {} of {} link{}\n", told, here, here == 1 ? "" : "s") + links.text;
  return links;
}

int HaltAll(const ServerOptions& options) {
  const JsonReply sent = CallJson(options, "POST", "/api/v1/halt");
  if (IsDone(options, sent)) {
    return sent.exit_status;
  }
  const Result<json::value> status = AskJson(options, "GET", "/api/v1/status");
  const HaltedLinks links =
      DescribeHaltedLinks(sent.value, At(status.ok() ? status.value() : json::value(), "cluster"));
  fmt::print("{}", links.text);
  std::fflush(stdout);
  Watch watch;
  const auto deadline = Clock::now() + kStandPatience;
  for (;; usleep(kBetweenGlancesUs)) {
    const JsonReply reply = CallJson(options, "GET", "/api/v1/clients");
    if (reply.exit_status != 0) {
      return reply.exit_status;
    }
    const json::array& clients = ItemsAt(reply.value, "clients");
    const std::vector<std::string> open = watch.Look(clients);
    if (!open.empty() && Clock::now() < deadline) {
      continue;
    }
    std::vector<std::string> failures;
    for (const std::string& robot : open) {
      failures.push_back(robot + " was not seen to stand");
    }
    for (const json::value& client : clients) {
      if (IsSilent(client)) {
        failures.push_back(SilenceOf(client));
      }
    }
    const size_t stand = clients.size() - failures.size();
    fmt::print("{} of {} robot{} stand{}\n", stand, clients.size(), clients.size() == 1 ? "" : "s",
               clients.size() == 1 ? "s" : "");
    return TellFailures(failures) != 0 || !links.all_told ? kFailed : 0;
  }
}

int ResumeAll(const ServerOptions& options) {
  const JsonReply before = CallJson(options, "GET", "/api/v1/clients");
  if (before.exit_status != 0) {
    return before.exit_status;
  }
  std::vector<std::string> failures;
  std::map<std::string, std::string> outcomes;
  for (const json::value& client : ItemsAt(before.value, "clients")) {
    if (IsSilent(client)) {
      failures.push_back(SilenceOf(client));
      continue;
    }
    const JsonReply sent = CallJson(
        options, "POST", "/api/v1/command",
        json::serialize(json::object{
            {"link", TextAt(client, "link")}, {"id", At(client, "id")}, {"command", "resume"}}));
    if (sent.exit_status != 0) {
      failures.push_back(NameOf(client) + " was not told");
    } else {
      outcomes[NameOf(client)] = "pending";
    }
  }
  const auto deadline = Clock::now() + kResumePatience;
  for (bool pending = !outcomes.empty(); pending && Clock::now() < deadline;
       usleep(kBetweenGlancesUs)) {
    const JsonReply reply = CallJson(options, "GET", "/api/v1/clients");
    if (reply.exit_status != 0) {
      return reply.exit_status;
    }
    pending = false;
    for (const json::value& client : ItemsAt(reply.value, "clients")) {
      const auto told = outcomes.find(NameOf(client));
      if (told == outcomes.end()) {
        continue;
      }
      const json::value& command = At(client, "last_command");
      const std::string reason = TextAt(command, "reason");
      told->second = TextAt(command, "outcome") + (reason.empty() ? "" : " (" + reason + ")");
      pending |= told->second == "pending";
    }
  }
  size_t resumed = 0;
  for (const auto& [robot, outcome] : outcomes) {
    if (outcome == "accepted") {
      ++resumed;
    } else {
      failures.push_back(robot + ": " + outcome);
    }
  }
  fmt::print("{} of {} robots resume\n", resumed, ItemsAt(before.value, "clients").size());
  return TellFailures(failures);
}

std::string SilenceOf(const json::value& client) {
  const json::value& silent_s = At(client, "silent_s");
  return NameOf(client) + (silent_s.is_null() ? " was not heard since the server started"
                                              : fmt::format(" has been silent for {:.0f} s",
                                                            NumberAt(client, "silent_s")));
}

std::string CountStates(const json::array& clients) {
  std::map<std::string, size_t> counts;
  for (const json::value& client : clients) {
    ++counts[TextAt(At(client, "state"), "is")];
  }
  std::vector<std::string> words;
  for (const auto& [state, count] : counts) {
    words.push_back(fmt::format("{} {}", count, state));
  }
  return fmt::format("{}{}{}", clients.size(), words.empty() ? "" : ": ", fmt::join(words, ", "));
}

std::string DescribeState(const json::value& client) {
  const json::value& state = At(client, "state");
  const std::string reason = TextAt(state, "reason");
  return TextAt(state, "is") + (reason.empty() ? "" : " (" + reason + ")");
}

}  // namespace pheromone::ctl
