#include "server/cluster/link_owners.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <system_error>
#include <utility>

namespace pheromone::cluster {
namespace {

constexpr uint64_t kRenewals = 3;  // in a lease
constexpr uint64_t kBetweenReadsMs = 200;
constexpr uint64_t kAfterErrorMs = 50;
constexpr uint64_t kBetweenRanksMs = 100;
constexpr uint64_t kMaxDriftParts = 50;  // 2 %
constexpr uint64_t kStepsMs = 5;         // of clocks that are read in whole milliseconds

// The end of it is removed from `text`.
std::optional<uint64_t> LastNumber(std::string_view* text) {
  const size_t space = text->rfind(' ');
  if (space == std::string_view::npos) {
    return std::nullopt;
  }
  const std::string_view digits = text->substr(space + 1);
  uint64_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (error != std::errc{} || end != digits.data() + digits.size() || digits.empty()) {
    return std::nullopt;
  }
  text->remove_suffix(digits.size() + 1);
  return number;
}

}  // namespace

std::string EncodeLinkLease(const LinkLease& lease) {
  return lease.node + ' ' + std::to_string(lease.process) + ' ' + std::to_string(lease.change) +
         ' ' + std::to_string(lease.lease_ms);
}

Result<LinkLease> DecodeLinkLease(std::string_view text) {
  const auto lease_ms = LastNumber(&text);
  const auto change = LastNumber(&text);
  const auto process = LastNumber(&text);
  const bool is_node = !text.empty() && text.find(' ') == std::string_view::npos;
  if (!lease_ms || !change || !process || !is_node || *lease_ms > kMaxLinkLeaseMs) {
    return Error{"expected a node, a process, a change and a lease of at most " +
                 std::to_string(kMaxLinkLeaseMs) + " ms"};
  }
  return LinkLease{std::string(text), *process, *change, *lease_ms};
}

LinkOwners::LinkOwners(std::string node, uint64_t process, std::vector<SharedLink> links)
    : node_(std::move(node)), process_(process) {
  for (SharedLink& it : links) {
    links_.emplace_back().settings = std::move(it);
  }
}

bool LinkOwners::IsOwn(const Link& link) const {
  return link.lease.node == node_ && link.lease.process == process_ && link.lease.lease_ms != 0;
}

// When a lease of another one is surely over.
uint64_t LinkOwners::ClaimAt(const Link& link) const {
  const uint64_t lease_ms = link.lease.lease_ms;
  const uint64_t surely_ms = lease_ms == 0 ? 0 : lease_ms + lease_ms / kMaxDriftParts + kStepsMs;
  return link.seen_ms + surely_ms + link.settings.rank * kBetweenRanksMs;
}

uint64_t LinkOwners::DueAt(const Link& link) const {
  if (link.is_asked) {
    return UINT64_MAX;
  }
  const uint64_t read_ms = link.asked_ms + kBetweenReadsMs;
  uint64_t due_ms = 0;
  if (link.is_known && IsOwn(link) && MaySend(link)) {
    // Without a valid lease: at once.
    due_ms = link.until_ms - std::min(link.until_ms, link.settings.lease_ms) +
             link.settings.lease_ms / kRenewals;
    due_ms = link.until_ms == 0 ? 0 : due_ms;
  } else if (link.is_known && IsOwn(link)) {
    // Later than in the Next that ended it: only then is it known what was begun.
    due_ms = link.ended_ms == kNever ? 0 : std::max(link.ended_ms + 1, link.in_use_until_ms);
  } else if (link.is_known) {
    due_ms = MaySend(link) ? std::min(read_ms, ClaimAt(link)) : read_ms;
  }
  return std::max(due_ms, link.next_ms);
}

std::vector<LinkOwners::Request> LinkOwners::Next(uint64_t now_ms) {
  std::vector<Request> requests;
  for (size_t i = 0; i < links_.size(); ++i) {
    Link& link = links_[i];
    const bool may_send = MaySend(link);
    link.until_ms = may_send ? link.until_ms : 0;
    link.ended_ms = may_send ? kNever : std::min(link.ended_ms, now_ms);
    if (now_ms < DueAt(link)) {
      continue;
    }
    link.sets = link.is_known && (IsOwn(link) || (may_send && now_ms >= ClaimAt(link)));
    link.is_asked = true;
    link.asked_ms = now_ms;
    Request request{.link = i, .sets = link.sets};
    if (link.sets) {
      link.asked = {node_, process_, ++changes_, may_send ? link.settings.lease_ms : 0};
      request.seen = link.there.revision;
      request.value = EncodeLinkLease(link.asked);
    }
    requests.push_back(std::move(request));
  }
  return requests;
}

void LinkOwners::OnRegister(size_t index, const Result<Register>& answer, uint64_t now_ms) {
  Link& link = links_[index];
  link.is_asked = false;
  if (!answer.ok()) {
    link.next_ms = now_ms + kAfterErrorMs;
    return;
  }
  if (!link.is_known || answer.value() != link.there) {
    link.is_known = true;
    link.there = answer.value();
    link.seen_ms = now_ms;
    const Result<LinkLease> lease = DecodeLinkLease(link.there.value);
    link.lease = lease.ok() ? lease.value() : LinkLease{"", 0, 0, link.settings.lease_ms};
  }
  if (!IsOwn(link)) {
    link.until_ms = 0;
  } else if (link.sets && link.lease == link.asked && MaySend(link)) {
    link.until_ms = link.asked_ms + link.lease.lease_ms;
  }
}

uint64_t LinkOwners::Deadline(uint64_t now_ms) const {
  uint64_t deadline = UINT64_MAX;
  for (const Link& link : links_) {
    deadline = std::min(deadline, DueAt(link));
    if (link.until_ms > now_ms) {
      deadline = std::min(deadline, link.until_ms);
    }
  }
  return deadline;
}

bool LinkOwners::has_any() const {
  return std::any_of(links_.begin(), links_.end(), [this](const Link& link) {
    return !link.is_known || IsOwn(link) || (link.is_asked && link.sets);
  });
}

}  // namespace pheromone::cluster
