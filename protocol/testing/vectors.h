// The test vectors of protocol/vectors, for the tests of every folder.
//
//   for (const FrameVector& vector : LoadFrames()) {
//     if (vector.delivered()) Expect(vector.wire, ToMessage(*vector.body));
//   }
//
// The files' format is described at the head of each and in protocol/README.md. Host only. Needs
// the macro PHEROMONE_SOURCE_DIR (the project's root). A file that cannot be read or understood
// throws std::runtime_error naming it and its line: a test of ours is broken then.
#pragma once

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "protocol/frame.h"

namespace pheromone::testing {

using Bytes = std::vector<uint8_t>;

/// A line of crc.txt.
struct CrcVector {
  Bytes bytes;
  uint16_t crc = 0;
};

/// A line of frames.txt.
struct FrameVector {
  std::string name;
  std::optional<Bytes> body;  ///< ID, OPCODE, DATA; empty where the wire holds no such thing
  Bytes wire;
  std::string verdict;

  /// Whether a decoder hands the message on, whatever the next layer then says to it.
  bool delivered() const {
    return verdict == "ok" || verdict == "unknown-opcode" || verdict == "bad-length" ||
           verdict == "bad-value";
  }
};

/// A line of fields.txt.
struct FieldsVector {
  std::string name;     ///< of the frame
  std::string message;  ///< "SENSE", "SENSE_ANSWER" ...
  std::map<std::string, std::string> fields;
};

/// A line of streams.txt.
struct StreamVector {
  std::string name;
  Bytes bytes;
  std::vector<Bytes> delivered;
};

/// A line of net_records.txt.
struct NetRecordVector {
  std::string name;
  std::string wanted;  ///< "trigger", "environment" or "robot"
  uint32_t hash = 0;   ///< of the reader's net
  Bytes bytes;
  std::string verdict;
  std::map<std::string, std::string> fields;
};

/// A line of signed.txt.
struct SignedVector {
  std::string name;
  Bytes key;          ///< 16
  unsigned use = 0;   ///< a protocol::MacUse
  uint32_t last = 0;  ///< the last accepted counter
  Bytes wire;         ///< empty where there is no frame
  Bytes covered;      ///< ID, OPCODE, DATA; empty if the frame is too short for a tag
  uint32_t counter = 0;
  Bytes mac;  ///< what the receiver computes, 16 bytes; empty if the frame is too short
  std::string verdict;
};

/// ID, OPCODE and DATA as a message; at least two bytes, at most 2 + kMaxData.
inline protocol::Message ToMessage(const Bytes& body) {
  if (body.size() < 2 || body.size() > 2u + protocol::kMaxData) {
    throw std::runtime_error("no message has a body of " + std::to_string(body.size()) + " bytes");
  }
  protocol::Message message;
  message.id = body[0];
  message.opcode = body[1];
  message.length = static_cast<uint8_t>(body.size() - 2);
  for (size_t i = 2; i < body.size(); ++i) {
    message.data[i - 2] = body[i];
  }
  return message;
}

/// ID, OPCODE and DATA of a message whose length is within bounds.
inline Bytes ToBody(const protocol::Message& message) {
  Bytes body(2u + message.length);
  body[0] = message.id;
  body[1] = message.opcode;
  for (size_t i = 0; i < message.length; ++i) {
    body[2 + i] = message.data[i];
  }
  return body;
}

namespace internal {

inline std::vector<std::string> Split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) {
    const size_t first = part.find_first_not_of(' ');
    const size_t last = part.find_last_not_of(' ');
    parts.push_back(first == std::string::npos ? "" : part.substr(first, last - first + 1));
  }
  return parts;
}

inline unsigned ParseHex(const std::string& digits) {
  size_t used = 0;
  const unsigned long value = std::stoul(digits, &used, 16);
  if (used != digits.size() || value > 0xFFFF) {
    throw std::runtime_error("not hexadecimal: " + digits);
  }
  return static_cast<unsigned>(value);
}

