// What the stream offers: its channels, services and parameters. Values; the hub makes a new
// catalogue when the configuration changes.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <boost/json/value.hpp>

namespace pheromone::web {

/// A message of a channel, made once for all viewers.
struct Frame {
  uint64_t time_ns = 0;  ///< since 1970
  std::string payload;
};
using FramePtr = std::shared_ptr<const Frame>;

struct Channel {
  uint32_t id = 0;
  std::string topic;
  std::string encoding;
  std::string schema_name;
  std::string schema;  ///< base64 if it is binary
  std::string schema_encoding;
  bool operator==(const Channel&) const = default;
};

/// What is replayed: the times of its first and last moment.
struct ReplayedRecording {
  std::string name;
  uint64_t begin_ns = 0;
  uint64_t end_ns = 0;
};

struct Catalogue {
  std::string session;     ///< another one after each start of the server
  std::string ros_distro;  ///< empty: none
  std::vector<Channel> channels;
  std::map<std::string, boost::json::value> parameters;  ///< constants of laws
  std::string click_pheromone;                           ///< of /clicked_point
  /// A recording is replayed, which viewers control; nothing can be changed. Empty: live.
  std::optional<ReplayedRecording> recording;
};

}  // namespace pheromone::web
