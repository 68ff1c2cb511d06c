#include "server/operators/ctl/doctor/host_checks.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <grp.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "server/base/descriptor.h"
#include "server/base/holders.h"
#include "server/config/describe.h"
#include "server/config/folders.h"
#include "server/operators/ctl/server_socket.h"
#include "server/operators/ctl/units.h"

namespace pheromone::ctl {
namespace {

namespace fs = std::filesystem;

constexpr const char* kConfiguration = "configuration";
constexpr const char* kJournal = "journal";
constexpr const char* kToken = "token";
constexpr const char* kPorts = "ports";
constexpr const char* kClock = "clock";
constexpr const char* kTokenKey = "web.token_file";
constexpr std::time_t kEarliestTime = 1'704'067'200;  // 2024-01-01
constexpr std::time_t kClockSlack = 60;

std::string NameOfFile(const Place& place) {
  return place.config_file.empty() ? "the default configuration" : place.config_file;
}

// The last that exists of a path and the folders that it is in.
fs::path ExistingPart(fs::path path) {
  std::error_code error;
  while (!fs::exists(path, error) && path.has_relative_path()) {
    path = path.parent_path();
  }
  return path;
}

void CheckJournalSpace(const std::string& folder, const config::JournalConfig& journal,
                       Findings* findings) {
  struct statvfs disk {};
  if (statvfs(ExistingPart(folder).c_str(), &disk) != 0) {
    return;  // a folder that cannot be used was told
  }
  const double free_bytes = static_cast<double>(disk.f_bavail) * static_cast<double>(disk.f_frsize);
  const double need = static_cast<double>(journal.segment_bytes + journal.snapshot_bytes);
  if (free_bytes < need) {
    findings->Fault(kJournal, folder,
                    fmt::format("{} free, but the log may take {} until the next snapshot",
                                Size(free_bytes), Size(need)),
                    "Free space on that disk, or move the folder to another one; a smaller "
                    "snapshot_mib in [journal] needs less.");
  } else {
    findings->Ok(kJournal, folder, Size(free_bytes) + " free");
  }
}

// The clock was set back since the server last wrote.
void CheckJournalTimes(const std::string& folder, Findings* findings) {
  std::time_t newest = 0;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    struct stat status {};
    if (stat(it->path().c_str(), &status) == 0) {
      newest = std::max(newest, status.st_mtime);
    }
  }
  const std::time_t now = std::time(nullptr);
  if (newest > now + kClockSlack) {
    findings->Fault(kClock, folder,
                    "the journal was written " + Duration(static_cast<double>(newest - now)) +
                        " after the present time: the clock was set back",
                    "Set the clock before the server starts: timedatectl set-ntp true.");
  }
}

struct ListeningPort {
  std::string what;
  Endpoint at;
  Transport transport = Transport::kTcp;
  std::string key;  // where it is configured
};

std::vector<ListeningPort> PortsOf(const config::Config& config) {
  std::vector<ListeningPort> ports;
  if (!config.web.listen.address.empty()) {
    ports.push_back({"web", config.web.listen, Transport::kTcp, "listen in [web]"});
  }
  if (config.cluster) {
    for (const auto& node : config.cluster->nodes) {
      if (node.name == config.cluster->node) {
        ports.push_back({"node " + node.name, node.address, Transport::kTcp, "nodes in [cluster]"});
      }
    }
  }
  for (const links::LinkConfig& link : config.links) {
    if (link.kind == links::LinkKind::kTcp || link.kind == links::LinkKind::kUdp) {
      ports.push_back({"link " + link.name, link.listen,
                       link.kind == links::LinkKind::kTcp ? Transport::kTcp : Transport::kUdp,
                       "listen in [[link]]"});
    }
  }
  for (const links::TrackerConfig& tracker : config.trackers) {
    ports.push_back(
        {"tracker " + tracker.name, tracker.listen, Transport::kUdp, "listen in [[tracker]]"});
  }
  return ports;
}

// 0, or why a program cannot listen there.
int TryToListen(const ListeningPort& port) {
  addrinfo hints{};
  hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
  hints.ai_socktype = port.transport == Transport::kTcp ? SOCK_STREAM : SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(port.at.address.c_str(), std::to_string(port.at.port).c_str(), &hints, &found) !=
      0) {
    return EADDRNOTAVAIL;
  }
  const Descriptor handle(
      socket(found->ai_family, found->ai_socktype | SOCK_CLOEXEC, found->ai_protocol));
  const int on = 1;
  if (port.transport == Transport::kTcp) {
    setsockopt(handle.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);  // as the server does
  }
  const int error =
      handle.valid() && bind(handle.get(), found->ai_addr, found->ai_addrlen) == 0 ? 0 : errno;
  freeaddrinfo(found);
  return error;
}

