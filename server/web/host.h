// Whether a request means this server, or came here by a name that somebody else gave it.
//
// A page from elsewhere that a browser on this network shows could otherwise read what is here: its
// owner has his own name point to 127.0.0.1, and the browser then takes this server for his (DNS
// rebinding). Only the name that the browser believes in, the header Host, tells. No such name is
// an address or "localhost", so these are always good.
//
//   MeansThisServer("127.0.0.1:8377", {})          // true
//   MeansThisServer("lab.local:8377", {"lab.local"})  // true
//   MeansThisServer("evil.example", {})            // false
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace pheromone::web {

/// `host` is the header's value, with or without a port; empty, it is from a program that sends
/// none, and no browser: good. `names` are further ones that are good, in lower case.
bool MeansThisServer(std::string_view host, const std::vector<std::string>& names);

}  // namespace pheromone::web
