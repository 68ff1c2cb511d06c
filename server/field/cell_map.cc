#include "server/field/cell_map.h"

namespace pheromone::field {

NodeState CellMap::Read(NodeIndex node) const {
  const auto found = tiles_.find(KeyOf(node));
  if (found == tiles_.end()) {
    return {};
  }
  const size_t slot = SlotOf(node);
  return {found->second.count[slot], found->second.time_ms[slot]};
}

bool CellMap::Write(NodeIndex node, NodeState state) {
  auto found = tiles_.find(KeyOf(node));
  if (found == tiles_.end()) {
    if (state.count == 0) {
      return true;
    }
    if (budget_->used >= budget_->limit) {
      return false;
    }
    ++budget_->used;
    found = tiles_.emplace(KeyOf(node), Tile{}).first;
  }
  Tile& tile = found->second;
  const size_t slot = SlotOf(node);
  const uint64_t bit = uint64_t{1} << slot;
  node_count_ -= (tile.occupied & bit) != 0 ? 1 : 0;
  tile.count[slot] = state.count;
  tile.time_ms[slot] = state.time_ms;
  if (state.count != 0) {
    tile.occupied |= bit;
    ++node_count_;
  } else {
    tile.occupied &= ~bit;
    EraseIfEmpty(found);
  }
  return true;
}

void CellMap::EraseIfEmpty(std::unordered_map<uint64_t, Tile>::iterator tile) {
  if (tile->second.occupied == 0) {
    tiles_.erase(tile);
    --budget_->used;
  }
}

}  // namespace pheromone::field