void CheckTakenPort(const Place& place, const ListeningPort& port, const std::string& where,
                    Findings* findings) {
  const std::optional<int> holder = HolderOfPort(port.at.port, port.transport);
  if (holder && holder == place.server) {
    findings->Ok(kPorts, where, "the server listens there");
  } else if (!holder && place.server) {
    findings->Ok(kPorts, where, "in use, by the server or a program that only root can see");
  } else {
    findings->Fault(
        kPorts, where,
        "in use by " + (holder ? DescribeProcess(*holder) : "a program that only root can see"),
        "Stop that program, or choose another port with " + port.key + ".");
  }
}

void CheckPort(const Place& place, const ListeningPort& port, Findings* findings) {
  const std::string where =
      port.what + ", " + (port.transport == Transport::kTcp ? "TCP " : "UDP ") + ToText(port.at);
  if (port.at.port == 0) {
    findings->Ok(kPorts, where, "any free port");
    return;
  }
  switch (const int error = TryToListen(port); error) {
    case 0:
      findings->Ok(kPorts, where, "free");
      break;
    case EADDRINUSE:
      CheckTakenPort(place, port, where, findings);
      break;
    case EACCES:
      findings->Fault(kPorts, where, "only root may listen on ports below 1024",
                      "Choose a port from 1024 on with " + port.key + ".");
      break;
    case EADDRNOTAVAIL:
      findings->Fault(
          kPorts, where, "no network interface of this machine has this address",
          "Choose an address that `ip address` shows, or 127.0.0.1, with " + port.key + ".");
      break;
    default:
      findings->Fault(kPorts, where, std::strerror(error),
                      "Choose another address with " + port.key + ".");
  }
}

// As the server reads it, which alone knows its --node: it says which one, or does not run.
Result<config::Config> LoadAsServer(const Place& place, Findings* findings) {
  const auto load = [&](const std::optional<config::Machine>& machine) {
    return config::LoadConfigOrDefault(place.config_file, std::filesystem::path(), machine);
  };
  std::array<char, 256> host{};
  (void)gethostname(host.data(), host.size() - 1);
  Result<config::Config> loaded = load(config::Machine{host.data(), place.node});
  if (loaded.ok() || !place.node.empty()) {
    return loaded;
  }
  Result<config::Config> of_any = load({});
  if (!of_any.ok()) {
    return of_any;
  }
  findings->Warning(kConfiguration, NameOfFile(place), loaded.error(),
                    "Let its unit say which one it is, as that of pheromonectl cluster setup does: "
                    "pheromoned --node NAME.");
  return of_any;
}

}  // namespace

bool IsHere(const links::LinkConfig& link, const config::Config& config) {
  return link.on.empty() || !config.cluster ||
         std::find(link.on.begin(), link.on.end(), config.cluster->node) != link.on.end();
}

std::string NameOfGroup(gid_t id) {
  const group* found = getgrgid(id);
  return found != nullptr ? found->gr_name : std::to_string(id);
}

bool IsInGroup(const std::string& name) {
  std::vector<gid_t> ids(static_cast<size_t>(std::max(getgroups(0, nullptr), 0)));
  getgroups(static_cast<int>(ids.size()), ids.data());
  ids.push_back(getegid());
  return std::any_of(ids.begin(), ids.end(), [&](gid_t id) { return NameOfGroup(id) == name; });
}

std::string DescribeUser() {
  return UserName(geteuid());
}

std::optional<config::Config> CheckConfiguration(const Place& place, Findings* findings) {
  Result<config::Config> loaded = LoadAsServer(place, findings);
  if (!loaded.ok()) {
    std::istringstream lines(loaded.error());
    for (std::string line; std::getline(lines, line);) {
      findings->Fault(kConfiguration, NameOfFile(place), line,
                      "Correct this in the file: pheromoned.toml(5) describes each key.");
    }
    return std::nullopt;
  }
  bool good = true;
  for (const config::Warning& warning : loaded.value().warnings) {
    if (warning.text.find(kTokenKey) == std::string::npos) {  // CheckToken tells of that
      good = false;
      findings->Warning(kConfiguration, NameOfFile(place), warning.text,
                        "Change the value in the file, if it is not meant: pheromoned.toml(5) "
                        "describes each key.");
    }
  }
  if (good) {
    findings->Ok(kConfiguration, NameOfFile(place), config::DescribeConfig(loaded.value()).front());
  }
  return std::move(loaded).value();
}

