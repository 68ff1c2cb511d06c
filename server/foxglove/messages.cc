#include "server/foxglove/messages.h"

#include <cmath>

#include "server/foxglove/protobuf.h"

namespace pheromone::foxglove {
namespace {

constexpr uint64_t kNsPerS = 1'000'000'000;
constexpr uint64_t kUint8 = 1;  // PackedElementField.NumericType

// A Timestamp or a Duration.
void WriteTime(uint32_t field, uint64_t ns, ProtobufWriter* to) {
  to->Message(field, [ns](ProtobufWriter& it) {
    it.Varint(1, ns / kNsPerS);
    it.Varint(2, ns % kNsPerS);
  });
}

// A Vector2, Vector3 or Point3.
void WritePoint(uint32_t field, const Point& point, ProtobufWriter* to) {
  to->Message(field, [&](ProtobufWriter& it) {
    it.Double(1, point.x);
    it.Double(2, point.y);
    it.Double(3, point.z);
  });
}

void WriteQuaternion(uint32_t field, double yaw_rad, ProtobufWriter* to) {
  to->Message(field, [yaw_rad](ProtobufWriter& it) {
    it.Double(3, std::sin(yaw_rad / 2));
    it.Double(4, std::cos(yaw_rad / 2));
  });
}

void WritePose(uint32_t field, const Pose& pose, ProtobufWriter* to) {
  to->Message(field, [&](ProtobufWriter& it) {
    WritePoint(1, pose.position, &it);
    WriteQuaternion(2, pose.yaw_rad, &it);
  });
}

void WriteColour(uint32_t field, const Colour& colour, ProtobufWriter* to) {
  to->Message(field, [&](ProtobufWriter& it) {
    it.Double(1, colour.r);
    it.Double(2, colour.g);
    it.Double(3, colour.b);
    it.Double(4, colour.a);
  });
}

void Write(const Arrow& arrow, ProtobufWriter* to) {
  WritePose(1, arrow.tail, to);
  to->Double(2, arrow.shaft_length);
  to->Double(3, arrow.shaft_diameter);
  to->Double(4, arrow.head_length);
  to->Double(5, arrow.head_diameter);
  WriteColour(6, arrow.colour, to);
}

void Write(const Sphere& sphere, ProtobufWriter* to) {
  WritePose(1, {sphere.centre}, to);
  WritePoint(2, {sphere.diameter, sphere.diameter, sphere.diameter}, to);
  WriteColour(3, sphere.colour, to);
}

void Write(const LineStrip& line, ProtobufWriter* to) {
  to->Varint(1, line.closed ? 1 : 0);
  WritePose(2, {}, to);
  to->Double(3, line.thickness);
  to->Bool(4, line.in_pixels);
  for (const Point& point : line.points) {
    WritePoint(5, point, to);
  }
  WriteColour(6, line.colour, to);
}

void Write(const Text& text, ProtobufWriter* to) {
  WritePose(1, {text.centre}, to);
  to->Bool(2, true);
  to->Double(3, text.font_size);
  to->Bool(4, text.in_pixels);
  WriteColour(5, text.colour, to);
  to->Text(6, text.text);
}

template <typename Item>
void WriteList(uint32_t field, const std::vector<Item>& items, ProtobufWriter* to) {
  for (const Item& item : items) {
    to->Message(field, [&](ProtobufWriter& it) { Write(item, &it); });
  }
}

void WriteEntity(const Entity& entity, uint64_t time_ns, ProtobufWriter* to) {
  WriteTime(1, time_ns, to);
  to->Text(2, entity.frame);
  to->Text(3, entity.id);
  WriteTime(4, entity.lifetime_ns, to);
  for (const auto& [key, value] : entity.metadata) {
    to->Message(6, [&key = key, &value = value](ProtobufWriter& it) {
      it.Text(1, key);
      it.Text(2, value);
    });
  }
  WriteList(7, entity.arrows, to);
  WriteList(9, entity.spheres, to);
  WriteList(11, entity.lines, to);
  WriteList(13, entity.texts, to);
}

}  // namespace

std::string Encode(const Grid& grid) {
  ProtobufWriter to;
  to.Reserve(grid.data.size() + 256);
  WriteTime(1, grid.time_ns, &to);
  to.Text(2, kMapFrame);
  WritePose(3, grid.corner, &to);
  to.Fixed32(4, grid.columns);
  WritePoint(5, {grid.cell_m, grid.cell_m}, &to);
  to.Fixed32(6, grid.columns);
  to.Fixed32(7, 1);
  for (const std::string_view name : {grid.field, grid.meaning}) {
    if (!name.empty()) {
      to.Message(8, [name](ProtobufWriter& it) {
        it.Text(1, name);
        it.Varint(3, kUint8);
      });
    }
  }
  to.Text(9, grid.data);
  return to.Take();
}

std::string Encode(const SceneUpdate& update) {
  ProtobufWriter to;
  const auto write_deletion = [&](uint64_t type, std::string_view id) {
    to.Message(1, [&](ProtobufWriter& it) {
      WriteTime(1, update.time_ns, &it);
      it.Varint(2, type);
      it.Text(3, id);
    });
  };
  if (update.delete_all) {
    write_deletion(1, "");
  }
  for (const std::string& id : update.deleted) {
    write_deletion(0, id);
  }
  for (const Entity& entity : update.entities) {
    to.Message(2, [&](ProtobufWriter& it) { WriteEntity(entity, update.time_ns, &it); });
  }
  return to.Take();
}

std::string Encode(const FrameTransforms& transforms) {
  ProtobufWriter to;
  for (const FrameTransform& transform : transforms.transforms) {
    to.Message(1, [&](ProtobufWriter& it) {
      WriteTime(1, transforms.time_ns, &it);
      it.Text(2, transform.parent);
      it.Text(3, transform.child);
      WritePoint(4, transform.pose.position, &it);
      WriteQuaternion(5, transform.pose.yaw_rad, &it);
    });
  }
  return to.Take();
}

std::string Encode(const Log& log) {
  ProtobufWriter to;
  WriteTime(1, log.time_ns, &to);
  to.Varint(2, static_cast<uint64_t>(log.level));
  to.Text(3, log.message);
  to.Text(4, log.name);
  return to.Take();
}

}  // namespace pheromone::foxglove
