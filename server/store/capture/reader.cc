#include "server/store/capture/reader.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <utility>
#include <vector>

namespace pheromone::capture {

CaptureReader::CaptureReader(ByteReader::Source source, std::string name)
    : CaptureReader(std::move(source), std::move(name), Position{}) {}

CaptureReader::CaptureReader(ByteReader::Source source, std::string name, const Position& from)
    : reader_(std::move(source)), name_(std::move(name)), at_(from) {}

Error CaptureReader::Wrong(const std::string& what) const {
  return Error{name_ + ": block " + std::to_string(at_.block) + ", at byte " +
               std::to_string(at_.byte) + ": " + what};
}

Result<std::optional<Found>> CaptureReader::Next() {
  if (!error_.empty()) {
    return Error{error_};
  }
  if (ended_) {
    return std::optional<Found>();
  }
  Result<std::optional<Found>> result = Read();
  if (!result.ok()) {
    error_ = result.error();
  } else if (!result.value()) {
    ended_ = true;
  }
  return result;
}

Result<std::optional<Found>> CaptureReader::Read() {
  while (!reader_.AtEnd()) {
    ++at_.block;
    const uint32_t type = reader_.U32();
    const uint32_t length = reader_.U32();
    if (at_.block == 1 && type != kSectionHeader) {
      return Wrong("not a pcapng file");
    }
    if (!reader_.ok()) {
      return Wrong("the file is truncated");
    }
    if (length < 12 || length % 4 != 0 || length > kMaxBlock) {
      return Wrong("a block of " + std::to_string(length) + " bytes");
    }
    if (!IsRecord(type) && at_.byte + length > kMaxFileHeader) {
      return Wrong(at_.number != 0 ? "unexpected block type"
                                   : "more than 1 MiB before the start record");
    }
    std::string body;
    for (uint32_t left = length - 12; left > 0 && reader_.ok(); --left) {
      body += static_cast<char>(reader_.U8());
    }
    const uint32_t length_again = reader_.U32();
    if (!reader_.ok()) {
      return Wrong("the file is truncated");
    }
    if (length_again != length) {
      return Wrong("a damaged block: block length fields differ");
    }
    Found found;
    found.byte = at_.byte;
    if (type == kSectionHeader) {
      static constexpr char kLittleEndian[] = {0x4D, 0x3C, 0x2B, 0x1A};
      if (at_.block != 1 || body.compare(0, 4, kLittleEndian, 4) != 0) {
        return Wrong("a section not written by pheromoned");
      }
    } else if (type == kInterface) {
      ++at_.interfaces;
    } else if (IsRecord(type)) {
      Result<Numbered> decoded = DecodeRecord(type, body);
      if (!decoded.ok()) {
        return Wrong(decoded.error());
      }
      found.number = decoded.value().number;
      found.record = std::move(decoded.value().record);
      const auto* packet = std::get_if<Packet>(&found.record);
      at_.packet += packet != nullptr ? 1 : 0;
      found.packet = at_.packet;
      if (at_.number == 0 && !std::holds_alternative<Start>(found.record)) {
        return Wrong("the start record is missing");
      }
      if (found.number != at_.number + 1) {
        return Wrong("not replayable from here: record " + std::to_string(at_.number + 1) +
                     " is missing; this is " + std::to_string(found.number));
      }
      if (packet != nullptr && packet->link >= at_.interfaces) {
        return Wrong("a packet of an unknown link");
      }
      at_.number = found.number;
      at_.byte += length;
      return std::optional(std::move(found));
    } else {
      return Wrong("unexpected block type");
    }
    at_.byte += length;
  }
  if (at_.number == 0) {
    ++at_.block;
    return Wrong(at_.block == 1 ? "the file is empty" : "the start record is missing");
  }
  return std::optional<Found>();
}

Result<ByteReader::Source> OpenFile(const std::string& path, uint64_t from) {
  auto file = std::make_shared<std::ifstream>(path, std::ios::binary);
  if (!file->is_open()) {
    return Error{path + ": cannot be opened: " + std::strerror(errno)};
  }
  file->peek();  // a folder can be opened, but not read
  if (file->bad()) {
    return Error{path + ": cannot be read: " + std::strerror(errno)};
  }
  file->clear();  // an empty file is reported when it is read
  file->seekg(static_cast<std::streamoff>(from));
  auto portion = std::make_shared<std::vector<char>>(size_t{1} << 16);
  return ByteReader::Source([file, portion]() -> std::string_view {
    file->read(portion->data(), static_cast<std::streamsize>(portion->size()));
    return {portion->data(), static_cast<size_t>(file->gcount())};
  });
}

}  // namespace pheromone::capture