void CheckJournal(const Place& place, const config::Config& config, Findings* findings) {
  const std::string folder =
      place.journal ? *place.journal
                    : config::JournalFolder(config.journal, place.state_directory.c_str());
  if (folder.empty()) {
    findings->Warning(kJournal, "folder", "there is none: what is on the map is lost at each stop",
                      "Name a folder in [journal] of the configuration.");
    return;
  }
  if (!place.server) {
    const std::string why = config::WhyUnusable(folder, place.state_directory.c_str());
    if (!why.empty()) {
      findings->Fault(kJournal, folder, why + ", as the user " + UserName(geteuid()),
                      "Create that folder for the user that the server runs as, or name another "
                      "one in [journal].");
      return;
    }
    const std::vector<int> owners = HoldersOf((fs::path(folder) / "lock").string());
    if (!owners.empty()) {
      findings->Fault(kJournal, folder, "in use by " + DescribeProcess(owners.front()),
                      "Stop that server, or reach it with --socket.");
    }
  }
  CheckJournalSpace(folder, config.journal, findings);
  CheckJournalTimes(folder, findings);
}

void CheckToken(const config::Config& config, Findings* findings) {
  const std::string& file = config.web.token_file;
  if (config.web.listen.address.empty()) {
    findings->Ok(kToken, "[web]", "browsers are not served, so none is needed");
    return;
  }
  struct stat status {};
  if (file.empty()) {
    findings->Warning(kToken, "[web]", "there is none: browsers can look, but change nothing",
                      "With token_file = \"web-token\" in [web] the server makes one.");
  } else if (config.web.token.empty()) {
    findings->Ok(kToken, file, "there is none yet: the server makes it when it starts");
  } else if (stat(file.c_str(), &status) == 0 && (status.st_mode & S_IRWXO) != 0) {
    findings->Warning(
        kToken, file,
        fmt::format("mode {:04o}: each user of this machine can read it", status.st_mode & 07777u),
        "Take it from the others: chmod o= " + file + ".");
  } else {
    findings->Ok(
        kToken, file,
        fmt::format("mode {:04o}, read by the user {} and the group {}", status.st_mode & 07777u,
                    UserName(status.st_uid), NameOfGroup(status.st_gid)));
  }
}

void CheckPorts(const Place& place, const config::Config& config, Findings* findings) {
  for (const ListeningPort& port : PortsOf(config)) {
    CheckPort(place, port, findings);
  }
}

void CheckGroups(const config::Config& config, Findings* findings) {
  const std::string user = UserName(geteuid());
  const bool has_serial =
      std::any_of(config.links.begin(), config.links.end(), [&](const links::LinkConfig& link) {
        return link.kind == links::LinkKind::kSerial && IsHere(link, config);
      });
  if (geteuid() == 0) {
    findings->Ok("groups", "user " + user, "may open every port and socket");
  } else if (has_serial && !IsInGroup("dialout")) {
    findings->Warning("groups", "user " + user, "is not in the group dialout, which has the ports",
                      "sudo adduser " + user + " dialout, and log in again.");
  } else {
    findings->Ok("groups", "user " + user,
                 std::string(IsInGroup("dialout") ? "in" : "not in") + " the group dialout, " +
                     (IsInGroup("pheromone") ? "in" : "not in") + " the group pheromone");
  }
}

void CheckClock(Findings* findings) {
  const std::time_t now = std::time(nullptr);
  timex clock{};
  if (now < kEarliestTime) {
    findings->Fault(kClock, "system clock", "the date is before 2024",
                    "Set the clock: timedatectl set-ntp true.");
  } else if (adjtimex(&clock) < 0 || (static_cast<unsigned>(clock.status) & STA_UNSYNC) != 0) {
    findings->Warning(kClock, "system clock",
                      "not synchronised: times of recordings and tags may be wrong",
                      "timedatectl set-ntp true.");
  } else {
    findings->Ok(kClock, "system clock", "synchronised");
  }
}

}  // namespace pheromone::ctl
