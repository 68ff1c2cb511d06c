// Rasters and pictures of the field, drawn where they hold up neither robots nor operators, and
// once for all that wait for the same one.
//
//   Pictures pictures(&control, &lanes);
//   pictures.Show(target, query, respond);     // on a thread that reads requests
//
// The configuration is looked at under the service's lock on the threads that read requests; the
// thread that draws takes no lock that a robot may wait for, so that it may have a low priority.
// Whoever asks for a picture that is drawn already gets one of his own, which is not older than his
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

#include "server/engine/control.h"
#include "server/web/http.h"
#include "server/web/lanes.h"
#include "server/web/reading.h"

namespace pheromone::web {

class Pictures {
 public:
  /// Both outlive it, and it outlives whatever runs in the lanes.
  Pictures(const engine::Control* control, const Lanes* lanes)
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
  void Finish(const std::shared_ptr<Order>& order, const Picture& picture, Response response,
              int looks_left);
  void Close(const std::shared_ptr<Order>& order);
  void Answer(const std::shared_ptr<Order>& order, Response response);

  const engine::Control& control_;
  const Lanes& lanes_;
  std::mutex mutex_;
  std::map<std::string, std::weak_ptr<Order>> orders_;  // by target, those not begun
};

}  // namespace pheromone::web
