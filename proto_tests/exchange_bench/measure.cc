#include "proto_tests/exchange_bench/measure.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

#include "proto_tests/exchange_bench/pty_load.h"

namespace pheromone::bench {
namespace {

double Median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

Row RunInTurn(int rounds, const std::function<LoadResult()>& load,
              const std::function<LoadResult()>& with, Row row) {
  std::vector<double> rates;
  std::vector<double> other_rates;
  std::vector<double> ratios;
  for (int round = 0; round < rounds; ++round) {
    const LoadResult other = with();
    LoadResult served = load();
    other_rates.push_back(other.per_second);
    rates.push_back(served.per_second);
    ratios.push_back(other.per_second > 0 ? served.per_second / other.per_second : 0);
    row.right += served.right;
    row.wrong += served.wrong + other.wrong;
    row.lost += served.lost;
    row.late += served.late;
    row.times = std::move(served.times);
  }
  row.per_second = Median(rates);
  row.echo_per_second = Median(other_rates);
  row.share_of_echo = Median(ratios);
  return row;
}

Measure::Measure(std::string name, std::string folder, const Effort& effort, const Arena& arena,
                 const ServerProcess& server, Report* report)
    : name_(std::move(name)),
      folder_(std::move(folder)),
      effort_(effort),
      arena_(arena),
      server_(server),
      report_(report) {
  for (int i = 1; i <= kLinks.udp; ++i) {
    ports_.push_back(server.PortOf(fmt::format("udp-{}", i)));
  }
}

void Measure::Compare(const LoadOptions& load, const LoadOptions& with, Row row) {
  report_->Add(RunInTurn(
      effort_.rounds, [&] { return RunLoad(arena_, load); }, [&] { return RunLoad(arena_, with); },
      std::move(row)));
}

void Measure::CompareUdp(Load what, int clients) {
  const EchoProcess echo;
  const std::vector<uint16_t> echo_ports(ports_.size(), echo.port());
  const char* const name = what == Load::kTrace ? "TRACE" : "SENSE";
  Compare({what, clients, ports_, effort_.seconds},
          {Load::kEcho, clients, echo_ports, effort_.seconds},
          {name_, fmt::format("{} over UDP by {} clients", name, clients), clients});
}

void Measure::CompareSigned(int clients) {
  const std::vector<uint16_t> ports(ports_.size(), server_.PortOf("signed"));
  LoadOptions load{Load::kSense, clients, ports, effort_.seconds};
  load.is_signed = true;
  Row row{name_, fmt::format("signed SENSE over UDP by {} clients", clients), clients};
  row.beside = "SENSE";
  Compare(load, {Load::kSense, clients, ports_, effort_.seconds}, std::move(row));
}

void Measure::CompareTags(Load what, Load with, const TagSites& tags, int clients) {
  const char* const name = what == Load::kScan      ? "SCAN"
                           : what == Load::kTagRead ? "TAG READ"
                                                    : "TAG WRITE";
  Row row{name_, fmt::format("{} over UDP by {} clients, {} tags", name, clients, tags.size()),
          clients};
  row.beside = with == Load::kSense ? "SENSE" : "TRACE";
  Compare({what, clients, ports_, effort_.seconds, &tags}, {with, clients, ports_, effort_.seconds},
          std::move(row));
}

PtyLoadResult Measure::RunPtys(bool trace, int ptys, int baud) {
  PtyLoadOptions load{trace, baud, {}, effort_.pty_seconds, effort_.bytes_at_once};
  for (int i = 1; i <= ptys; ++i) {
    load.ptys.push_back(fmt::format("{}/pty-{}", folder_, i));
  }
  return RunPtyLoad(arena_, load);
}

void Measure::ComparePtys(int ptys, int baud, const std::string& beside,
                          const std::function<std::shared_ptr<void>()>& begin) {
  const std::string load = fmt::format("SENSE on {} ptys at {} baud", ptys, baud);
  std::array<RoundsRow, 2> rows{RoundsRow{name_, load, ptys},
                                RoundsRow{name_, load + beside, ptys}};
  for (int round = 0; round < effort_.pty_rounds; ++round) {
    for (RoundsRow& row : rows) {
      const std::shared_ptr<void> other = &row == &rows[1] ? begin() : nullptr;
      PtyLoadResult result = RunPtys(false, ptys, baud);
      row.right += result.times.size();
      row.wrong += result.wrong;
      row.lost += result.lost;
      row.late += result.late;
      row.rounds.push_back(std::move(result.times));
    }
  }
  for (RoundsRow& row : rows) {
    report_->Add(std::move(row));
  }
}

void Measure::TimePtys(bool trace, int ptys, int baud, const std::string& beside) {
  PtyLoadResult result = RunPtys(trace, ptys, baud);
  Row row{name_,
          fmt::format("{} on {} ptys at {} baud{}", trace ? "TRACE" : "SENSE", ptys, baud, beside),
          ptys};
  row.right = result.times.size();
  row.wrong = result.wrong;
  row.lost = result.lost;
  row.late = result.late;
  row.times = std::move(result.times);
  report_->Add(std::move(row));
}

void Measure::Roam(int clients) {
  constexpr int kParts = 6;
  std::string memory = fmt::format("{}", server_.rss_kib());
  Row row{name_, fmt::format("TRACE over UDP by {} clients that roam", clients), clients};
  for (int part = 0; part < kParts; ++part) {
    LoadResult served =
        RunLoad(arena_, {Load::kRoam, clients, ports_, effort_.roaming_seconds / kParts});
    row.per_second += served.per_second / kParts;
    row.right += served.right;
    row.wrong += served.wrong;
    row.lost += served.lost;
    row.late += served.late;
    row.times = std::move(served.times);
    memory += fmt::format(", {}", server_.rss_kib());
  }
  report_->Add(std::move(row));
  Report::Say(fmt::format("{:9}its memory in KiB before that and after each {:.0f} s: {}", name_,
                          effort_.roaming_seconds / kParts, memory));
}

void TimeSyncs(const std::string& folder, const Effort& effort, Report* report) {
  const std::string path = folder + "/syncs";
  const int handle = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  const std::array<char, 64> record{};
  Row row{"none", "write and fdatasync", 1};
  for (int i = 0; i < effort.syncs; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    if (write(handle, record.data(), record.size()) < 0 || fdatasync(handle) != 0) {
      ++row.wrong;
      break;
    }
    row.times.Add(std::chrono::steady_clock::now() - begin);
    ++row.right;
  }
  close(handle);
  report->Add(std::move(row));
}

}  // namespace pheromone::bench
