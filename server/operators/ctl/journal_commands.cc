#include "server/operators/ctl/journal_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <memory>

#include "server/base/format.h"
#include "server/operators/ctl/map_commands.h"
#include "server/store/journal/event_text.h"
#include "server/store/journal/membership.h"
#include "server/store/journal/posix_folder.h"
#include "server/store/journal/recovery.h"
#include "server/store/journal/segment_reader.h"
#include "server/store/journal/snapshot.h"

namespace pheromone::ctl {
namespace {

using journal::PosixFolder;
using journal::Record;
using journal::RecordKind;
using journal::RecordReader;
using journal::SegmentReader;

// A server may remove a file between the listing and the reading of it.
constexpr int kAttempts = 3;

Result<std::unique_ptr<PosixFolder>> Open(const std::string& path) {
  auto folder = PosixFolder::Open(path, PosixFolder::Mode::kReader);
  if (!folder.ok()) {
    return folder;
  }
  PHEROMONE_TRY(const auto names, folder.value()->List());
  for (const std::string& name : names) {
    if (journal::OrdinalOf(name) || journal::SnapshotSequenceOf(name)) {
      return folder;
    }
  }
  return Error{path + ": contains no journal"};
}

std::string InWordsOfAnyKind(const Record& record) {
  switch (record.kind) {
    case RecordKind::kEvent:
    case RecordKind::kPiece:  // the reader makes one event of them
    case RecordKind::kEventInPieces:
      return journal::InWords(record);
    case RecordKind::kGroup:
      return fmt::format("group durable={}", record.sequence);
    case RecordKind::kHash:
      return fmt::format("hash sequence={} hash={:016x}", record.sequence, record.hash);
    case RecordKind::kEnd:
      return fmt::format("end sequence={}", record.sequence);
  }
  return "unknown";
}

void DescribeSnapshot(const PosixFolder& folder, const std::string& name) {
  uint64_t byte = 0;
  const auto snapshot = journal::ReadSnapshot(folder, name, &byte);
  if (snapshot.ok()) {
    fmt::print("{}: state hash {:016x}\n", name, snapshot.value().engine.StateHash());
  } else {
    fmt::print("{}: byte {}: {}\n", name, byte, snapshot.error());
  }
}

// Prints its contents, and where it ends; the recovery decides whether more should follow.
void DescribeSegment(const PosixFolder& folder, const std::string& name) {
  const auto head = folder.Read(name, 0, journal::kSegmentHeaderBytes);
  const auto header = journal::DecodeSegmentHeader(head.ok() ? head.value() : "");
  if (!header.ok()) {
    fmt::print("{}: {}\n", name, head.ok() ? header.error() : head.error());
    return;
  }
  SegmentReader reader(folder, name);
  Record record;
  uint64_t events = 0;
  uint64_t last = 0;
  RecordReader::Found found = RecordReader::Found::kEnd;
  while ((found = reader.Next(&record)) == RecordReader::Found::kRecord) {
    if (record.kind == RecordKind::kEvent) {
      ++events;
      last = record.sequence;
    }
  }
  fmt::print("{}: {} bytes, {} events{}{}\n", name, reader.size(), events,
             events == 0 ? "" : fmt::format(" to sequence {}", last),
             found == RecordReader::Found::kBad
                 ? fmt::format("; byte {}: {}", reader.at(), reader.why())
                 : "");
}

void DescribeNote(const PosixFolder& folder) {
  const auto note = journal::ReadDurableNote(folder);
  fmt::print("{}: {}\n", journal::kDurableName,
             note ? fmt::format("sequence {} was durable at {}", note->sequence,
                                UtcText(note->utc_ms / 1000))
                  : "no valid durability mark");
}

// False: it is damaged, and a server does not start with it.
bool DescribeMembership(const PosixFolder& folder) {
  const auto membership = journal::ReadMembership(folder);
  const journal::Membership its =
      membership.ok() && membership.value() ? *membership.value() : journal::Membership();
  fmt::print("{}: {}\n", journal::kMembershipName,
             !membership.ok()      ? std::string(membership.error())
             : its.cluster.empty() ? "has left its cluster; a new epoch begins"
                                   : fmt::format("of cluster \"{}\"{}{}", its.cluster,
                                                 its.id.empty() ? "" : ", ID " + its.id,
                                                 its.founds ? ", whose log begins with it" : ""));
  return membership.ok();
}

// A log truncated between two records looks as if nothing had ever followed.
std::string WhatIsCertain(const journal::Recovered& state) {
  const uint64_t known = std::max(state.certain, state.noted ? state.noted->sequence : 0);
  if (state.ends_orderly) {
    return "no acknowledged change is missing: the log was closed in an orderly way";
  }
  return fmt::format(
      "no acknowledged change up to sequence {} is missing; the log was not closed in an orderly "
      "way, so later records may be missing without a trace",
      known);
}

}  // namespace

Status HoldsJournal(const std::string& folder) {
  const auto opened = Open(folder);
  return opened.ok() ? Ok() : Status(Error{opened.error()});
}

int CheckJournal(const std::string& path) {
  const auto folder = Open(path);
  if (!folder.ok()) {
    return Fail(kFailed, folder.error());
  }
  const auto names = folder.value()->List();
  bool damaged = false;
  for (const std::string& name : names.ok() ? names.value() : std::vector<std::string>{}) {
    if (journal::SnapshotSequenceOf(name)) {
      DescribeSnapshot(*folder.value(), name);
    } else if (journal::OrdinalOf(name)) {
      DescribeSegment(*folder.value(), name);
    } else if (name == journal::kDurableName) {
      DescribeNote(*folder.value());
    } else if (name == journal::kMembershipName) {
      damaged = !DescribeMembership(*folder.value());
    } else {
      fmt::print("{}: not read\n", name);
    }
  }
  auto recovered = journal::Recover(*folder.value());
  for (int i = 1; i < kAttempts && !recovered.ok(); ++i) {
    recovered = journal::Recover(*folder.value());
  }
  if (!recovered.ok()) {
    return Fail(kFoundDamage, recovered.error());
  }
  const journal::Recovered& state = recovered.value();
  for (const journal::Finding& finding : state.findings) {
    fmt::print("{}: {}\n", finding.is_damage ? "damaged" : "incomplete", finding.Text());
  }
  if (!state.engine.configured()) {
    fmt::print("no state\n");
  } else {
    fmt::print("state: sequence {}, field time {} ms, hash {:016x}, from {}\n", state.sequence,
               state.stamp.field_time_ms, state.engine.StateHash(),
               state.snapshot_sequence == 0 ? "the beginning"
                                            : journal::SnapshotName(state.snapshot_sequence));
  }
  const bool incomplete = state.lost || state.differs || !state.damaged_files.empty();
  fmt::print("{}\n",
             incomplete ? "damaged: acknowledged changes may be missing" : WhatIsCertain(state));
  damaged = damaged || incomplete ||
            std::any_of(state.findings.begin(), state.findings.end(),
                        [](const auto& it) { return it.is_damage; });
  return damaged ? kFoundDamage : 0;
}

int ReportEnd(const journal::Walked& walked) {
  if (!walked.cut_short.empty()) {
    std::cerr << "pheromonectl: stops there: " << walked.cut_short << '\n';
  }
  return walked.is_damaged ? kFoundDamage : 0;
}

int DumpJournal(const std::string& path) {
  const auto folder = Open(path);
  if (!folder.ok()) {
    return Fail(kFailed, folder.error());
  }
  const auto names = folder.value()->List();
  if (!names.ok()) {
    return Fail(kFailed, names.error());
  }
  bool has_bad = false;
  for (const std::string& name : names.value()) {
    if (!journal::OrdinalOf(name)) {
      continue;
    }
    const auto head = folder.value()->Read(name, 0, journal::kSegmentHeaderBytes);
    const auto header = journal::DecodeSegmentHeader(head.ok() ? head.value() : "");
    if (!header.ok()) {
      fmt::print("{} 0 bad: {}\n", name, head.ok() ? header.error() : head.error());
      has_bad = true;
      continue;
    }
    fmt::print("{} 0 segment first={}{}\n", name, header.value().first_sequence,
               header.value().relaxed ? " relaxed" : "");
    SegmentReader reader(*folder.value(), name);
    Record record;
    RecordReader::Found found = RecordReader::Found::kEnd;
    while ((found = reader.Next(&record)) == RecordReader::Found::kRecord) {
      fmt::print("{} {} {}\n", name, record.at, InWordsOfAnyKind(record));
    }
    if (found == RecordReader::Found::kBad) {
      fmt::print("{} {} bad: {}\n", name, reader.at(), reader.why());
      has_bad = true;
    }
  }
  if (!has_bad) {
    return 0;
  }
  // It may be where a server was killed.
  const auto walked = journal::WalkEvents(*folder.value(), [](const Record&) {});
  if (!walked.ok()) {
    return Fail(kFailed, walked.error());
  }
  return walked.value().is_damaged ? Fail(kFoundDamage, "damaged: " + walked.value().cut_short) : 0;
}

int ExportJournal(const std::string& path, const std::string& format) {
  const auto folder = Open(path);
  if (!folder.ok()) {
    return Fail(kFailed, folder.error());
  }
  const bool is_csv = format == "csv";
  if (is_csv) {
    std::cout << journal::kCsvHeader << '\n';
  }
  const auto walked = journal::WalkEvents(*folder.value(), [is_csv](const Record& record) {
    std::cout << (is_csv ? journal::InCsv(record) : journal::InJson(record)) << '\n';
  });
  if (!walked.ok()) {
    return Fail(kFailed, walked.error());
  }
  return ReportEnd(walked.value());
}

}  // namespace pheromone::ctl
