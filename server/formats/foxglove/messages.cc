#include "server/formats/foxglove/messages.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <array>
#include <cmath>
#include <utility>

#include "server/formats/foxglove/tiles.pb.h"

namespace pheromone::foxglove {
namespace {

constexpr uint64_t kNsPerS = 1'000'000'000;

void Set(uint64_t ns, google::protobuf::Timestamp* to) {
  to->set_seconds(static_cast<int64_t>(ns / kNsPerS));
  to->set_nanos(static_cast<int32_t>(ns % kNsPerS));
}

void Set(double yaw_rad, ::foxglove::Quaternion* to) {
  to->set_z(std::sin(yaw_rad / 2));
  to->set_w(std::cos(yaw_rad / 2));
}

// The last field of a message, which is large: it is copied once, not into the message first.
void AppendBytes(int field, std::string_view bytes, std::string* to) {
  using google::protobuf::internal::WireFormatLite;
  using google::protobuf::io::CodedOutputStream;
  if (bytes.empty()) {
    return;
  }
  std::array<uint8_t, 10> head{};
  uint8_t* end = CodedOutputStream::WriteTagToArray(
      WireFormatLite::MakeTag(field, WireFormatLite::WIRETYPE_LENGTH_DELIMITED), head.data());
  end = CodedOutputStream::WriteVarint32ToArray(static_cast<uint32_t>(bytes.size()), end);
  to->append(head.data(), end);
  to->append(bytes);
}

}  // namespace

void Set(const Point& point, ::foxglove::Vector3* to) {
  to->set_x(point.x);
  to->set_y(point.y);
  to->set_z(point.z);
}

void Set(const Pose& pose, ::foxglove::Pose* to) {
  Set(pose.position, to->mutable_position());
  Set(pose.yaw_rad, to->mutable_orientation());
}

std::string EncodeGrid(uint64_t time_ns, const GridLayout& layout, std::string_view cells) {
  ::foxglove::Grid grid;
  Set(time_ns, grid.mutable_timestamp());
  grid.set_frame_id(std::string(kMapFrame));
  Set(Pose{layout.corner}, grid.mutable_pose());
  grid.set_column_count(layout.columns);
  grid.mutable_cell_size()->set_x(layout.cell_m);
  grid.mutable_cell_size()->set_y(layout.cell_m);
  grid.set_row_stride(layout.columns);
  grid.set_cell_stride(1);
  for (const std::string& name : layout.names) {
    auto* const field = grid.add_fields();
    field->set_name(name);
    field->set_type(::foxglove::PackedElementField::UINT8);
  }
  std::string encoded;
  encoded.reserve(cells.size() + 256);
  grid.AppendToString(&encoded);
  AppendBytes(::foxglove::Grid::kDataFieldNumber, cells, &encoded);
  return encoded;
}

std::string EncodeTiles(std::string_view data) {
  std::string encoded;
  encoded.reserve(data.size() + 16);
  AppendBytes(Tiles::kDataFieldNumber, data, &encoded);
  return encoded;
}

SceneEntity* AddEntity(std::string id, uint64_t time_ns, SceneUpdate* update) {
  SceneEntity* const entity = update->add_entities();
  Set(time_ns, entity->mutable_timestamp());
  entity->set_frame_id(std::string(kMapFrame));
  entity->set_id(std::move(id));
  entity->mutable_lifetime();  // 0: until it is replaced or deleted
  return entity;
}

void AddDeletion(std::string id, uint64_t time_ns, SceneUpdate* update) {
  auto* const deletion = update->add_deletions();
  Set(time_ns, deletion->mutable_timestamp());
  deletion->set_id(std::move(id));
}

void AddDeletionOfAll(uint64_t time_ns, SceneUpdate* update) {
  auto* const deletion = update->add_deletions();
  Set(time_ns, deletion->mutable_timestamp());
  deletion->set_type(::foxglove::SceneEntityDeletion::ALL);
}

void AddTransform(std::string parent, std::string child, const Pose& pose, uint64_t time_ns,
                  FrameTransforms* transforms) {
  auto* const transform = transforms->add_transforms();
  Set(time_ns, transform->mutable_timestamp());
  transform->set_parent_frame_id(std::move(parent));
  transform->set_child_frame_id(std::move(child));
  Set(pose.position, transform->mutable_translation());
  Set(pose.yaw_rad, transform->mutable_rotation());
}

Log MakeLog(Log::Level level, std::string name, std::string message, uint64_t time_ns) {
  Log log;
  Set(time_ns, log.mutable_timestamp());
  log.set_level(level);
  log.set_message(std::move(message));
  log.set_name(std::move(name));
  return log;
}

}  // namespace pheromone::foxglove
