// The tags and symbol tables of a running server, as pheromonectl reads them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <boost/json/object.hpp>

#include "server/core/tags/block.h"
#include "server/core/tags/symbols.h"
#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {

struct WrittenSlot {
  uint8_t slot = 0;
  uint16_t generation = 0;
  std::optional<double> lease_s{};
  bool privileged = false;
  tags::Block block{};
};

struct TagData {
  std::string name;
  uint16_t number = 0;
  bool configured = false;
  double x_m = 0;
  double y_m = 0;
  double range_m = 0;
  size_t slots = 0;
  size_t used = 0;
  uint16_t generation = 0;
  std::vector<WrittenSlot> blocks{};  ///< where they were asked for
};

/// All tags by number, page by page; of a tag that changes meanwhile, either state. The exit
/// status; errors are reported.
int FetchTags(const ServerOptions& options, bool with_contents, std::vector<TagData>* tags);

/// One of them with its contents; `name` is reported if there is none.
int FetchTag(const ServerOptions& options, const std::string& name, TagData* tag);

int FetchTables(const ServerOptions& options, tags::SymbolTables* tables);

/// Posts a change of tags or symbol tables. The exit status; errors are reported.
int PostChange(const ServerOptions& options, const boost::json::object& change);

/// The change that writes `block` on a tag; a time of 0 is the server's.
boost::json::object WriteOf(const std::string& tag, const tags::Block& block);

/// Defines the rows of `tables` from `first` on at the server.
int DefineRows(const ServerOptions& options, const tags::SymbolTables& tables, size_t first);

}  // namespace pheromone::ctl
