#include "server/foxglove/schema.h"

#include <algorithm>
#include <cassert>
#include <cctype>
#include <cstdint>
#include <vector>

#include "server/foxglove/protobuf.h"

namespace pheromone::foxglove {
namespace {

// "N name type": `type` is one of the scalars below, another message, or an enumeration of the same
// message, with "*" for a list.
struct MessageSpec {
  std::string_view name;
  std::vector<std::string_view> fields;
  std::string_view enum_name = {};
  std::vector<std::string_view> enum_values = {};  // from 0 on
  std::string_view package = "foxglove";
};

// Each message after those that it contains.
const std::vector<MessageSpec>& Specs() {
  static const std::vector<MessageSpec> specs = {
      {"Timestamp", {"1 seconds int64", "2 nanos int32"}, {}, {}, "google.protobuf"},
      {"Duration", {"1 seconds int64", "2 nanos int32"}, {}, {}, "google.protobuf"},
      {"Vector2", {"1 x double", "2 y double"}},
      {"Vector3", {"1 x double", "2 y double", "3 z double"}},
      {"Point3", {"1 x double", "2 y double", "3 z double"}},
      {"Quaternion", {"1 x double", "2 y double", "3 z double", "4 w double"}},
      {"Pose", {"1 position Vector3", "2 orientation Quaternion"}},
      {"Color", {"1 r double", "2 g double", "3 b double", "4 a double"}},
      {"KeyValuePair", {"1 key string", "2 value string"}},
      {"PackedElementField",
       {"1 name string", "2 offset fixed32", "3 type NumericType"},
       "NumericType",
       {"UNKNOWN", "UINT8", "INT8", "UINT16", "INT16", "UINT32", "INT32", "FLOAT32", "FLOAT64"}},
      {"Grid",
       {"1 timestamp Timestamp", "2 frame_id string", "3 pose Pose", "4 column_count fixed32",
        "5 cell_size Vector2", "6 row_stride fixed32", "7 cell_stride fixed32",
        "8 fields PackedElementField*", "9 data bytes"}},
      {"ArrowPrimitive",
       {"1 pose Pose", "2 shaft_length double", "3 shaft_diameter double", "4 head_length double",
        "5 head_diameter double", "6 color Color"}},
      {"CubePrimitive", {"1 pose Pose", "2 size Vector3", "3 color Color"}},
      {"SpherePrimitive", {"1 pose Pose", "2 size Vector3", "3 color Color"}},
      {"CylinderPrimitive",
       {"1 pose Pose", "2 size Vector3", "3 bottom_scale double", "4 top_scale double",
        "5 color Color"}},
      {"LinePrimitive",
       {"1 type Type", "2 pose Pose", "3 thickness double", "4 scale_invariant bool",
        "5 points Point3*", "6 color Color", "7 colors Color*", "8 indices fixed32*"},
       "Type",
       {"LINE_STRIP", "LINE_LOOP", "LINE_LIST"}},
      {"TriangleListPrimitive",
       {"1 pose Pose", "2 points Point3*", "3 color Color", "4 colors Color*",
        "5 indices fixed32*"}},
      {"TextPrimitive",
       {"1 pose Pose", "2 billboard bool", "3 font_size double", "4 scale_invariant bool",
        "5 color Color", "6 text string"}},
      {"ModelPrimitive",
       {"1 pose Pose", "2 scale Vector3", "3 color Color", "4 override_color bool", "5 url string",
        "6 media_type string", "7 data bytes"}},
      {"SceneEntityDeletion",
       {"1 timestamp Timestamp", "2 type Type", "3 id string"},
       "Type",
       {"MATCHING_ID", "ALL"}},
      {"SceneEntity",
       {"1 timestamp Timestamp", "2 frame_id string", "3 id string", "4 lifetime Duration",
        "5 frame_locked bool", "6 metadata KeyValuePair*", "7 arrows ArrowPrimitive*",
        "8 cubes CubePrimitive*", "9 spheres SpherePrimitive*", "10 cylinders CylinderPrimitive*",
        "11 lines LinePrimitive*", "12 triangles TriangleListPrimitive*", "13 texts TextPrimitive*",
        "14 models ModelPrimitive*"}},
      {"SceneUpdate", {"1 deletions SceneEntityDeletion*", "2 entities SceneEntity*"}},
      {"FrameTransform",
       {"1 timestamp Timestamp", "2 parent_frame_id string", "3 child_frame_id string",
        "4 translation Vector3", "5 rotation Quaternion"}},
      {"FrameTransforms", {"1 transforms FrameTransform*"}},
      {"Log",
       {"1 timestamp Timestamp", "2 level Level", "3 message string", "4 name string",
        "5 file string", "6 line fixed32"},
       "Level",
       {"UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"}},
      {"Tiles", {"1 data bytes"}, {}, {}, "pheromone"},
  };
  return specs;
}

struct Field {
  uint32_t number = 0;
  std::string_view name;
  std::string_view type;
  bool is_list = false;
};

Field ParseField(std::string_view text) {
  const size_t first = text.find(' ');
  const size_t second = text.find(' ', first + 1);
  Field field;
  for (const char digit : text.substr(0, first)) {
    field.number = field.number * 10 + static_cast<uint32_t>(digit - '0');
  }
  field.name = text.substr(first + 1, second - first - 1);
  field.type = text.substr(second + 1);
  field.is_list = field.type.ends_with('*');
  if (field.is_list) {
    field.type.remove_suffix(1);
  }
  return field;
}

// As descriptor.proto numbers them, FieldDescriptorProto.Type; 0: not a scalar.
uint32_t ScalarOf(std::string_view type) {
  struct Scalar {
    std::string_view name;
    uint32_t number;
  };
  constexpr Scalar kScalars[] = {{"double", 1}, {"int64", 3},  {"int32", 5}, {"fixed32", 7},
                                 {"bool", 8},   {"string", 9}, {"bytes", 12}};
  for (const Scalar& scalar : kScalars) {
    if (scalar.name == type) {
      return scalar.number;
    }
  }
  return 0;
}
constexpr uint32_t kMessageType = 11;
constexpr uint32_t kEnumType = 14;
constexpr uint32_t kOptional = 1;
constexpr uint32_t kRepeated = 3;

const MessageSpec* FindSpec(std::string_view name) {
  const auto& specs = Specs();
  const auto found = std::find_if(specs.begin(), specs.end(),
                                  [name](const MessageSpec& it) { return it.name == name; });
  return found != specs.end() ? &*found : nullptr;
}

// As protoc finds them: "foxglove/Grid.proto", "google/protobuf/timestamp.proto".
std::string FileOf(const MessageSpec& spec) {
  if (spec.package != "google.protobuf") {
    return std::string(spec.package) + "/" + std::string(spec.name) + ".proto";
  }
  std::string name(spec.name);
  name[0] = static_cast<char>(std::tolower(name[0]));
  return "google/protobuf/" + name + ".proto";
}

std::string FullName(const MessageSpec& spec) {
  return "." + std::string(spec.package) + "." + std::string(spec.name);
}

// The messages that are fields of one, each once, in the order of the table.
std::vector<const MessageSpec*> PartsOf(const MessageSpec& spec) {
  std::vector<const MessageSpec*> parts;
  for (const std::string_view field : spec.fields) {
    const MessageSpec* const part = FindSpec(ParseField(field).type);
    if (part != nullptr && std::find(parts.begin(), parts.end(), part) == parts.end()) {
      parts.push_back(part);
    }
  }
  std::sort(parts.begin(), parts.end());  // all are elements of one vector
  return parts;
}

// "frame_id" is "frameId" in JSON; protoc always says so.
std::string JsonName(std::string_view name) {
  std::string text;
  bool raise = false;
  for (const char c : name) {
    if (c == '_') {
      raise = true;
    } else {
      text += raise ? static_cast<char>(std::toupper(c)) : c;
      raise = false;
    }
  }
  return text;
}

void WriteField(const MessageSpec& spec, const Field& field, ProtobufWriter* writer) {
  writer->Text(1, field.name);
  writer->Varint(3, field.number);
  writer->Varint(4, field.is_list ? kRepeated : kOptional);
  if (const uint32_t scalar = ScalarOf(field.type); scalar != 0) {
    writer->Varint(5, scalar);
  } else if (field.type == spec.enum_name) {
    writer->Varint(5, kEnumType);
    writer->Text(6, FullName(spec) + "." + std::string(spec.enum_name));
  } else {
    const MessageSpec* const part = FindSpec(field.type);
    assert(part != nullptr);
    writer->Varint(5, kMessageType);
    writer->Text(6, FullName(*part));
  }
  writer->Text(10, JsonName(field.name));
}

void WriteMessage(const MessageSpec& spec, ProtobufWriter* writer) {
  writer->Text(1, spec.name);
  for (const std::string_view text : spec.fields) {
    writer->Message(2, [&](ProtobufWriter& it) { WriteField(spec, ParseField(text), &it); });
  }
  if (!spec.enum_name.empty()) {
    writer->Message(4, [&](ProtobufWriter& it) {
      it.Text(1, spec.enum_name);
      for (size_t i = 0; i < spec.enum_values.size(); ++i) {
        it.Message(2, [&](ProtobufWriter& value) {
          value.Text(1, spec.enum_values[i]);
          value.EvenZero(2, i);
        });
      }
    });
  }
}

std::string DescribeFile(const MessageSpec& spec) {
  ProtobufWriter file;
  file.Text(1, FileOf(spec));
  file.Text(2, spec.package);
  for (const MessageSpec* part : PartsOf(spec)) {
    file.Text(3, FileOf(*part));
  }
  file.Message(4, [&](ProtobufWriter& it) { WriteMessage(spec, &it); });
  file.Text(12, "proto3");
  return file.Take();
}

void CollectParts(const MessageSpec& spec, std::vector<const MessageSpec*>* all) {
  if (std::find(all->begin(), all->end(), &spec) == all->end()) {
    all->push_back(&spec);
    for (const MessageSpec* part : PartsOf(spec)) {
      CollectParts(*part, all);
    }
  }
}

}  // namespace

std::string SchemaOf(std::string_view name) {
  name.remove_prefix(name.rfind('.') + 1);
  const MessageSpec* const spec = FindSpec(name);
  assert(spec != nullptr);
  std::vector<const MessageSpec*> all;
  CollectParts(*spec, &all);
  std::sort(all.begin(), all.end());  // elements of one vector: a file after those it imports
  ProtobufWriter set;
  for (const MessageSpec* it : all) {
    set.Element(1, DescribeFile(*it));
  }
  return set.Take();
}

}  // namespace pheromone::foxglove
