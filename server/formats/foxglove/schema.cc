#include "server/formats/foxglove/schema.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <cassert>
#include <set>

#include "server/formats/foxglove/messages.h"
#include "server/formats/foxglove/tiles.pb.h"

namespace pheromone::foxglove {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FileDescriptor;
using google::protobuf::FileDescriptorSet;

const Descriptor* Find(std::string_view name) {
  for (const Descriptor* message :
       {::foxglove::Grid::descriptor(), SceneUpdate::descriptor(), FrameTransforms::descriptor(),
        Log::descriptor(), Tiles::descriptor()}) {
    if (message->full_name() == name) {
      return message;
    }
  }
  return nullptr;
}

// Each file once, after those that it imports.
void Add(const FileDescriptor& file, std::set<const FileDescriptor*>* added,
         FileDescriptorSet* set) {
  if (!added->insert(&file).second) {
    return;
  }
  for (int i = 0; i < file.dependency_count(); ++i) {
    Add(*file.dependency(i), added, set);
  }
  auto* const copy = set->add_file();
  file.CopyTo(copy);
  file.CopyJsonNameTo(copy);
}

}  // namespace

std::string SchemaOf(std::string_view name) {
  const Descriptor* const message = Find(name);
  assert(message != nullptr);
  std::set<const FileDescriptor*> added;
  FileDescriptorSet set;
  Add(*message->file(), &added, &set);
  return set.SerializeAsString();
}

}  // namespace pheromone::foxglove
