#include "server/operators/ctl/capture_commands.h"

#include <fmt/format.h>

#include <string_view>

#include "server/operators/ctl/json_read.h"
#include "server/operators/ctl/units.h"

namespace pheromone::ctl {
namespace {

int Print(const ServerOptions& options, const JsonReply& reply) {
  if (reply.exit_status == 0) {
    fmt::print("{}", options.json ? reply.text : DescribeCapture(reply.value) + '\n');
  }
  return reply.exit_status;
}

int Have(const ServerOptions& options, std::string_view action) {
  return Print(options, CallJson(options, "POST", "/api/v1/capture",
                                 fmt::format(R"({{"action":"{}"}})", action)));
}

}  // namespace

int StartCapture(const ServerOptions& options) {
  return Have(options, "start");
}

int StopCapture(const ServerOptions& options) {
  return Have(options, "stop");
}

int ShowCapture(const ServerOptions& options) {
  return Print(options, CallJson(options, "GET", "/api/v1/capture"));
}

std::string DescribeCapture(const boost::json::value& capture) {
  const std::string file = TextAt(capture, "file");
  const bool recording = FlagAt(capture, "recording");
  std::string line = recording ? "recording" : "not recording";
  if (!file.empty()) {
    const uint64_t files = CountAt(capture, "files");
    line += fmt::format("{} {}: {} in {} file{}", recording ? " into" : "; the last into", file,
                        Size(NumberAt(capture, "bytes")), files, files == 1 ? "" : "s");
  }
  if (const uint64_t lost = CountAt(capture, "lost"); lost != 0) {
    line += fmt::format(", {} records lost: not replayable from there on", lost);
  }
  if (const std::string error = TextAt(capture, "error"); !error.empty()) {
    line += "; it stopped by itself: " + error;
  }
  return line;
}

}  // namespace pheromone::ctl
