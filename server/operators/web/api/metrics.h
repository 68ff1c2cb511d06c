// The server's metrics in the text format of Prometheus, version 0.0.4
// (https://prometheus.io/docs/instrumenting/exposition_formats/).
//
//   # HELP pheromone_link_received_frames_total Complete frames received.
//   # TYPE pheromone_link_received_frames_total counter
//   pheromone_link_received_frames_total{link="radio-a"} 1234
//
// Names end in their unit; counters in _total. Values are as of one moment of each view.
#pragma once

#include <cstdint>
#include <string>

#include "server/operators/control/control.h"
#include "server/operators/control/stream_counters.h"
#include "server/operators/web/tls_counters.h"

namespace pheromone::web {

constexpr char kMetricsType[] = "text/plain; version=0.0.4; charset=utf-8";

std::string Metrics(const control::Control& control);

/// Those of access to the API.
std::string AccessMetrics(uint64_t unauthorized);

/// Those of the stream for viewers, and of replays.
std::string StreamMetrics(const StreamCounters& counters, const StreamCounters& replays);

/// Those of HTTPS.
std::string TlsMetrics(const TlsCounters& counters);

}  // namespace pheromone::web
