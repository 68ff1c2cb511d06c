#include "server/operators/ctl/doctor/doctor.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <set>
#include <utility>

#include "server/base/descriptor.h"
#include "server/base/holders.h"
#include "server/operators/ctl/doctor/findings.h"
#include "server/operators/ctl/doctor/host_checks.h"
#include "server/operators/ctl/doctor/server_checks.h"
#include "server/operators/ctl/json_read.h"
#include "server/operators/ctl/server_socket.h"

namespace pheromone::ctl {
namespace {

constexpr const char* kServer = "server";

// The process at the other end of a socket; empty with `errno` if nobody listens.
std::optional<int> ProcessBehind(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, std::min(path.size(), sizeof address.sun_path - 1));
  const Descriptor handle(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  ucred peer{};
  socklen_t size = sizeof peer;
  if (!handle.valid() ||
      connect(handle.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      getsockopt(handle.get(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) {
    return std::nullopt;
  }
  return peer.pid;
}

void TellNoServer(const std::string& socket, int error, Findings* findings) {
  const std::string looked_at = "socket " + socket;
  if (error == EACCES) {
    findings->Fault(kServer, looked_at, "not permitted for the user " + DescribeUser(),
                    "sudo adduser " + DescribeUser() +
                        " pheromone, and log in again: the socket is for that group.");
  } else {
    findings->Warning(kServer, looked_at,
                      std::string("no server runs there: ") + std::strerror(error),
                      "Start pheromoned, or specify a running server with --instance or --socket.");
  }
}

// What a server says; empty, and told, if it does not answer.
std::optional<ServerViews> AskServer(const ServerOptions& options, Findings* findings) {
  ServerViews views;
  const struct {
    const char* target;
    boost::json::value* view;
  } questions[] = {{"/api/v1/status", &views.status},
                   {"/api/v1/links", &views.links},
                   {"/api/v1/clients", &views.clients},
                   {"/api/v1/trackers", &views.trackers},
                   {"/api/v1/config", &views.config}};
  for (const auto& question : questions) {
    Result<boost::json::value> answer = AskJson(options, "GET", question.target);
    if (!answer.ok()) {
      findings->Fault(kServer, question.target, answer.error(),
                      "Look at the server's log; restart it if it does not answer.");
      return std::nullopt;
    }
    *question.view = std::move(answer).value();
  }
  return views;
}

}  // namespace

int Examine(const ServerOptions& options, const std::string& config_file) {
  Findings findings;
  const Result<ServerSocket> chosen = ChooseSocket(options.socket);
  const std::string socket = chosen.ok() ? chosen.value().path : "";
  const std::string service = InstanceOf(socket);
  Place place;
  place.server = chosen.ok() ? ProcessBehind(socket) : std::nullopt;
  std::optional<ServerViews> views;
  if (!chosen.ok()) {
    findings.Fault(kServer, "socket", chosen.error(),
                   "Specify a running server with --instance or --socket.");
  } else if (!place.server) {
    TellNoServer(socket, errno, &findings);
  } else if ((views = AskServer(options, &findings))) {
    findings.Ok(kServer, "socket " + socket, DescribeProcess(*place.server));
    CheckHealth(*views, &findings);
    place.journal = TextAt(views->config, "journal");
    place.node = TextAt(At(views->status, "cluster"), "node");
  }
  if (!config_file.empty()) {
    place.config_file = config_file;
  } else {
    place.config_file = views ? TextAt(views->config, "file") : ServiceConfigOf(service);
  }
  if (const char* const state = std::getenv("STATE_DIRECTORY"); state != nullptr) {
    place.state_directory = state;
  } else if (place.config_file == ConfigOf(service)) {
    place.state_directory = "/var/lib/pheromone/" + service;
  }

  const std::optional<config::Config> config = CheckConfiguration(place, &findings);
  std::set<std::string> bad_links;
  if (config) {
    if (views) {
      CheckReread(*views, *config, &findings);
    }
    CheckJournal(place, *config, &findings);
    CheckToken(*config, &findings);
    CheckPorts(place, *config, &findings);
    CheckGroups(*config, &findings);
    bad_links = CheckSerialPorts(place, *config, &findings);
  }
  CheckClock(&findings);
  if (views) {
    CheckLinks(place, *views, bad_links, &findings);
    CheckRobots(*views, &findings);
    CheckTrackers(*views, &findings);
    CheckChannels(*views, config.value_or(config::Config()), &findings);
  }
  return findings.Print(options.json);
}

}  // namespace pheromone::ctl
