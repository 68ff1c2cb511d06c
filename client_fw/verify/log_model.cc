#include "client_fw/verify/log_model.h"

#include <algorithm>

namespace pheromone::verify {

using cluster::Appended;
using cluster::Group;
using cluster::Leader;
using cluster::Page;
using cluster::Sequence;
using cluster::Term;

Leader LogModel::TakeLead(Term seen, const std::string& node) {
  if (CanTakeLead(seen)) {
    leader_ = {.term = seen + 1, .node = node};
    changes_.push_back({.leader = leader_, .group = {}});
  }
  return leader_;
}

Appended LogModel::Append(const Group& group) {
  if (CanAppend(group)) {
    const auto place =
        std::lower_bound(groups_.begin(), groups_.end(), group.first,
                         [](const Group& one, Sequence first) { return one.first < first; });
    if (place != groups_.end() && place->first == group.first) {
      *place = group;
    } else {
      groups_.insert(place, group);
    }
    changes_.push_back({.leader = {}, .group = group});
  }
  const Group* const there = At(group.first);
  return there != nullptr && *there == group ? Appended::kCommitted : Appended::kFenced;
}

bool LogModel::CanAppend(const Group& group) const {
  const Group* const there = At(group.first);
  const bool is_free = mutant_ == LogMutant::kNoPlaceCompare ? there == nullptr || *there != group
                                                             : there == nullptr;
  return is_free && (group.term == leader_.term || mutant_ == LogMutant::kNoTermCompare);
}

Page LogModel::PageOf(size_t from, size_t to, Sequence first) const {
  Page page;
  for (size_t moment = 0; moment < to; ++moment) {
    const Change& change = changes_[moment];
    if (change.leader) {
      page.leader = *change.leader;
    } else if (moment >= from && change.group.first + change.group.count > first) {
      page.groups.push_back(change.group);
    }
  }
  if (mutant_ == LogMutant::kTellsLeaderFirst) {
    page.leader = leader_;
  }
  return page;
}

std::string LogModel::LeaderOf(Term term) const {
  for (const Change& change : changes_) {
    if (change.leader && change.leader->term == term) {
      return change.leader->node;
    }
  }
  return {};
}

Sequence LogModel::end() const {
  return groups_.empty() ? 1 : groups_.back().first + groups_.back().count;
}

const Group* LogModel::At(Sequence place) const {
  for (const Group& group : groups_) {
    if (group.first == place) {
      return &group;
    }
  }
  return nullptr;
}

void LogModel::Encode(ByteWriter* writer) const {
  writer->Count(changes_.size());
  for (const Change& change : changes_) {
    writer->Flag(change.leader.has_value());
    if (change.leader) {
      writer->Text(change.leader->node);  // the term is one more than that before
    } else {
      writer->U64(change.group.first);
      writer->U64(change.group.term);
      writer->Text(change.group.records);
    }
  }
}

}  // namespace pheromone::verify
