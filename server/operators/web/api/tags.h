// The virtual RFID tags over HTTP: what is on them, the symbol tables, and changes.
#pragma once

#include <vector>

#include <boost/json/value.hpp>

#include "server/operators/control/control.h"
#include "server/operators/web/api/request_parameters.h"
#include "server/operators/web/http.h"

namespace pheromone::web {

/// first (a number), contents = 1: with the blocks. Some of the tags, and where the next page
/// begins.
Response ReadTags(const control::Control& control, Parameters* fields);

/// first (an index): some of the rows of the symbol tables, and where the next page begins.
Response ReadSymbols(const control::Control& control, Parameters* fields);

/// {"tags": [...]}, as ReadTags has them, with their blocks.
boost::json::value TagsToJson(const std::vector<control::TagView>& tags);

/// action: "write" with tag, author, block = [six words], and time_s, slot, expected, replace,
/// lease_s; "erase" with tag, slot and expected; "define" with kind, robot, number and text.
void ChangeTags(control::Control* control, Parameters* fields, Respond respond);

}  // namespace pheromone::web
