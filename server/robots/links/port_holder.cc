#include "server/robots/links/port_holder.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

namespace pheromone::links {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kModemManager = "ModemManager";
constexpr std::string_view kAdvice =
    "; to exclude ModemManager, see pheromoned.toml(5), \"[[link]]\"";

std::string NameOf(const fs::path& process) {
  std::ifstream file(process / "comm");
  std::string name;
  std::getline(file, name);
  return name;
}

bool Holds(const fs::path& process, const std::string& device) {
  std::error_code error;  // for other users' processes, and those that have just ended
  for (fs::directory_iterator it(process / "fd", error), end; !error && it != end;
       it.increment(error)) {
    std::error_code unreadable;
    if (fs::read_symlink(it->path(), unreadable) == device) {
      return true;
    }
  }
  return false;
}

}  // namespace

std::string DescribeHolders(const std::string& device, const std::string& proc) {
  std::string holders;
  bool modem_manager = false;
  std::error_code error;
  for (fs::directory_iterator it(proc, error), end; !error && it != end; it.increment(error)) {
    const std::string id = it->path().filename().string();
    if (id.find_first_not_of("0123456789") != std::string::npos || id == std::to_string(getpid())) {
      continue;
    }
    const std::string name = NameOf(it->path());
    modem_manager = modem_manager || name == kModemManager;
    if (Holds(it->path(), device)) {
      holders.append(holders.empty() ? "held by " : ", ").append(name);
      holders.append(" (process ").append(id).append(")");
    }
  }
  if (holders.empty()) {
    holders = "held by a program that cannot be determined";
    holders += modem_manager ? ", possibly ModemManager, which is running" : "";
  }
  return holders + std::string(modem_manager ? kAdvice : "");
}

}  // namespace pheromone::links
