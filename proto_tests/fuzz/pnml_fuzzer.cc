// Any text as PNML: it is understood or refused with words that name the file. What is understood
// is a sound net, and comes back the same when it is written.

#include <cstdint>
#include <string>
#include <string_view>

#include "proto_tests/fuzz/require.h"
#include "server/formats/nets/pnml.h"

namespace {

using pheromone::Result;
using pheromone::fuzz::Require;
using pheromone::nets::ParsePnml;
using pheromone::nets::ToPnml;
using pheromone::petri::Net;

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const Result<Net> net = ParsePnml("fuzz", text);
  if (!net.ok()) {
    Require(net.error().starts_with("fuzz:"));
    return 0;
  }
  Require(CheckNet(net.value()).ok());
  Require(ParsePnml("fuzz", ToPnml(net.value())).value() == net.value());
  return 0;
}
