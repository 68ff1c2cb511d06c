// The thread that asks the server, over its Unix socket, and publishes what it says: pheromones and
// obstacles as maps, robots and tags as markers, all states as diagnostics, and map -> odometry of
// robots that a tracker sees. It also carries orders of ROS topics to the server. Robots never wait
// for it.
//
//   ServerThread server(&node, options, &reports);
//   server.Send("halt", "/api/v1/halt", "{}");
//
// Without a socket it publishes the diagnostics of robots only. A map is published when it has
// changed, at most five times a second, and a quarter of the time is spent on asking at most.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <boost/json/value.hpp>

#include "client_fw/ros2/grid.h"
#include "client_fw/ros2/node.h"
#include "client_fw/ros2/options.h"
#include "client_fw/ros2/robot_report.h"
#include "client_fw/ros2/scene.h"

namespace pheromone::ros2 {

class ServerThread {
 public:
  /// All outlive it.
  ServerThread(Node* node, const BridgeOptions& options, const RobotReports* reports);
  /// Ends when the request under way has, in kPatience at most.
  ~ServerThread();
  ServerThread(const ServerThread&) = delete;
  ServerThread& operator=(const ServerThread&) = delete;

  /// An order, of which a line tells how it ended. "halt" overtakes others. Any thread.
  void Send(const std::string& name, const std::string& target, const std::string& body);

 private:
  struct Order {
    std::string name;
    std::string target;
    std::string body;
  };
  struct Layer {
    std::string pheromone;  // empty: obstacles
    Publisher<OccupancyGrid> publisher;
    std::optional<Grid> last;
    Subscription<PointStamped> deposit;
    Subscription<Path> paint;
  };

  int64_t NowMs() const;  // since the start
  void Run();
  bool Wait(int64_t ms);
  void SendOrders();
  void Turn(int64_t turn);
  /// Nothing, with the reason noted, if there is no such answer.
  std::optional<boost::json::value> Ask(const std::string& target);
  void FindLayers();
  void AddLayer(const std::string& pheromone);
  void PublishLayer(Layer* layer);
  void TakeOrders(Layer* layer);
  bool IsOnMap(const Header& header, const std::string& what);
  void PublishFrames(const boost::json::value& clients);
  void PublishDiagnostics(const boost::json::value& clients);

  Node* node_;
  const BridgeOptions& options_;
  const RobotReports* reports_;
  int64_t start_ns_;

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Order> orders_;
  bool ending_ = false;

  // The thread's own.
  std::map<std::string, Layer> layers_;  // by topic
  Scene scene_;
  std::string trouble_;              // why the server did not answer last; empty: it did
  std::optional<std::string> said_;  // of it
  Publisher<MarkerArray> markers_;
  Publisher<DiagnosticArray> diagnostics_;
  Publisher<TFMessage> frames_;
  std::thread thread_;
};

}  // namespace pheromone::ros2
