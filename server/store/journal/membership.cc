#include "server/store/journal/membership.h"

#include <algorithm>
#include <charconv>
#include <memory>
#include <system_error>
#include <utility>
#include <vector>

#include "server/store/journal/format.h"

namespace pheromone::journal {
namespace {

constexpr std::string_view kTitle = "pheromone journal of a cluster, version 1";
constexpr std::string_view kLastLine = "end";
constexpr size_t kMaxMembershipBytes = 4096;

std::string LineOf(std::string_view key, const std::string& value) {
  return std::string(key) + ' ' + value + '\n';
}

}  // namespace

std::string EncodeMembership(const Membership& membership) {
  std::string text = std::string(kTitle) + '\n';
  text += membership.cluster.empty() ? "" : LineOf("cluster", membership.cluster);
  text += membership.id.empty() ? "" : LineOf("id", membership.id);
  text += membership.founds ? LineOf("founds", "1") : "";
  text += membership.new_epoch ? LineOf("new_epoch", "1") : "";
  text += membership.field_less_utc_ms
              ? LineOf("field_less_utc_ms", std::to_string(*membership.field_less_utc_ms))
              : "";
  return text + std::string(kLastLine) + '\n';
}

Result<Membership> DecodeMembership(std::string_view text) {
  const auto next_line = [&text]() -> std::optional<std::string_view> {
    const size_t end = text.find('\n');
    if (end == std::string_view::npos) {
      return std::nullopt;
    }
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end + 1);
    return line;
  };
  if (next_line() != kTitle) {
    return Error{"expected the first line \"" + std::string(kTitle) + '"'};
  }
  Membership membership;
  bool is_whole = false;
  for (auto line = next_line(); line; line = next_line()) {
    is_whole = *line == kLastLine;
    if (is_whole) {
      break;
    }
    const size_t space = std::min(line->find(' '), line->size());
    const std::string_view key = line->substr(0, space);
    const std::string value(line->substr(std::min(space + 1, line->size())));
    bool is_valid = !value.empty();
    if (key == "cluster") {
      membership.cluster = value;
    } else if (key == "id") {
      membership.id = value;
    } else if (key == "founds") {
      membership.founds = is_valid = value == "1";
    } else if (key == "new_epoch") {
      membership.new_epoch = is_valid = value == "1";
    } else if (key == "field_less_utc_ms") {
      int64_t number = 0;
      const char* const end = value.data() + value.size();
      const auto [read, error] = std::from_chars(value.data(), end, number);
      is_valid = error == std::errc() && read == end;
      membership.field_less_utc_ms = number;
    } else {
      is_valid = false;
    }
    if (!is_valid) {
      return Error{"found the line \"" + std::string(*line) + "\", which this version cannot read"};
    }
  }
  if (!is_whole || !text.empty()) {
    return Error{"expected \"end\" in the last line, and only there"};
  }
  return membership;
}

Result<std::optional<Membership>> ReadMembership(const Folder& folder) {
  const std::string name(kMembershipName);
  const auto has = [&name](const std::vector<std::string>& names) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  PHEROMONE_TRY(const std::vector<std::string> others, folder.ListOthers());
  if (has(others)) {
    return Error{folder.path() + '/' + name + ": expected a regular file"};
  }
  PHEROMONE_TRY(const std::vector<std::string> names, folder.List());
  if (!has(names)) {
    return std::optional<Membership>();
  }
  PHEROMONE_TRY(const std::string text, folder.Read(name, 0, kMaxMembershipBytes));
  Result<Membership> membership = DecodeMembership(text);
  if (!membership.ok()) {
    return Error{folder.path() + '/' + name + ": " + membership.error()};
  }
  return std::optional(std::move(membership).value());
}

Status WriteMembership(const Membership& membership, Folder* folder) {
  const std::string text = EncodeMembership(membership);
  const Result<Membership> same = DecodeMembership(text);
  if (!same.ok() || same.value() != membership || text.size() > kMaxMembershipBytes) {
    return Error{folder->path() + '/' + std::string(kMembershipName) +
                 ": the names of the cluster and of its log do not fit into lines"};
  }
  const std::string unfinished = std::string(kMembershipName) + std::string(kUnfinished);
  (void)folder->Remove(unfinished);  // possibly left by an earlier attempt
  PHEROMONE_TRY(std::unique_ptr<AppendFile> file, folder->Create(unfinished));
  PHEROMONE_TRY_STATUS(file->Append(text));
  PHEROMONE_TRY_STATUS(file->Sync());
  file.reset();
  PHEROMONE_TRY_STATUS(folder->Rename(unfinished, std::string(kMembershipName)));
  return folder->Sync();
}

Status RemoveMembership(Folder* folder) {
  PHEROMONE_TRY_STATUS(folder->Remove(std::string(kMembershipName)));
  return folder->Sync();
}

}  // namespace pheromone::journal
