#include "client_fw/verify/cleaning_symmetry.h"

#include <numeric>

namespace pheromone::verify {
namespace {

constexpr size_t kMaxTries = 1'000'000;

// Zone by zone, in their order, to each place that fits to those before.
class SymmetrySearch {
 public:
  SymmetrySearch(const CleaningNeighbours& floor, const std::vector<int>& rates_percent,
                 uint64_t closed)
      : zones_(floor.size()), rates_(rates_percent), closed_(closed), beside_(zones_) {
    for (size_t zone = 0; zone < zones_; ++zone) {
      for (const uint8_t other : floor[zone]) {
        beside_[zone] |= uint64_t{1} << other;
      }
    }
  }

  // Too many to search through are taken for too many of them.
  std::vector<ZoneMap> Run() {
    Place(0);
    if (found_.size() > kMaxSymmetries || tries_ >= kMaxTries) {
      found_.resize(1);
    }
    return found_;
  }

 private:
  bool Beside(size_t from, size_t to) const { return (beside_[from] >> to & 1) != 0; }

  bool Fits(size_t zone, size_t place) const {
    if ((used_ >> place & 1) != 0 || (closed_ >> zone & 1) != (closed_ >> place & 1) ||
        (!rates_.empty() && rates_[zone] != rates_[place])) {
      return false;
    }
    for (size_t before = 0; before < zone; ++before) {
      if (Beside(before, zone) != Beside(map_[before], place) ||
          Beside(zone, before) != Beside(place, map_[before])) {
        return false;
      }
    }
    return true;
  }

  // In the order of places, so that the first one found leaves all as it is.
  void Place(size_t zone) {
    if (zone == zones_) {
      found_.push_back(map_);
      return;
    }
    for (size_t place = 0; place < zones_ && found_.size() <= kMaxSymmetries; ++place) {
      if (++tries_ < kMaxTries && Fits(zone, place)) {
        map_[zone] = static_cast<uint8_t>(place);
        used_ |= uint64_t{1} << place;
        Place(zone + 1);
        used_ &= ~(uint64_t{1} << place);
      }
    }
  }

  size_t zones_;
  const std::vector<int>& rates_;
  uint64_t closed_;
  std::vector<uint64_t> beside_;
  ZoneMap map_{};
  uint64_t used_ = 0;
  size_t tries_ = 0;
  std::vector<ZoneMap> found_;
};

}  // namespace

ZoneMap LeaveAsItIs() {
  ZoneMap map{};
  std::iota(map.begin(), map.end(), uint8_t{0});
  return map;
}

std::vector<ZoneMap> FloorSymmetries(const CleaningNeighbours& floor,
                                     const std::vector<int>& rates_percent, uint64_t closed) {
  return SymmetrySearch(floor, rates_percent, closed).Run();
}

}  // namespace pheromone::verify
