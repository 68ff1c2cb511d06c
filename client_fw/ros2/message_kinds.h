// The messages by short names, each with its DDS type and its hash (REP-2011), by which ROS 2 from
// Iron on tells types apart. type_hash_test.py computes the hashes from messages.idl.
#pragma once

#include <ros2_messages/messages.h>

namespace pheromone::ros2 {

/// Of a message: `descriptor()` and `kHash`.
template <class Message>
struct Kind;

// PHEROMONE_KIND(package, name, hash)
// NOLINTBEGIN(bugprone-macro-parentheses): names of types
#define PHEROMONE_KIND(package, name, hash)              \
  using name = package##_msg_dds__##name##_;             \
  template <>                                            \
  struct Kind<name> {                                    \
    static constexpr const char* kHash = "RIHS01_" hash; \
    static const dds_topic_descriptor_t* descriptor() {  \
      return &package##_msg_dds__##name##__desc;         \
    }                                                    \
  };
// NOLINTEND(bugprone-macro-parentheses)

PHEROMONE_KIND(std_msgs, Bool, "feb91e995ff9ebd09c0cb3d2aed18b11077585839fb5db80193b62d74528f6c9")
PHEROMONE_KIND(std_msgs, Empty, "20b625256f32d5dbc0d04fee44f43c41e51c70d3502f84b4a08e7a9c26a96312")
PHEROMONE_KIND(std_msgs, Float32MultiArray,
               "0599f6f85b4bfca379873a0b4375a0aca022156bd2d7021275d116ed1fa8bfe0")
PHEROMONE_KIND(geometry_msgs, PointStamped,
               "4c0296af86e01e562e9e0405d138a01537247580076c58ea38d7923ac1045897")
PHEROMONE_KIND(geometry_msgs, PoseStamped,
               "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8")
PHEROMONE_KIND(geometry_msgs, PoseWithCovarianceStamped,
               "26432f9803e43727d3c8f668d1fdb3c630f548af631e2f4e31382371bfea3b6e")
PHEROMONE_KIND(geometry_msgs, Twist,
               "9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a")
PHEROMONE_KIND(geometry_msgs, TwistStamped,
               "5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64")
PHEROMONE_KIND(nav_msgs, OccupancyGrid,
               "8d348150c12913a31ee0ec170fbf25089e4745d17035792a1ba94d6f0bc0cfc7")
PHEROMONE_KIND(nav_msgs, Odometry,
               "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0")
PHEROMONE_KIND(nav_msgs, Path, "1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b")
PHEROMONE_KIND(tf2_msgs, TFMessage,
               "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087")
PHEROMONE_KIND(diagnostic_msgs, DiagnosticArray,
               "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e")
PHEROMONE_KIND(visualization_msgs, MarkerArray,
               "86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf")
PHEROMONE_KIND(rmw_dds_common, ParticipantEntitiesInfo,
               "91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e")
#undef PHEROMONE_KIND

/// Of Humble, with GIDs of 24 bytes; it has no hashes.
using HumbleParticipantEntitiesInfo = rmw_dds_common_humble_msg_dds__ParticipantEntitiesInfo_;

/// Lets a sequence of a message point at the items of a vector, which has to outlive it.
template <class Sequence, class Items>
void PointAt(Sequence* sequence, Items* items) {
  sequence->_buffer = items->data();
  sequence->_length = sequence->_maximum = static_cast<uint32_t>(items->size());
  sequence->_release = false;
}

}  // namespace pheromone::ros2
