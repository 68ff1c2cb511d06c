#include "server/operators/ctl/server_socket.h"

#include <fmt/format.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <system_error>

namespace pheromone::ctl {

namespace {

constexpr std::string_view kServices = "/run/pheromone/";

}  // namespace

std::string SocketOf(const std::string& instance) {
  return std::string(kServices) + instance + "/pheromoned.sock";
}

std::string InstanceOf(const std::string& socket) {
  return socket.starts_with(kServices)
             ? socket.substr(kServices.size(),
                             socket.find('/', kServices.size()) - kServices.size())
             : "";
}

std::string ConfigOf(const std::string& instance) {
  return "/etc/pheromone/" + instance + ".toml";
}

std::string ServiceConfigOf(const std::string& instance) {
  const std::string file = ConfigOf(instance);
  std::error_code ignored;
  return !instance.empty() && std::filesystem::exists(file, ignored) ? file : "";
}

std::string UserName(uid_t id) {
  const passwd* user = getpwuid(id);
  return user != nullptr ? user->pw_name : std::to_string(id);
}

Status CheckOwner(const std::string& socket, const std::string& verb, uid_t owner) {
  const uid_t user = geteuid();
  if (owner == user || owner == 0) {
    return Ok();
  }
  std::error_code ignored;
  return Error{fmt::format(
      "{} in the working directory {} {} {}, expected {}; if that server is meant, use --socket {}",
      socket, std::filesystem::current_path(ignored).string(), verb, UserName(owner),
      user == 0 ? UserName(0) : UserName(user) + " or " + UserName(0), socket)};
}

Result<ServerSocket> ChooseSocket(const std::string& named) {
  if (!named.empty()) {
    return ServerSocket{.path = named, .is_named = true};
  }
  if (const char* path = std::getenv("PHEROMONE_SOCKET"); path != nullptr && *path != '\0') {
    return ServerSocket{.path = path};
  }
  const std::string here = "pheromoned.sock";
  struct stat socket {};
  if (stat(here.c_str(), &socket) != 0 || !S_ISSOCK(socket.st_mode)) {
    return ServerSocket{.path = SocketOf("pheromoned")};
  }
  PHEROMONE_TRY_STATUS(CheckOwner(here, "belongs to", socket.st_uid));
  // A link of another user could lead to any server of this user's.
  if (struct stat link{}; lstat(here.c_str(), &link) == 0) {
    PHEROMONE_TRY_STATUS(CheckOwner(here, "belongs to", link.st_uid));
  }
  return ServerSocket{.path = here, .is_found = true};
}

}  // namespace pheromone::ctl
