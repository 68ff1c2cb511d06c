// Prints each schema and a message of each, in hexadecimal, for schema_test.py: lines "schema NAME
// HEX" and "message NAME HEX".
#include <cstdio>
#include <string>
#include <string_view>

#include "server/foxglove/messages.h"
#include "server/foxglove/protobuf.h"
#include "server/foxglove/scene.h"
#include "server/foxglove/schema.h"

namespace pheromone::foxglove {
namespace {

void Print(const char* what, std::string_view name, std::string_view bytes) {
  std::string line = std::string(what) + ' ' + std::string(name) + ' ';
  constexpr std::string_view kDigits = "0123456789abcdef";
  for (const char c : bytes) {
    line += kDigits[static_cast<unsigned char>(c) >> 4];
    line += kDigits[static_cast<unsigned char>(c) & 15];
  }
  std::puts(line.c_str());
}

void PrintAll() {
  for (const std::string_view name :
       {kGridSchema, kSceneUpdateSchema, kFrameTransformsSchema, kLogSchema, kTilesSchema}) {
    Print("schema", name, SchemaOf(name));
  }
  constexpr uint64_t kTime = 1'700'000'000'000'000'007;
  const std::string cells("\x00\x01\xFE\xFF\x00\x07", 6);
  Print("message", kGridSchema,
        Encode(Grid{.time_ns = kTime,
                    .corner = {{-0.25, 1.5, 0}, 0},
                    .columns = 3,
                    .cell_m = 0.05,
                    .meaning = "254 = 0.5 units",
                    .data = cells}));
  SceneUpdate update{.time_ns = kTime, .delete_all = true, .deleted = {"radio-a/9"}};
  update.entities.push_back(RobotEntity({.link = "radio-a",
                                         .id = 7,
                                         .pose = {{1, 2, 0}, 1.5707963267948966},
                                         .left = {0.8, 2, 0},
                                         .right = {1.2, 2, 0},
                                         .facts = {{"law", "eq6"}}}));
  update.entities.push_back(TrailEntity("radio-a", 7, {{1, 1, 0}, {1, 2, 0}}));
  update.entities.push_back(PlaceEntity("door", "the door", {3, 4, 0}, 0.5, {1, 0, 0, 1}));
  Print("message", kSceneUpdateSchema, Encode(update));
  Print("message", kFrameTransformsSchema,
        Encode(FrameTransforms{.time_ns = kTime,
                               .transforms = {{.child = RobotFrame("radio-a", 7),
                                               .pose = {{1, 2, 0}, 3.141592653589793}}}}));
  Print("message", kLogSchema,
        Encode(Log{.time_ns = kTime,
                   .level = LogLevel::kWarning,
                   .message = "link radio-a is down",
                   .name = "link"}));
  ProtobufWriter tiles;
  std::string data;
  for (int i = 0; i < 100; ++i) {
    data += "tiles";
  }
  tiles.Text(1, data);
  Print("message", kTilesSchema, tiles.Take());
}

}  // namespace
}  // namespace pheromone::foxglove

int main() {
  pheromone::foxglove::PrintAll();
}
