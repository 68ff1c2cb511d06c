// Checks the Host header of a request, as a protection against DNS rebinding.
//
// Otherwise a foreign web page shown in a browser on this network could read this server: the owner
// of the page lets its host name resolve to 127.0.0.1, and the browser then takes this server for
// the origin of the page. Only the Host header reveals that name. It is never an IP address or
// "localhost", so these are always permitted.
//
//   MeansThisServer("127.0.0.1:8377", {})          // true
//   MeansThisServer("lab.local:8377", {"lab.local"})  // true
//   MeansThisServer("evil.example", {})            // false
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace pheromone::web {

/// `host` is the value of the header, with or without a port; it is empty for a program that sends
/// none and is not a browser, which is permitted. `names` are further permitted names, in lower
/// case.
bool MeansThisServer(std::string_view host, const std::vector<std::string>& names);

}  // namespace pheromone::web
