// Prints each schema and a message of each, in hexadecimal, for schema_test.py: lines "schema NAME
// HEX" and "message NAME HEX".
#include <cstdio>
#include <string>
#include <string_view>

#include "server/formats/foxglove/messages.h"
#include "server/formats/foxglove/scene.h"
#include "server/formats/foxglove/schema.h"

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
        EncodeGrid(kTime,
                   {.corner = {-0.25, 1.5, 0},
                    .columns = 3,
                    .cell_m = 0.05,
                    .names = {"level", "254 = 0.5 units"}},
                   cells));
  SceneUpdate update;
  AddDeletionOfAll(kTime, &update);
  AddDeletion("radio-a/9", kTime, &update);
  AddRobot({.link = "radio-a",
            .id = 7,
            .pose = {{1, 2, 0}, 1.5707963267948966},
            .left = {0.8, 2, 0},
            .right = {1.2, 2, 0},
            .facts = {{"law", "eq6"}}},
           kTime, &update);
  AddTrail("radio-a", 7, {{1, 1, 0}, {1, 2, 0}}, kTime, &update);
  AddPlace({"door", "the door", {3, 4, 0}, 0.5, {1, 0, 0, 1}}, kTime, &update);
  Print("message", kSceneUpdateSchema, update.SerializeAsString());
  FrameTransforms transforms;
  AddTransform(std::string(kMapFrame), RobotFrame("radio-a", 7), {{1, 2, 0}, 3.141592653589793},
               kTime, &transforms);
  Print("message", kFrameTransformsSchema, transforms.SerializeAsString());
  Print("message", kLogSchema,
        MakeLog(Log::WARNING, "link", "link radio-a is down", kTime).SerializeAsString());
  std::string data;
  for (int i = 0; i < 100; ++i) {
    data += "tiles";
  }
  Print("message", kTilesSchema, EncodeTiles(data));
}

}  // namespace
}  // namespace pheromone::foxglove

int main() {
  pheromone::foxglove::PrintAll();
}
