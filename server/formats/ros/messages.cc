#include "server/formats/ros/messages.h"

#include <bit>
#include <cmath>
#include <initializer_list>

namespace pheromone::ros {
namespace {

constexpr uint64_t kNsPerSecond = 1'000'000'000;
constexpr std::string_view kFrame = "map";

// The fields of each type, as in ROS 2 since Foxy; their comments are left out.
struct Definition {
  std::string_view name;
  std::string_view fields;
};
constexpr Definition kTime{"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"};
constexpr Definition kHeader{"std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"};
constexpr Definition kPoint{"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"};
constexpr Definition kQuaternion{"geometry_msgs/Quaternion",
                                 "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"};
constexpr Definition kPose{"geometry_msgs/Pose",
                           "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"};
constexpr Definition kVector{"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"};
constexpr Definition kTransform{
    "geometry_msgs/Transform",
    "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"};
constexpr Definition kStamped{
    "geometry_msgs/TransformStamped",
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"};
constexpr Definition kMetaData{
    "nav_msgs/MapMetaData",
    "builtin_interfaces/Time map_load_time\nfloat32 resolution\nuint32 width\nuint32 height\n"
    "geometry_msgs/Pose origin\n"};

std::string WithParts(std::string_view fields, std::initializer_list<Definition> parts) {
  std::string text(fields);
  for (const Definition& part : parts) {
    text.append(80, '=').append("\nMSG: ").append(part.name).append("\n").append(part.fields);
  }
  return text;
}

// Plain CDR (XCDR1): each number is aligned to its size, counted from the end of the header.
class Cdr {
 public:
  void U32(uint32_t value) { Number(value, sizeof(value)); }
  void F32(float value) { U32(std::bit_cast<uint32_t>(value)); }
  void F64(double value) { Number(std::bit_cast<uint64_t>(value), sizeof(value)); }
  // With a zero byte at its end, which counts.
  void Text(std::string_view text) {
    U32(static_cast<uint32_t>(text.size() + 1));
    bytes_.append(text).push_back('\0');
  }
  void Bytes(std::string_view bytes) {
    U32(static_cast<uint32_t>(bytes.size()));
    bytes_ += bytes;
  }

  void Time(uint64_t time_ns) {
    U32(static_cast<uint32_t>(time_ns / kNsPerSecond));
    U32(static_cast<uint32_t>(time_ns % kNsPerSecond));
  }
  void Header(uint64_t time_ns) {
    Time(time_ns);
    Text(kFrame);
  }
  // Also that of a geometry_msgs/Transform.
  void Pose(const ros::Pose& pose) {
    for (const double part : {pose.x_m, pose.y_m, 0.0, 0.0, 0.0, std::sin(pose.yaw_rad / 2),
                              std::cos(pose.yaw_rad / 2)}) {
      F64(part);
    }
  }
  std::string Finish() { return std::move(bytes_); }

 private:
  static constexpr std::string_view kLittleEndian{"\0\1\0\0", 4};

  void Number(uint64_t value, size_t size) {
    while ((bytes_.size() - kLittleEndian.size()) % size != 0) {
      bytes_.push_back('\0');
    }
    for (size_t i = 0; i < size; ++i) {
      bytes_.push_back(static_cast<char>(value >> (8 * i) & 0xFF));
    }
  }

  std::string bytes_{kLittleEndian};
};

}  // namespace

std::string DefinitionOf(std::string_view type) {
  if (type == kOccupancyGrid) {
    return WithParts("std_msgs/Header header\nnav_msgs/MapMetaData info\nint8[] data\n",
                     {kHeader, kTime, kMetaData, kPose, kPoint, kQuaternion});
  }
  if (type == kPoseStamped) {
    return WithParts("std_msgs/Header header\ngeometry_msgs/Pose pose\n",
                     {kHeader, kTime, kPose, kPoint, kQuaternion});
  }
  return WithParts("geometry_msgs/TransformStamped[] transforms\n",
                   {kStamped, kHeader, kTime, kTransform, kVector, kQuaternion});
}

std::string EncodeGrid(uint64_t time_ns, const GridLayout& layout, std::string_view cells) {
  Cdr cdr;
  cdr.Header(time_ns);
  cdr.Time(time_ns);  // map_load_time
  cdr.F32(static_cast<float>(layout.cell_m));
  cdr.U32(layout.columns);
  cdr.U32(static_cast<uint32_t>(cells.size() / layout.columns));
  cdr.Pose({.x_m = layout.x_m, .y_m = layout.y_m});
  cdr.Bytes(cells);
  return cdr.Finish();
}

std::string EncodePose(uint64_t time_ns, const Pose& pose) {
  Cdr cdr;
  cdr.Header(time_ns);
  cdr.Pose(pose);
  return cdr.Finish();
}

std::string EncodeTransforms(uint64_t time_ns, const std::vector<Transform>& transforms) {
  Cdr cdr;
  cdr.U32(static_cast<uint32_t>(transforms.size()));
  for (const Transform& transform : transforms) {
    cdr.Header(time_ns);
    cdr.Text(transform.child);
    cdr.Pose(transform.pose);
  }
  return cdr.Finish();
}

}  // namespace pheromone::ros
