// Messages as comparable, printable tuples of their fields, and Encode with one face. Host only.
#pragma once

#include <cstdint>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "protocol/messages.h"
#include "protocol/tag_messages.h"

namespace pheromone::testing {

inline auto Fields(const protocol::WirePose& p) {
  return std::tuple{p.x, p.y, int{p.heading}};
}

inline auto Fields(const protocol::SenseRequest& m) {
  return std::tuple{int{m.id}, int{m.type}, m.wide, Fields(m.pose)};
}

inline auto Fields(const protocol::SenseAnswer& m) {
  return std::tuple{int{m.id}, int{m.type}, m.wide, int{m.left}, int{m.right}};
}

inline auto Fields(const protocol::DepositRequest& m) {
  return std::tuple{int{m.id}, int{m.type}, int{m.seq}, int{m.x}, int{m.y}, int{m.quanta}};
}

inline auto Fields(const protocol::DepositAnswer& m) {
  return std::tuple{int{m.id}, int{m.type}, int{m.seq}};
}

inline auto Fields(const protocol::TraceRequest& m) {
  return std::tuple{int{m.id}, int{m.type}, m.wide, int{m.seq}, Fields(m.pose)};
}

inline auto Fields(const protocol::TraceAnswer& m) {
  return std::tuple{int{m.id}, int{m.type}, m.wide, int{m.seq}, int{m.left}, int{m.right}};
}

inline auto Fields(const protocol::Command& m) {
  return std::tuple{int{m.id}, int{m.seq}, static_cast<int>(m.code),
                    std::vector<int>(std::begin(m.arguments), std::end(m.arguments))};
}

inline auto Fields(const protocol::CommandAck& m) {
  return std::tuple{int{m.id}, int{m.seq}, static_cast<int>(m.code), int{m.result}};
}

inline auto Fields(const protocol::EventReport& m) {
  return std::tuple{int{m.id}, int{m.seq}, static_cast<int>(m.code), int{m.argument}};
}

inline auto Fields(const protocol::EventAck& m) {
  return std::tuple{int{m.id}, int{m.seq}};
}

inline auto Fields(const protocol::HelloRequest& m) {
  return std::tuple{int{m.id}, int{m.nonce}, int{m.firmware_version}, int{m.round_period}};
}

inline auto Fields(const protocol::HelloAnswer& m) {
  return std::tuple{int{m.id},          int{m.nonce},          int{m.protocol_version},
                    int{m.epoch},       int{m.pose_unit_10um}, int{m.antenna_distance_mm},
                    int{m.type_mask},   int{m.slot_ms},        int{m.response_window_ms},
                    int{m.last_opcode}, int{m.last_seq}};
}

inline auto Fields(const protocol::Ping& m) {
  return std::tuple{int{m.id}, m.answer, std::vector<int>(m.payload, m.payload + m.length)};
}

inline auto Fields(const protocol::ErrorAnswer& m) {
  return std::tuple{int{m.id}, int{m.refused_opcode}, static_cast<int>(m.reason), int{m.seq}};
}

inline auto Fields(const protocol::Round& m) {
  std::vector<std::pair<int, int>> answers;
  answers.reserve(m.answer_count);
  for (int i = 0; i < m.answer_count; ++i) {
    answers.emplace_back(m.answers[i].left, m.answers[i].right);
  }
  return std::tuple{std::vector<int>{m.number, m.turn_ms, m.turn_bytes, m.slot_ms, m.open_slots},
                    answers, std::vector<int>(m.turns, m.turns + m.turn_count)};
}

inline auto Fields(const protocol::ScanRequest& m) {
  return std::tuple{int{m.id}, m.x, m.y, int{m.after}};
}

inline auto Fields(const protocol::ScanAnswer& m) {
  std::vector<std::vector<int>> rows;
  for (int i = 0; i < m.count; ++i) {
    rows.push_back({m.rows[i].tag, m.rows[i].dx, m.rows[i].dy, m.rows[i].generation});
  }
  return std::tuple{int{m.id}, int{m.more}, rows};
}

inline auto Fields(const protocol::TagReadRequest& m) {
  return std::tuple{int{m.id}, m.x, m.y, int{m.tag}, int{m.slot}};
}

inline auto Fields(const protocol::TagReadAnswer& m) {
  return std::tuple{int{m.id},
                    int{m.tag},
                    std::vector<int>{m.slot, m.next, m.slots},
                    int{m.tag_generation},
                    int{m.slot_generation},
                    int{m.lease_s},
                    int{m.flags},
                    std::vector<int32_t>(std::begin(m.words), std::end(m.words))};
}

inline auto Fields(const protocol::TagWriteRequest& m) {
  return std::tuple{std::vector<int>{m.id, m.seq, m.tag, m.slot, m.flags, m.expected, m.lease_s},
                    m.x, m.y, m.time, std::vector<int32_t>(std::begin(m.words), std::end(m.words))};
}

inline auto Fields(const protocol::TagEraseRequest& m) {
  return std::tuple{int{m.id},  int{m.seq},  m.x,          m.y,
                    int{m.tag}, int{m.slot}, int{m.flags}, int{m.expected}};
}

inline auto Fields(const protocol::TagWritten& m) {
  return std::tuple{int{m.id},
                    m.erased,
                    int{m.seq},
                    int{m.tag},
                    int{m.slot},
                    int{m.slot_generation},
                    int{m.tag_generation}};
}

inline auto Fields(const protocol::SymbolRequest& m) {
  return std::tuple{int{m.id}, int{m.seq}, static_cast<int>(m.kind), m.number,
                    std::vector<int>(m.text, m.text + m.length)};
}

inline auto Fields(const protocol::SymbolAnswer& m) {
  return std::tuple{int{m.id}, int{m.seq}, static_cast<int>(m.kind), m.number};
}

inline auto Fields(const protocol::ResolveRequest& m) {
  return std::tuple{int{m.id}, static_cast<int>(m.kind), m.robot, m.number, int{m.offset}};
}

inline auto Fields(const protocol::ResolveAnswer& m) {
  return std::tuple{int{m.id},
                    static_cast<int>(m.kind),
                    m.robot,
                    m.number,
                    m.rows,
                    int{m.length},
                    std::vector<int>(m.text, m.text + m.count)};
}

/// Encode, whether it can fail or not.
template <typename Struct>
bool TryEncode(const Struct& from, protocol::Message* to) {
  if constexpr (std::is_void_v<decltype(Encode(from, to))>) {
    Encode(from, to);
    return true;
  } else {
    return Encode(from, to);
  }
}

}  // namespace pheromone::testing
