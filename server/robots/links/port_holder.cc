#include "server/robots/links/port_holder.h"

#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>
#include <vector>

#include "server/base/holders.h"

namespace pheromone::links {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kModemManager = "ModemManager";
constexpr std::string_view kAdvice =
    "; to exclude ModemManager, see pheromoned.toml(5), \"[[link]]\"";

bool ModemManagerRuns(const std::string& proc) {
  std::error_code error;
  for (fs::directory_iterator it(proc, error), end; !error && it != end; it.increment(error)) {
    std::ifstream file(it->path() / "comm");
    if (std::string name; std::getline(file, name) && name == kModemManager) {
      return true;
    }
  }
  return false;
}

}  // namespace

std::string DescribeHolders(const std::string& device, const std::string& proc) {
  std::string text;
  for (const int pid : HoldersOf(device, proc)) {
    text += (text.empty() ? "held by " : ", ") + DescribeProcess(pid, proc);
  }
  const bool modem_manager = ModemManagerRuns(proc);
  if (text.empty()) {
    text = "held by a program that cannot be determined";
    text += modem_manager ? ", possibly ModemManager, which is running" : "";
  }
  return text + std::string(modem_manager ? kAdvice : "");
}

}  // namespace pheromone::links
