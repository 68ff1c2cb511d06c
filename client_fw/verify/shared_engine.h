// The engine in one of its states, for searches: the states of a search that have the same engine
// share it, and what follows from a request is worked out once and kept to the search's end.
//
//   std::shared_ptr<const SharedEngine> server = SharedEngine::Of(std::move(engine));
//   std::vector<engine::Outgoing> out;
//   server = server->After(0, request, &out);   // a request of Handling::kChange
//
// Copying maps would otherwise take most of the time of a search. Not thread-safe.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "protocol/messages.h"
#include "server/core/engine/engine.h"

namespace pheromone::verify {

class SharedEngine {
 public:
  /// What a mutant does to the engine before it applies a request. Null: nothing.
  using Mutation = void (*)(const protocol::Message& request, engine::Engine* engine);

  static std::shared_ptr<const SharedEngine> Of(engine::Engine engine,
                                                Mutation mutation = nullptr) {
    return std::make_shared<const SharedEngine>(std::move(engine), mutation);
  }
  SharedEngine(engine::Engine engine, Mutation mutation)
      : engine_(std::move(engine)), mutation_(mutation) {}

  const engine::Engine& operator*() const { return engine_; }
  const engine::Engine* operator->() const { return &engine_; }

  /// The state after a request; appends what is sent.
  std::shared_ptr<const SharedEngine> After(engine::LinkIndex link,
                                            const protocol::Message& request,
                                            std::vector<engine::Outgoing>* out) const;

 private:
  struct Successor {
    std::shared_ptr<const SharedEngine> server;
    std::vector<engine::Outgoing> out;
  };

  engine::Engine engine_;
  Mutation mutation_;
  mutable std::map<std::string, Successor> successors_;  // by link and request
};

}  // namespace pheromone::verify
