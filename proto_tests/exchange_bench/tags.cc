#include "proto_tests/exchange_bench/tags.h"

#include <fmt/format.h>

namespace pheromone::bench {
namespace {

constexpr int kRangeMm = 50;
constexpr int32_t kSubjectIsARobot = -17;
constexpr int32_t kObjectIsANumber = -3;

uint16_t NumberOf(size_t tag) {
  return static_cast<uint16_t>(tag + 1);  // in the order of the file
}

}  // namespace

int32_t TagSites::CoordinateOf(size_t index) const {
  return static_cast<int32_t>((2 * static_cast<int64_t>(index) + 1) * map_mm_ / per_side_ / 2);
}

std::string TagTables(int per_side, int map_mm) {
  const auto metres = [&](int index) {
    const int millimetres = (2 * index + 1) * map_mm / (2 * per_side);
    return millimetres / 1000.0;
  };
  std::string text;
  for (int row = 0; row < per_side; ++row) {
    for (int column = 0; column < per_side; ++column) {
      text += fmt::format("[[tag]]\nname = \"{}-{}\"\nx_m = {:.3f}\ny_m = {:.3f}\nrange_m = {}\n",
                          column, row, metres(column), metres(row), kRangeMm / 1000.0);
    }
  }
  return text;
}

protocol::Message TagSites::Scan(uint8_t client, size_t tag) const {
  protocol::Message message;
  protocol::Encode(protocol::ScanRequest{client, XOf(tag), YOf(tag), 0}, &message);
  return message;
}

protocol::Message TagSites::Read(uint8_t client, size_t tag) const {
  protocol::Message message;
  protocol::Encode(protocol::TagReadRequest{client, XOf(tag), YOf(tag), NumberOf(tag), 0},
                   &message);
  return message;
}

protocol::Message TagSites::Write(uint8_t client, size_t tag, uint8_t seq) const {
  protocol::TagWriteRequest request;
  request.id = client;
  request.seq = seq;
  request.x = XOf(tag);
  request.y = YOf(tag);
  request.tag = NumberOf(tag);
  request.slot = protocol::kNoSlot;
  request.flags = protocol::kTagReplace;
  const int32_t words[] = {kSubjectIsARobot, client, 1, 1, kObjectIsANumber, seq};
  for (size_t i = 0; i < protocol::kStatementWords; ++i) {
    request.words[i] = words[i];
  }
  protocol::Message message;
  protocol::Encode(request, &message);
  return message;
}

bool TagSites::IsScanAnswer(const protocol::Message& answer, uint8_t client, size_t tag) const {
  protocol::ScanAnswer scan;
  return answer.id == client && protocol::Decode(answer, &scan) && scan.count == 1 &&
         scan.more == 0 && scan.rows[0].tag == NumberOf(tag) && scan.rows[0].dx == 0 &&
         scan.rows[0].dy == 0;
}

bool TagSites::IsReadAnswer(const protocol::Message& answer, uint8_t client, size_t tag) {
  protocol::TagReadAnswer read;
  return answer.id == client && protocol::Decode(answer, &read) && read.tag == NumberOf(tag) &&
         read.slot == 0 && read.words[protocol::kWordSubjectNamespace] == kSubjectIsARobot;
}

bool TagSites::IsWriteAnswer(const protocol::Message& answer, uint8_t client, size_t tag,
                             uint8_t seq) {
  protocol::TagWritten written;
  return answer.id == client && protocol::Decode(answer, &written) && !written.erased &&
         written.seq == seq && written.tag == NumberOf(tag);
}

}  // namespace pheromone::bench
