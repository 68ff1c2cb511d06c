#include "client_fw/sim/avr/avr_image.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <vector>

namespace pheromone::sim {
namespace {

// The tool chain keeps the three memories apart by these offsets.
constexpr uint32_t kRam = 0x800000;
constexpr uint32_t kEeprom = 0x810000;
constexpr uint32_t kRamBegin = kRam + 0x100;  // registers before

// ELF32, by offset: file header and section headers.
constexpr size_t kMachine = 0x12;
constexpr size_t kSections = 0x20;
constexpr size_t kSectionSize = 0x2E;
constexpr size_t kSectionCount = 0x30;
constexpr size_t kHeaderSize = 0x34;
constexpr size_t kType = 4;
constexpr size_t kFlags = 8;
constexpr size_t kAddress = 12;
constexpr size_t kSize = 20;
constexpr size_t kLeastSection = 40;
constexpr uint16_t kAvr = 83;
constexpr uint32_t kNoBits = 8;
constexpr uint32_t kAllocated = 2;

class File {
 public:
  explicit File(const std::string& path) : path_(path) {
    std::ifstream file(path, std::ios::binary);
    bytes_.assign(std::istreambuf_iterator<char>(file), {});
    static constexpr char kMagic[] = {0x7F, 'E', 'L', 'F', 1, 1};  // 32 bits, little-endian
    if (bytes_.size() < kHeaderSize || !std::equal(std::begin(kMagic), std::end(kMagic), At(0)) ||
        U16(kMachine) != kAvr) {
      throw std::runtime_error(path + " is not an ELF file for an AVR");
    }
  }

  uint16_t U16(size_t at) const {
    const auto* from = At(at, 2);
    return static_cast<uint16_t>(Byte(from[0]) | (Byte(from[1]) << 8));
  }
  uint32_t U32(size_t at) const { return U16(at) | (static_cast<uint32_t>(U16(at + 2)) << 16); }

 private:
  static uint8_t Byte(char c) { return static_cast<uint8_t>(c); }

  const char* At(size_t at, size_t size = 0) const {
    if (at > bytes_.size() || bytes_.size() - at < size) {
      throw std::runtime_error(path_ + " is cut off");
    }
    return bytes_.data() + at;
  }

  std::string path_;
  std::vector<char> bytes_;
};

}  // namespace

AvrImageSize ReadAvrImageSize(const std::string& path) {
  const File file(path);
  AvrImageSize result;
  uint32_t end = kRamBegin;
  const size_t size = std::max<size_t>(file.U16(kSectionSize), kLeastSection);
  for (size_t i = 0; i < file.U16(kSectionCount); ++i) {
    const size_t section = file.U32(kSections) + i * size;
    const uint32_t address = file.U32(section + kAddress);
    const uint32_t bytes = file.U32(section + kSize);
    if ((file.U32(section + kFlags) & kAllocated) == 0 || address >= kEeprom) {
      continue;
    }
    if (file.U32(section + kType) != kNoBits) {
      result.flash_bytes += bytes;
    }
    if (address >= kRam) {
      result.static_ram_bytes += bytes;
      end = std::max(end, address + bytes);
    }
  }
  result.static_ram_end = static_cast<uint16_t>(end - kRam);
  return result;
}

}  // namespace pheromone::sim
