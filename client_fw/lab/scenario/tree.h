// A scenario's TOML as a tree whose values can be replaced before it is read, and as a flat list.
//
//   config::Value tree = config::ParseDocument(text, "ants.toml").value();
//   SetValue("robots[1].count", "200", &tree);        // --set robots[1].count=200
//   for (const auto& [key, value] : Flatten(tree)) ...   // "robots[1].count", "200"
//
// A key is the path of a value as messages have it: names with dots between them, and the number of
// a table [[name]] in brackets, which may be left out where there is one. Pure.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/result.h"
#include "server/config/document.h"

namespace pheromone::lab {

/// `text` as TOML has it; what cannot be read as such is a string. A table that is not there is
/// made; one of those [[name]] has to be there. Errors name the key.
Status SetValue(std::string_view key, std::string_view text, config::Value* tree);

using KeyValues = std::vector<std::pair<std::string, std::string>>;

/// All values that are no tables, by key: texts as they are, others as TOML in one line.
KeyValues Flatten(const config::Value& tree);

/// A value as TOML in one line.
std::string TomlOf(const config::Value& value);

/// The tables [name] and [[name]] that the tree has, as a TOML document.
std::string TomlOfTables(const config::Value& tree, std::span<const std::string_view> names);

}  // namespace pheromone::lab
