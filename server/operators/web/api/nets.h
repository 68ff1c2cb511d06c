// The Petri nets that the server executes, over HTTP.
#pragma once

#include <vector>

#include <boost/json/value.hpp>

#include "server/operators/control/control.h"
#include "server/operators/web/api/request_parameters.h"
#include "server/operators/web/http.h"

namespace pheromone::web {

/// All of them; with net (a name) that one, with its tags, marking and last exceptions.
Response ReadNets(const control::Control& control, Parameters* fields);

/// All of them, each with everything that is known about it.
boost::json::value NetsToJson(const std::vector<control::NetView>& nets);

/// action: "reset" with net.
void ChangeNets(control::Control* control, Parameters* fields, Respond respond);

}  // namespace pheromone::web
