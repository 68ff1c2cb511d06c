// Applies the events of a journal again and prints what became of each, for checkers that compare
// it with what robots and servers have seen. Where events are missing, and a snapshot has what they
// made, it goes on from that.
//
//   replayed_journal FOLDER [SEQUENCE...] > events
//
// A line for each event, its fields separated by tabs: sequence, field time in ms, epoch, the state
// hash if the sequence was named (else "-"), then of a request "request", the link's index, its
// bytes and those of all messages that answer it; of an edit "edit", x and y of its first point in
// um; of others "other". Exit status 1: an event is missing, damaged, or not possible after those
// before it.
#include <fmt/format.h>

#include <cstdlib>
#include <iostream>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "protocol/messages.h"
#include "server/base/bytes.h"
#include "server/core/engine/engine.h"
#include "server/core/engine/event_codec.h"
#include "server/store/journal/event_reader.h"
#include "server/store/journal/posix_folder.h"
#include "server/store/journal/snapshot.h"

namespace {

namespace engine = pheromone::engine;
namespace journal = pheromone::journal;

std::string Hex(const pheromone::protocol::Message& message) {
  std::string text = fmt::format("{:02x}{:02x}", message.id, message.opcode);
  for (size_t i = 0; i < message.length; ++i) {
    text += fmt::format("{:02x}", message.data[i]);
  }
  return text;
}

class Printer {
 public:
  Printer(const journal::Folder& folder, std::set<uint64_t> hashed)
      : folder_(folder), hashed_(std::move(hashed)) {}

  void Take(const journal::Record& record) {
    if (!wrong_.empty()) {
      return;
    }
    if (record.sequence > engine_.sequence() + 1) {
      uint64_t byte = 0;
      auto snapshot =
          journal::ReadSnapshot(folder_, journal::SnapshotName(record.sequence - 1), &byte);
      if (snapshot.ok()) {
        engine_ = std::move(snapshot.value().engine);
      }
    }
    pheromone::ByteReader bytes(record.event);
    engine::Event event = engine::DecodeEvent(&bytes);
    bytes.ExpectEnd();
    const auto possible = !bytes.ok() ? pheromone::Status(pheromone::Error{bytes.error()})
                          : record.sequence != engine_.sequence() + 1
                              ? pheromone::Error{"is not the next one"}
                              : engine_.Prepare(&event);
    const auto checked = possible.ok() ? engine_.Check(event) : possible;
    if (!checked.ok()) {
      wrong_ = fmt::format("event {}: {}", record.sequence, checked.error());
      return;
    }
    std::vector<engine::Outgoing> out;
    engine_.Apply(record.sequence, record.stamp, event, &out);
    std::cout << fmt::format(
        "{}\t{}\t{}\t{}\t", record.sequence, record.stamp.field_time_ms, engine_.epoch(),
        hashed_.contains(record.sequence) ? fmt::format("{:016x}", engine_.StateHash()) : "-");
    if (const auto* request = std::get_if<engine::RequestReceived>(&event)) {
      std::cout << "request\t" << request->link << '\t' << Hex(request->message);
      for (const engine::Outgoing& it : out) {
        std::cout << '\t' << Hex(it.message);
      }
    } else if (const auto* edit = std::get_if<engine::FieldEdited>(&event);
               edit != nullptr && !edit->edit.points.empty()) {
      std::cout << "edit\t" << edit->edit.points.front().x << '\t' << edit->edit.points.front().y;
    } else {
      std::cout << "other";
    }
    std::cout << '\n';
  }

  const std::string& wrong() const { return wrong_; }

 private:
  const journal::Folder& folder_;
  const std::set<uint64_t> hashed_;
  engine::Engine engine_;
  std::string wrong_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << "usage: replayed_journal FOLDER [SEQUENCE...]\n";
    return 2;
  }
  std::set<uint64_t> hashed;
  for (int i = 2; i < argc; ++i) {
    hashed.insert(std::strtoull(argv[i], nullptr, 10));
  }
  const auto folder = journal::PosixFolder::Open(argv[1], journal::PosixFolder::Mode::kReader);
  if (!folder.ok()) {
    std::cerr << folder.error() << '\n';
    return 1;
  }
  Printer printer(*folder.value(), std::move(hashed));
  const auto walked = journal::WalkEvents(
      *folder.value(), [&](const journal::Record& record) { printer.Take(record); });
  const std::string wrong = !walked.ok()                        ? walked.error()
                            : !walked.value().cut_short.empty() ? walked.value().cut_short
                                                                : printer.wrong();
  if (!wrong.empty()) {
    std::cerr << wrong << '\n';
    return 1;
  }
  return 0;
}
