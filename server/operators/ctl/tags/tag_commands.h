// pheromonectl tags list, show, write, erase, forget, find: what is written on the virtual RFID
// tags of a running server. Each prints to standard output and returns the exit status.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/core/tags/symbols.h"
#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {

int ListTags(const ServerOptions& options);
int ShowTag(const ServerOptions& options, const std::string& name);

struct TagNote {
  std::string tag;
  std::string sentence;  ///< such as "15 lookingfortag 244" (server/formats/rdf/sentence.h)
  std::string author = "operator";  ///< its unique ID; a new one is added to the tables
  bool replace = false;             ///< the author's block of the same subject and predicate
  double lease_s = 0;               ///< 0: none
  std::optional<int> slot{};        ///< empty: chosen by the tag's drop policy
};
int WriteTag(const ServerOptions& options, const TagNote& note);

/// One slot, or all of them.
int EraseTag(const ServerOptions& options, const std::string& name, std::optional<int> slot);

/// Removes what a robot, or operators and nets, have defined and is not in use.
int ForgetSymbols(const ServerOptions& options, const tags::Maker& maker);

/// Queries by example, such as "robot=15", "predicate=lookingfortag": prints the blocks that
/// agree with all of them.
int FindOnTags(const ServerOptions& options, const std::vector<std::string>& examples);

}  // namespace pheromone::ctl
