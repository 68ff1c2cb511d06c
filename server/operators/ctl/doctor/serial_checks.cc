// The serial devices of links: whether they exist, may be opened, and who has them open.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <vector>

#include "server/base/holders.h"
#include "server/operators/ctl/doctor/host_checks.h"
#include "server/robots/links/usb_port.h"

namespace pheromone::ctl {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSerial = "serial";

std::string ListPorts(const std::vector<links::UsbPort>& ports) {
  std::vector<std::string> names;
  for (const links::UsbPort& port : ports) {
    names.push_back(port.path + " (usb " + links::ToText(port.identity) + ")");
  }
  return names.empty() ? "no USB adapter is plugged in"
                       : fmt::format("plugged in: {}", fmt::join(names, ", "));
}

// False: told that it cannot be used.
bool CheckDevice(const Place& place, const std::string& link, const std::string& path,
                 const std::vector<links::UsbPort>& ports, Findings* findings) {
  const std::string looked_at = "link " + link + ", " + path;
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) {
    findings->Fault(kSerial, looked_at, std::string(std::strerror(errno)) + "; " + ListPorts(ports),
                    "Plug the adapter in, or name its port with port or usb in [[link]].");
    return false;
  }
  if (!S_ISCHR(status.st_mode)) {
    findings->Fault(kSerial, looked_at, "not a serial port",
                    "Name the port of the adapter in [[link]]; " + ListPorts(ports) + ".");
    return false;
  }
  std::vector<int> holders = HoldersOf(path);
  std::erase(holders, place.server.value_or(-1));
  if (!holders.empty()) {
    findings->Fault(kSerial, looked_at, "in use by " + DescribeProcess(holders.front()),
                    "Stop that program: a port serves one at a time.");
    return false;
  }
  if (place.server) {
    findings->Ok(kSerial, looked_at, "there");  // who runs the server may be somebody else
    return true;
  }
  if (access(path.c_str(), R_OK | W_OK) != 0) {
    const std::string group = NameOfGroup(status.st_gid);
    findings->Fault(
        kSerial, looked_at,
        fmt::format("not permitted for the user {}, mode {:04o}, group {}", DescribeUser(),
                    status.st_mode & 07777u, group),
        IsInGroup(group) || group == "root"
            ? fmt::format("Give it to the group dialout: chgrp dialout {}; chmod 660 {}.", path,
                          path)
            : fmt::format("sudo adduser {} {}, and log in again.", DescribeUser(), group));
    return false;
  }
  // It is not opened: that would raise its lines, which reset some boards and key some modems.
  findings->Ok(kSerial, looked_at, "there, and nobody has it open");
  return true;
}

}  // namespace

std::set<std::string> CheckSerialPorts(const Place& place, const config::Config& config,
                                       Findings* findings) {
  std::set<std::string> bad;
  const std::vector<links::UsbPort> ports = links::ListUsbPorts();
  std::vector<std::string> used;
  for (const links::LinkConfig& link : config.links) {
    if (link.kind != links::LinkKind::kSerial || !IsHere(link, config)) {
      continue;
    }
    const Result<std::string> path =
        link.usb ? links::ChooseUsbPort(*link.usb, ports) : Result<std::string>(link.path);
    if (!path.ok()) {
      findings->Fault(kSerial, "link " + link.name, path.error(),
                      "Plug the adapter in, or name one that is there with usb in [[link]].");
      bad.insert(link.name);
      continue;
    }
    std::error_code error;
    used.push_back(fs::canonical(path.value(), error).string());
    if (!CheckDevice(place, link.name, path.value(), ports, findings)) {
      bad.insert(link.name);
    }
  }
  for (const links::UsbPort& port : ports) {
    if (std::find(used.begin(), used.end(), port.path) == used.end()) {
      findings->Ok(kSerial, port.path, "usb " + links::ToText(port.identity) + ", of no link");
    }
  }
  return bad;
}

}  // namespace pheromone::ctl
