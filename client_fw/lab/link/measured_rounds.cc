#include "client_fw/lab/link/measured_rounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <utility>

#include "client_fw/lab/link/measured_rounds_text.h"

namespace pheromone::lab {
namespace {

constexpr std::string_view kHeader = "lost_percent,robots,figure,from_ms,to_ms,count";
constexpr size_t kColumns = 6;

// Of a line of the table; empty if it has another number of them.
std::optional<std::array<std::string_view, kColumns>> ColumnsOf(std::string_view line) {
  std::array<std::string_view, kColumns> columns;
  for (size_t i = 0; i < kColumns; ++i) {
    const size_t comma = line.find(',');
    if ((comma == std::string_view::npos) != (i + 1 == kColumns)) {
      return std::nullopt;
    }
    columns[i] = line.substr(0, comma);
    line.remove_prefix(i + 1 < kColumns ? comma + 1 : 0);
  }
  return columns;
}

bool ReadNumber(std::string_view text, int64_t* number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *number);
  return error == std::errc() && end == text.data() + text.size() && *number >= 0;
}

bool ReadLine(std::string_view line, std::vector<MeasuredChannel>* channels) {
  const auto columns = ColumnsOf(line);
  int64_t lost = 0;
  int64_t robots = 0;
  int64_t from = 0;
  int64_t to = 0;
  int64_t count = 0;
  if (!columns || !ReadNumber((*columns)[0], &lost) || !ReadNumber((*columns)[1], &robots) ||
      ((*columns)[2] != "gap" && (*columns)[2] != "age") || !ReadNumber((*columns)[3], &from) ||
      !ReadNumber((*columns)[4], &to) || !ReadNumber((*columns)[5], &count) || from > to ||
      count == 0) {
    return false;
  }
  if (channels->empty() || channels->back().lost_percent != lost ||
      channels->back().robots != robots) {
    channels->push_back({static_cast<int>(lost), static_cast<int>(robots), {}, {}});
  }
  MeasuredChannel& channel = channels->back();
  ((*columns)[2] == "gap" ? channel.gaps : channel.pose_ages)
      .Add(from, to, static_cast<uint64_t>(count));
  return true;
}

}  // namespace

void Distribution::Add(int64_t from_ms, int64_t to_ms, uint64_t count) {
  const uint64_t before = bins_.empty() ? 0 : bins_.back().until;
  bins_.push_back({from_ms, to_ms, before, before + count});
}

int64_t Distribution::At(double share) const {
  const double rank = share * static_cast<double>(bins_.back().until);
  const auto bin = std::upper_bound(
      bins_.begin(), bins_.end() - 1, rank,
      [](double value, const Bin& it) { return value < static_cast<double>(it.until); });
  const double within =
      (rank - static_cast<double>(bin->before)) / static_cast<double>(bin->until - bin->before);
  const int64_t values = bin->to_ms - bin->from_ms + 1;
  return bin->from_ms +
         std::min(static_cast<int64_t>(within * static_cast<double>(values)), values - 1);
}

double Distribution::Mean() const {
  double sum = 0;
  for (const Bin& bin : bins_) {
    sum += static_cast<double>(bin.until - bin.before) *
           static_cast<double>(bin.from_ms + bin.to_ms) / 2;
  }
  return sum / static_cast<double>(bins_.back().until);
}

double Distribution::ShareAbove(int64_t ms) const {
  double above = 0;
  for (const Bin& bin : bins_) {
    const double values = static_cast<double>(bin.to_ms - bin.from_ms + 1);
    const double of_bin = std::clamp(static_cast<double>(bin.to_ms - ms) / values, 0.0, 1.0);
    above += static_cast<double>(bin.until - bin.before) * of_bin;
  }
  return above / static_cast<double>(bins_.back().until);
}

Result<std::vector<MeasuredChannel>> ReadMeasuredRounds(std::string_view csv) {
  std::vector<MeasuredChannel> channels;
  for (int number = 1; !csv.empty(); ++number) {
    const size_t end = std::min(csv.find('\n'), csv.size());
    const std::string_view line = csv.substr(0, end);
    csv.remove_prefix(std::min(end + 1, csv.size()));
    if (number == 1 ? line != kHeader : !ReadLine(line, &channels)) {
      return Error{fmt::format("measured rounds, line {}: found \"{}\", expected {} {}", number,
                               line, number == 1 ? "the header" : "values of", kHeader)};
    }
  }
  for (const MeasuredChannel& channel : channels) {
    if (channel.gaps.empty() || channel.pose_ages.empty()) {
      return Error{fmt::format("measured rounds: {} robots with {} % lost have no gaps or no ages",
                               channel.robots, channel.lost_percent)};
    }
  }
  return channels;
}

std::span<const MeasuredChannel> MeasuredRounds() {
  static const std::vector<MeasuredChannel> channels = [] {
    Result<std::vector<MeasuredChannel>> read = ReadMeasuredRounds(MeasuredRoundsText());
    assert(read.ok());
    return std::move(read).value();
  }();
  return channels;
}

const MeasuredChannel* FindMeasured(int lost_percent, int robots) {
  const std::span<const MeasuredChannel> all = MeasuredRounds();
  const auto found = std::find_if(all.begin(), all.end(), [&](const MeasuredChannel& channel) {
    return channel.lost_percent == lost_percent && channel.robots == robots;
  });
  return found != all.end() ? &*found : nullptr;
}

}  // namespace pheromone::lab
