#include "server/operators/web/host.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>

#include "server/base/text.h"

namespace pheromone::web {
namespace {

bool IsAddress(int family, const std::string& text) {
  in6_addr address{};  // the larger of the two
  return inet_pton(family, text.c_str(), &address) == 1;
}

}  // namespace

bool MeansThisServer(std::string_view host, const std::vector<std::string>& names) {
  if (host.empty()) {
    return true;
  }
  // A colon begins the port, unless it belongs to an address in brackets.
  const size_t colon = host.rfind(':');
  const size_t bracket = host.rfind(']');
  if (colon != std::string_view::npos && (bracket == std::string_view::npos || colon > bracket)) {
    if (host.find_first_not_of("0123456789", colon + 1) != std::string_view::npos) {
      return false;
    }
    host = host.substr(0, colon);
  }
  if (host.starts_with('[') && host.ends_with(']')) {
    return IsAddress(AF_INET6, std::string(host.substr(1, host.size() - 2)));
  }
  const std::string name = ToLower(host);
  return name == "localhost" || IsAddress(AF_INET, name) ||
         std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace pheromone::web
