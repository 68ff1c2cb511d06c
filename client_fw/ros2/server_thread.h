// The thread that asks the server, over its Unix socket, and publishes what it says: pheromones and
// obstacles as maps, robots and tags as markers, all states as diagnostics, and map -> odometry of
// robots that a tracker sees. It also carries orders of ROS topics to the server. Robots never wait
// for it.
//
//   ServerThread server(&node, options, &reports);
//   server.Send("halt", "/api/v1/halt", "{}");
//
// Without a socket it publishes the diagnostics of robots only. A map is published when it has
// changed, at most five times a second, obstacles once in five seconds, diagnostics once a second,
// and a quarter of the time is spent on asking at most. Orders wait for one request at most.
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

#include "client_fw/ros2/due.h"
#include "client_fw/ros2/grid.h"
#include "client_fw/ros2/node.h"
#include "client_fw/ros2/options.h"
#include "client_fw/ros2/robot_report.h"
#include "client_fw/ros2/scene.h"
#include "server/formats/ros/names.h"
#include "server/operators/ctl/server_call.h"

namespace pheromone::ros2 {

class ServerThread {
 public:
  /// All outlive it.
  ServerThread(Node* node, const BridgeOptions& options, const RobotReports* reports);
  /// Ends after the request under way and a halt that waits, each kPatience at most. Other orders
  /// that wait are dropped, and a line says so.
  ~ServerThread();
  ServerThread(const ServerThread&) = delete;
  ServerThread& operator=(const ServerThread&) = delete;

  /// An order, of which a line tells how it ended. "halt" overtakes others, and one that waits
  /// stands for the next. Any thread.
  void Send(const std::string& name, const std::string& target, const std::string& body);

 private:
  struct Order {
    std::string name;
    std::string target;
    std::string body;
  };
  struct Layer {
    Publisher<OccupancyGrid> publisher;
    std::optional<Grid> last;
    Subscription<PointStamped> deposit;
    Subscription<Path> paint;
  };

  int64_t NowMs() const;  // since the start
  bool IsEnding();
  void Run();
  bool Wait(int64_t ms);
  void SendOrders();
  void Turn(int64_t now_ms);
  /// Sends orders that wait, then asks. Nothing if there is no such answer, with the reason noted.
  std::optional<ctl::Reply> Get(const std::string& target);
  std::optional<boost::json::value> Parse(const std::string& text);
  std::optional<boost::json::value> Ask(const std::string& target);
  void FindLayers();
  void AddLayer(const std::string& pheromone);
  /// Ends those of pheromones that the server does not have any more.
  void DropLayers(const std::vector<std::string>& pheromones);
  void PublishLayer(const std::string& pheromone, Layer* layer);
  void ReceiveOrders(const std::string& pheromone, Layer* layer);
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
  Due turns_;
  Due laws_due_;
  Due diagnostics_due_;
  ros::TopicNames names_ = ros::PheromoneNames();
  std::map<std::string, Layer> layers_;  // by pheromone; "": obstacles
  Scene scene_;
  std::string trouble_;              // why the server did not answer last; empty: it did
  bool is_unreachable_ = false;      // and will not answer anything else in this turn
  std::optional<std::string> said_;  // of it
  Publisher<MarkerArray> markers_;
  Publisher<DiagnosticArray> diagnostics_;
  Publisher<TFMessage> frames_;
  std::thread thread_;
};

}  // namespace pheromone::ros2
