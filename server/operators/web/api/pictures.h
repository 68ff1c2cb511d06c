// Draws rasters and pictures of the field without delaying robots or operators, and once for all
// requests that wait for the same picture.
//
//   Pictures pictures(&control, &lanes);
//   pictures.Show(target, query, respond);     // on a thread that reads requests
//
// The configuration is read under the service's lock on the threads that read requests; the thread
// that draws takes no lock for which a robot may wait, so that it can have a low priority. A
// request for a picture that is already being drawn gets a new one, which is not older than the
// request.
//
// Thread-safe.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <boost/json/object.hpp>

#include "server/operators/control/control.h"
#include "server/operators/web/api/queries.h"
#include "server/operators/web/http.h"
#include "server/operators/web/lanes.h"

namespace pheromone::web {

class Pictures {
 public:
  /// Both outlive it, and it outlives whatever runs in the lanes.
  Pictures(const control::Control* control, const Lanes* lanes)
      : control_(*control), lanes_(*lanes) {}

  /// `target` is the request's, `query` what it says.
  void Show(const std::string& target, boost::json::object query, Respond respond);

 private:
  struct Order {
    std::string target;
    boost::json::object query;
    std::vector<Respond> waiting;  // under mutex_, as long as it is in orders_
  };

  void Begin(const std::shared_ptr<Order>& order, int looks_left);
  void Draw(const std::shared_ptr<Order>& order, const Picture& picture, int looks_left);
  void Finish(const std::shared_ptr<Order>& order, const Picture& picture, const Response& response,
              int looks_left);
  void Close(const std::shared_ptr<Order>& order);
  void Answer(const std::shared_ptr<Order>& order, const Response& response);

  const control::Control& control_;
  const Lanes& lanes_;
  std::mutex mutex_;
  std::map<std::string, std::weak_ptr<Order>> orders_;  // by target, those not begun
};

}  // namespace pheromone::web