/// Calls `on_line(columns)` for each line of a vector file that is not a comment.
template <typename OnLine>
void ForEachLine(const std::string& file, size_t columns, OnLine&& on_line) {
  const std::string path = std::string(PHEROMONE_SOURCE_DIR) + "/protocol/vectors/" + file;
  std::ifstream stream(path);
  if (!stream) {
    throw std::runtime_error("cannot read " + path);
  }
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    if (line.empty() || line.front() == '#') {
      continue;
    }
    const std::string where = path + ":" + std::to_string(number) + ": ";
    const std::vector<std::string> parts = Split(line, '|');
    if (parts.size() != columns) {
      throw std::runtime_error(where + "expected " + std::to_string(columns) + " columns");
    }
    try {
      on_line(parts);
    } catch (const std::exception& error) {
      throw std::runtime_error(where + error.what());
    }
  }
}

}  // namespace internal

/// "01 02 FF", or "-" for none.
inline Bytes ParseBytes(const std::string& text) {
  Bytes bytes;
  if (text == "-") {
    return bytes;
  }
  for (const std::string& digits : internal::Split(text, ' ')) {
    const unsigned value = internal::ParseHex(digits);
    if (value > 0xFF || digits.size() != 2) {
      throw std::runtime_error("not a byte: " + digits);
    }
    bytes.push_back(static_cast<uint8_t>(value));
  }
  return bytes;
}

/// "a=1 b=2".
inline std::map<std::string, std::string> ParseFields(const std::string& text) {
  std::map<std::string, std::string> fields;
  for (const std::string& field : internal::Split(text, ' ')) {
    const size_t equals = field.find('=');
    if (equals == std::string::npos) {
      throw std::runtime_error("expected field=value: " + field);
    }
    fields[field.substr(0, equals)] = field.substr(equals + 1);
  }
  return fields;
}

inline std::vector<CrcVector> LoadCrcs() {
  std::vector<CrcVector> all;
  internal::ForEachLine("crc.txt", 2, [&all](const std::vector<std::string>& column) {
    all.push_back({ParseBytes(column[0]), static_cast<uint16_t>(internal::ParseHex(column[1]))});
  });
  return all;
}

inline std::vector<FrameVector> LoadFrames() {
  std::vector<FrameVector> all;
  internal::ForEachLine("frames.txt", 4, [&all](const std::vector<std::string>& column) {
    FrameVector vector{column[0], std::nullopt, ParseBytes(column[2]), column[3]};
    if (column[1] != "-") {
      vector.body = ParseBytes(column[1]);
    }
    all.push_back(vector);
  });
  return all;
}

inline std::vector<FieldsVector> LoadFields() {
  std::vector<FieldsVector> all;
  internal::ForEachLine("fields.txt", 3, [&all](const std::vector<std::string>& column) {
    all.push_back({column[0], column[1], ParseFields(column[2])});
  });
  return all;
}

inline std::vector<NetRecordVector> LoadNetRecords() {
  std::vector<NetRecordVector> all;
  internal::ForEachLine("net_records.txt", 6, [&all](const std::vector<std::string>& column) {
    NetRecordVector vector{column[0], column[1], 0, ParseBytes(column[3]), column[4], {}};
    vector.hash = static_cast<uint32_t>(std::stoul(column[2], nullptr, 16));
    if (column[5] != "-") {
      vector.fields = ParseFields(column[5]);
    }
    all.push_back(vector);
  });
  return all;
}

inline std::vector<SignedVector> LoadSigned() {
  std::vector<SignedVector> all;
  internal::ForEachLine("signed.txt", 9, [&all](const std::vector<std::string>& column) {
    const auto number = [&column](size_t i) {
      return static_cast<uint32_t>(std::stoul(column[i]));
    };
    all.push_back({column[0], ParseBytes(column[1]), number(2), number(3), ParseBytes(column[4]),
                   ParseBytes(column[5]), number(6), ParseBytes(column[7]), column[8]});
  });
  return all;
}

inline std::vector<StreamVector> LoadStreams() {
  std::vector<StreamVector> all;
  internal::ForEachLine("streams.txt", 3, [&all](const std::vector<std::string>& column) {
    StreamVector vector{column[0], ParseBytes(column[1]), {}};
    if (column[2] != "-") {
      for (const std::string& body : internal::Split(column[2], ';')) {
        vector.delivered.push_back(ParseBytes(body));
      }
    }
    all.push_back(vector);
  });
  return all;
}

/// One frame by name.
inline FrameVector LoadFrame(const std::string& name) {
  for (const FrameVector& vector : LoadFrames()) {
    if (vector.name == name) {
      return vector;
    }
  }
  throw std::runtime_error("no frame is called " + name);
}

}  // namespace pheromone::testing
