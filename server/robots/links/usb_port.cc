#include "server/robots/links/usb_port.h"

#include <libserialport.h>

#include <algorithm>

namespace pheromone::links {
namespace {

std::string ListOf(std::span<const UsbPort> ports) {
  std::string list;
  for (const UsbPort& port : ports) {
    list += (list.empty() ? "" : ", ") + ToText(port.identity) + " at " + port.path;
  }
  return list;
}

bool IsWanted(const UsbIdentity& wanted, const UsbIdentity& found) {
  return found.vendor == wanted.vendor && found.product == wanted.product &&
         (wanted.serial.empty() || found.serial == wanted.serial);
}

}  // namespace

std::vector<UsbPort> ListUsbPorts() {
  std::vector<UsbPort> ports;
  sp_port** list = nullptr;
  if (sp_list_ports(&list) != SP_OK) {
    return ports;
  }
  for (sp_port** port = list; *port != nullptr; ++port) {
    int vendor = 0;
    int product = 0;
    if (sp_get_port_transport(*port) == SP_TRANSPORT_USB &&
        sp_get_port_usb_vid_pid(*port, &vendor, &product) == SP_OK) {
      const char* serial = sp_get_port_usb_serial(*port);
      ports.push_back({sp_get_port_name(*port),
                       {static_cast<uint16_t>(vendor), static_cast<uint16_t>(product),
                        serial != nullptr ? serial : ""}});
    }
  }
  sp_free_port_list(list);
  std::sort(ports.begin(), ports.end(),
            [](const UsbPort& a, const UsbPort& b) { return a.path < b.path; });
  return ports;
}

Result<std::string> ChooseUsbPort(const UsbIdentity& wanted, std::span<const UsbPort> ports) {
  std::vector<UsbPort> fitting;
  std::copy_if(ports.begin(), ports.end(), std::back_inserter(fitting),
               [&wanted](const UsbPort& it) { return IsWanted(wanted, it.identity); });
  if (fitting.empty()) {
    return Error{"no USB adapter " + ToText(wanted) + "; found " +
                 (ports.empty() ? "none" : ListOf(ports))};
  }
  if (fitting.size() > 1) {
    return Error{"more than one USB adapter " + ToText(wanted) + ": " + ListOf(fitting) +
                 "; specify its serial number, or configure its port instead"};
  }
  return fitting.front().path;
}

}  // namespace pheromone::links
