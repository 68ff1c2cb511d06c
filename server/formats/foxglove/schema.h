// The schemas of the messages of this folder (messages.h), which viewers need to decode them: a
// protobuf FileDescriptorSet each, with the files of all messages that it contains.
//
//   channel.schema_name = kGridSchema;
//   channel.schema_encoding = "protobuf";
//   channel.schema = ToBase64(SchemaOf(kGridSchema));     // of the WebSocket protocol
//   mcap_schema.data = SchemaOf(kGridSchema);             // of MCAP
//
// Any thread.
#pragma once

#include <string>
#include <string_view>

namespace pheromone::foxglove {

constexpr std::string_view kGridSchema = "foxglove.Grid";
constexpr std::string_view kSceneUpdateSchema = "foxglove.SceneUpdate";
constexpr std::string_view kFrameTransformsSchema = "foxglove.FrameTransforms";
constexpr std::string_view kLogSchema = "foxglove.Log";
constexpr std::string_view kTilesSchema = "pheromone.Tiles";

/// The FileDescriptorSet, in bytes; `name` is one of the above.
std::string SchemaOf(std::string_view name);

}  // namespace pheromone::foxglove
