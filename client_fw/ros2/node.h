// A ROS 2 node on Cyclone DDS, without any library of ROS: topics with ROS's names, QoS and type
// hashes, and the graph by which `ros2 node list` knows the node.
//
//   Result<std::unique_ptr<Node>> node = Node::Create(discovery, Distro::kAuto);
//   Publisher<Twist> speed = node.value()->Advertise<Twist>("/tb1/cmd_vel", Quality::kOrders);
//   Subscription<Odometry> odom = node.value()->Subscribe<Odometry>("/tb1/odom", Quality::kSensor);
//   if (!node.value()->status().ok()) ...                 // one of them could not be made
//   for (;;) {
//     node.value()->Step();                               // the graph
//     odom.Receive([](const Odometry& message) { ... });
//     speed.Publish(message);
//   }
//
// The GIDs of the graph have 24 bytes in Humble and 16 from Iron on, and a node with the wrong size
// is not understood. Distro::kAuto waits until another node shows which it is: until then all
// topics work, but the node is not listed.
//
// Nothing but Withdraw and Flush waits for a reader for more than a millisecond. All functions of
// Node and Publish may be called by any thread; a subscription belongs to one. A node outlives what
// it made.
#pragma once

#include <dds/dds.h>

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "client_fw/ros2/environment.h"
#include "client_fw/ros2/message_kinds.h"
#include "server/base/result.h"

namespace pheromone::ros2 {

enum class Distro : uint8_t { kAuto, kHumble, kIron };  ///< kIron: and later

enum class Quality : uint8_t {
  kLatched,  ///< reliable, transient local, the last one: maps
  kOrders,   ///< reliable, the last one to send, ten to receive: what must arrive
  kMany,     ///< to receive: reliable, the last hundred
  kSensor,   ///< to receive: best effort, the last one; matches every publisher
  kFrames,   ///< to receive: best effort, the last hundred: /tf
  kStatic,   ///< to receive: reliable, transient local, the last hundred: /tf_static
};

/// "rt/tb1/odom" of "/tb1/odom".
std::string DdsTopic(std::string_view ros_topic);
/// Whether ROS allows it in a name of a topic or namespace, such as "tb1" or "lab/tb1".
bool IsRosName(std::string_view name);

template <class Message>
class Publisher {
 public:
  Publisher() = default;
  explicit Publisher(dds_entity_t writer) : writer_(writer) {}
  void Publish(const Message& message) const {
    if (writer_ > 0) {
      dds_write(writer_, &message);  // a reader that has no room gets the next one
    }
  }
  bool exists() const { return writer_ > 0; }
  dds_entity_t entity() const { return writer_; }

 private:
  dds_entity_t writer_ = 0;
};

template <class Message>
class Subscription {
 public:
  Subscription() = default;
  explicit Subscription(dds_entity_t reader) : reader_(reader) {}
  /// Calls `handle` with each message that has come.
  template <class Handler>
  void Receive(Handler handle) {
    constexpr size_t kMax = 16;
    std::array<void*, kMax> samples{};
    std::array<dds_sample_info_t, kMax> infos{};
    const int32_t count =
        reader_ > 0 ? dds_take(reader_, samples.data(), infos.data(), kMax, kMax) : 0;
    for (int32_t i = 0; i < count; ++i) {
      if (infos[static_cast<size_t>(i)].valid_data) {
        handle(*static_cast<const Message*>(samples[static_cast<size_t>(i)]));
      }
    }
    if (count > 0) {
      dds_return_loan(reader_, samples.data(), count);
    }
  }
  dds_entity_t entity() const { return reader_; }

 private:
  dds_entity_t reader_ = 0;
};

class Node {
 public:
  /// A node "/pheromone". Error: the configuration of Cyclone DDS, or the network.
  static Result<std::unique_ptr<Node>> Create(const Discovery& discovery, Distro distro);
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  template <class Message>
  Publisher<Message> Advertise(const std::string& topic, Quality quality) {
    return Publisher<Message>(
        Make(true, topic, Kind<Message>::descriptor(), Kind<Message>::kHash, quality));
  }
  template <class Message>
  Subscription<Message> Subscribe(const std::string& topic, Quality quality) {
    return Subscription<Message>(
        Make(false, topic, Kind<Message>::descriptor(), Kind<Message>::kHash, quality));
  }

  /// Ends what this node made; its copies are not to be used any more. Nothing if there is none.
  /// Waits for readers that have not acknowledged, and holds up nobody else.
  template <class Endpoint>
  void Withdraw(const Endpoint& endpoint) {
    Delete(endpoint.entity());
  }

  /// Publishes the graph when it has changed; to be called some ten times a second.
  void Step();

  /// Why the first endpoint that could not be made could not.
  Status status() const;
  /// Waits until readers have what was published, for at most `ms`.
  void Flush(int64_t ms);

 private:
  Node(dds_entity_t domain, dds_entity_t participant, Distro distro);
  dds_entity_t Make(bool writer, const std::string& topic, const dds_topic_descriptor_t* descriptor,
                    const char* hash, Quality quality);
  void Delete(dds_entity_t entity);
  void FindDistro();
  void AdvertiseGraph();
  template <class Info>
  void PublishGraph();

  mutable std::mutex mutex_;
  const dds_entity_t domain_;
  const dds_entity_t participant_;
  dds_entity_t publications_ = 0;  // what others publish
  dds_entity_t graph_ = 0;
  Distro distro_;
  bool changed_ = true;
  std::vector<dds_guid_t> readers_;
  std::vector<dds_guid_t> writers_;
  std::vector<dds_entity_t> entities_;  // the writers
  std::string trouble_;
};

}  // namespace pheromone::ros2
