// What the control interface shows of an engine: of a running server, and of one that a recording
// is replayed through.
//
// Call these while nothing changes the engine: under the service's lock.
#pragma once

#include <cstdint>
#include <vector>

#include "server/core/engine/engine.h"
#include "server/core/engine/service/traffic.h"
#include "server/operators/control/control.h"

namespace pheromone::control {

/// Adds the robots of a link that have said HELLO or were heard, by ID.
void AddClients(const engine::Engine& engine, const engine::Traffic& traffic,
                engine::LinkIndex link, uint64_t now_ms, std::vector<ClientView>* views);

/// Those of all links.
std::vector<ClientView> ClientsOf(const engine::Engine& engine, const engine::Traffic& traffic,
                                  uint64_t now_ms);

/// The engine keeps its field, once it has one.
FieldView FieldOf(const engine::Engine& engine, uint64_t now_ms);

/// The tags from a number on, at most Control::kTagsAtOnce.
TagPage TagsOf(const engine::Engine& engine, uint16_t first, uint64_t now_ms);

/// All nets, by name.
std::vector<NetView> NetsOf(const engine::Engine& engine, uint64_t now_ms);

/// Fills in what of a status follows from the engine, its robots and their traffic.
void AddEngine(const engine::Engine& engine, const engine::Traffic& traffic, StatusView* status);

}  // namespace pheromone::control
