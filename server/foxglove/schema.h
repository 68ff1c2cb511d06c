// The schemas of the messages of this folder (messages.h), which viewers need to decode them: a
// protobuf FileDescriptorSet each, with the files of all messages that it contains. They are
// described by a table of fields (schema.cc) and encoded here, so that nothing needs protoc.
//
//   channel.schema_name = kGridSchema;
//   channel.schema_encoding = "protobuf";
//   channel.schema = ToBase64(SchemaOf(kGridSchema));     // of the WebSocket protocol
//   mcap_schema.data = SchemaOf(kGridSchema);             // of MCAP
//
// The messages are those that Foxglove publishes as its well-known schemas
// (docs.foxglove.dev/docs/visualization/message-schemas), and one of our own. Any thread.
#pragma once

#include <string>
#include <string_view>

namespace pheromone::foxglove {

constexpr std::string_view kGridSchema = "foxglove.Grid";
constexpr std::string_view kSceneUpdateSchema = "foxglove.SceneUpdate";
constexpr std::string_view kFrameTransformsSchema = "foxglove.FrameTransforms";
constexpr std::string_view kLogSchema = "foxglove.Log";
/// Our own: field 1 has the bytes of a message of another format.
constexpr std::string_view kTilesSchema = "pheromone.Tiles";

/// The FileDescriptorSet, in bytes; `name` is one of the above.
std::string SchemaOf(std::string_view name);

}  // namespace pheromone::foxglove
