#include "protocol/aes.h"

#if defined(__AVR__)
#include <avr/pgmspace.h>
#endif

namespace pheromone {
namespace protocol {
namespace {

#if defined(__AVR__)  // otherwise the table would take RAM
#define PHEROMONE_TABLE PROGMEM
#define PHEROMONE_FROM_TABLE(at) pgm_read_byte(at)
// The images are built for size, which makes calls of the smallest functions.
#define PHEROMONE_IN_PLACE inline __attribute__((always_inline))
#else
#define PHEROMONE_TABLE
#define PHEROMONE_FROM_TABLE(at) (*(at))
#define PHEROMONE_IN_PLACE inline
#endif

// FIPS 197, figure 7.
// clang-format off
const uint8_t kSubstitutes[256] PHEROMONE_TABLE = {
    0x63, 0x7C, 0x77, 0x7B, 0xF2, 0x6B, 0x6F, 0xC5, 0x30, 0x01, 0x67, 0x2B, 0xFE, 0xD7, 0xAB, 0x76,
    0xCA, 0x82, 0xC9, 0x7D, 0xFA, 0x59, 0x47, 0xF0, 0xAD, 0xD4, 0xA2, 0xAF, 0x9C, 0xA4, 0x72, 0xC0,
    0xB7, 0xFD, 0x93, 0x26, 0x36, 0x3F, 0xF7, 0xCC, 0x34, 0xA5, 0xE5, 0xF1, 0x71, 0xD8, 0x31, 0x15,
    0x04, 0xC7, 0x23, 0xC3, 0x18, 0x96, 0x05, 0x9A, 0x07, 0x12, 0x80, 0xE2, 0xEB, 0x27, 0xB2, 0x75,
    0x09, 0x83, 0x2C, 0x1A, 0x1B, 0x6E, 0x5A, 0xA0, 0x52, 0x3B, 0xD6, 0xB3, 0x29, 0xE3, 0x2F, 0x84,
    0x53, 0xD1, 0x00, 0xED, 0x20, 0xFC, 0xB1, 0x5B, 0x6A, 0xCB, 0xBE, 0x39, 0x4A, 0x4C, 0x58, 0xCF,
    0xD0, 0xEF, 0xAA, 0xFB, 0x43, 0x4D, 0x33, 0x85, 0x45, 0xF9, 0x02, 0x7F, 0x50, 0x3C, 0x9F, 0xA8,
    0x51, 0xA3, 0x40, 0x8F, 0x92, 0x9D, 0x38, 0xF5, 0xBC, 0xB6, 0xDA, 0x21, 0x10, 0xFF, 0xF3, 0xD2,
    0xCD, 0x0C, 0x13, 0xEC, 0x5F, 0x97, 0x44, 0x17, 0xC4, 0xA7, 0x7E, 0x3D, 0x64, 0x5D, 0x19, 0x73,
    0x60, 0x81, 0x4F, 0xDC, 0x22, 0x2A, 0x90, 0x88, 0x46, 0xEE, 0xB8, 0x14, 0xDE, 0x5E, 0x0B, 0xDB,
    0xE0, 0x32, 0x3A, 0x0A, 0x49, 0x06, 0x24, 0x5C, 0xC2, 0xD3, 0xAC, 0x62, 0x91, 0x95, 0xE4, 0x79,
    0xE7, 0xC8, 0x37, 0x6D, 0x8D, 0xD5, 0x4E, 0xA9, 0x6C, 0x56, 0xF4, 0xEA, 0x65, 0x7A, 0xAE, 0x08,
    0xBA, 0x78, 0x25, 0x2E, 0x1C, 0xA6, 0xB4, 0xC6, 0xE8, 0xDD, 0x74, 0x1F, 0x4B, 0xBD, 0x8B, 0x8A,
    0x70, 0x3E, 0xB5, 0x66, 0x48, 0x03, 0xF6, 0x0E, 0x61, 0x35, 0x57, 0xB9, 0x86, 0xC1, 0x1D, 0x9E,
    0xE1, 0xF8, 0x98, 0x11, 0x69, 0xD9, 0x8E, 0x94, 0x9B, 0x1E, 0x87, 0xE9, 0xCE, 0x55, 0x28, 0xDF,
    0x8C, 0xA1, 0x89, 0x0D, 0xBF, 0xE6, 0x42, 0x68, 0x41, 0x99, 0x2D, 0x0F, 0xB0, 0x54, 0xBB, 0x16,
};
// clang-format on

PHEROMONE_IN_PLACE uint8_t Substitute(uint8_t byte) {
  return PHEROMONE_FROM_TABLE(&kSubstitutes[byte]);
}

// Times x in GF(2^8) with x^8 + x^4 + x^3 + x + 1.
PHEROMONE_IN_PLACE uint8_t Double(uint8_t byte) {
  const uint8_t twice = static_cast<uint8_t>(byte << 1);
  const uint8_t carry = static_cast<uint8_t>(-(byte >> 7));  // all bits, or none
  return static_cast<uint8_t>(twice ^ (0x1Bu & carry));
}

PHEROMONE_IN_PLACE void MixColumn(uint8_t* a, uint8_t* b, uint8_t* c, uint8_t* d) {
  const uint8_t first = *a;
  const uint8_t all = *a ^ *b ^ *c ^ *d;
  *a = static_cast<uint8_t>(*a ^ all ^ Double(*a ^ *b));
  *b = static_cast<uint8_t>(*b ^ all ^ Double(*b ^ *c));
  *c = static_cast<uint8_t>(*c ^ all ^ Double(*c ^ *d));
  *d = static_cast<uint8_t>(*d ^ all ^ Double(*d ^ first));
}

}  // namespace

void Aes::Set(const uint8_t* key) {
  for (uint8_t i = 0; i < kAesBlock; ++i) {
    keys_[i] = key[i];
  }
  uint8_t constant = 1;
  for (uint8_t i = kAesBlock; i != uint8_t{sizeof(keys_)}; ++i) {
    uint8_t byte = keys_[i - 4u];
    if (i % kAesBlock < 4) {  // the last word, turned by a byte
      byte = Substitute(keys_[i % 4 == 3 ? i - 7u : i - 3u]);
      if (i % kAesBlock == 0) {
        byte ^= constant;
        constant = Double(constant);
      }
    }
    keys_[i] = keys_[i - kAesBlock] ^ byte;
  }
}

// The state in variables, which an AVR keeps in registers: column a is a0 to a3. Loops over an
// array take it three times as long, and a ROUND is to be verified before its first turn begins.
void Aes::Encrypt(uint8_t* block) const {
  const uint8_t* key = keys_;
  uint8_t a0 = block[0] ^ *key++;
  uint8_t a1 = block[1] ^ *key++;
  uint8_t a2 = block[2] ^ *key++;
  uint8_t a3 = block[3] ^ *key++;
  uint8_t b0 = block[4] ^ *key++;
  uint8_t b1 = block[5] ^ *key++;
  uint8_t b2 = block[6] ^ *key++;
  uint8_t b3 = block[7] ^ *key++;
  uint8_t c0 = block[8] ^ *key++;
  uint8_t c1 = block[9] ^ *key++;
  uint8_t c2 = block[10] ^ *key++;
  uint8_t c3 = block[11] ^ *key++;
  uint8_t d0 = block[12] ^ *key++;
  uint8_t d1 = block[13] ^ *key++;
  uint8_t d2 = block[14] ^ *key++;
  uint8_t d3 = block[15] ^ *key++;
  for (uint8_t round = 1;; ++round) {
    // SubBytes; ShiftRows turns row r left by r.
    a0 = Substitute(a0);
    b0 = Substitute(b0);
    c0 = Substitute(c0);
    d0 = Substitute(d0);
    uint8_t turned = a1;
    a1 = Substitute(b1);
    b1 = Substitute(c1);
    c1 = Substitute(d1);
    d1 = Substitute(turned);
    turned = a2;
    a2 = Substitute(c2);
    c2 = Substitute(turned);
    turned = b2;
    b2 = Substitute(d2);
    d2 = Substitute(turned);
    turned = d3;
    d3 = Substitute(c3);
    c3 = Substitute(b3);
    b3 = Substitute(a3);
    a3 = Substitute(turned);
    if (round != kRounds) {
      MixColumn(&a0, &a1, &a2, &a3);
      MixColumn(&b0, &b1, &b2, &b3);
      MixColumn(&c0, &c1, &c2, &c3);
      MixColumn(&d0, &d1, &d2, &d3);
    }
    a0 = static_cast<uint8_t>(a0 ^ *key++);
    a1 = static_cast<uint8_t>(a1 ^ *key++);
    a2 = static_cast<uint8_t>(a2 ^ *key++);
    a3 = static_cast<uint8_t>(a3 ^ *key++);
    b0 = static_cast<uint8_t>(b0 ^ *key++);
    b1 = static_cast<uint8_t>(b1 ^ *key++);
    b2 = static_cast<uint8_t>(b2 ^ *key++);
    b3 = static_cast<uint8_t>(b3 ^ *key++);
    c0 = static_cast<uint8_t>(c0 ^ *key++);
    c1 = static_cast<uint8_t>(c1 ^ *key++);
    c2 = static_cast<uint8_t>(c2 ^ *key++);
    c3 = static_cast<uint8_t>(c3 ^ *key++);
    d0 = static_cast<uint8_t>(d0 ^ *key++);
    d1 = static_cast<uint8_t>(d1 ^ *key++);
    d2 = static_cast<uint8_t>(d2 ^ *key++);
    d3 = static_cast<uint8_t>(d3 ^ *key++);
    if (round == kRounds) {
      break;
    }
  }
  block[0] = a0;
  block[1] = a1;
  block[2] = a2;
  block[3] = a3;
  block[4] = b0;
  block[5] = b1;
  block[6] = b2;
  block[7] = b3;
  block[8] = c0;
  block[9] = c1;
  block[10] = c2;
  block[11] = c3;
  block[12] = d0;
  block[13] = d1;
  block[14] = d2;
  block[15] = d3;
}

void DoubleBlock(uint8_t* block) {
  const uint8_t carry = static_cast<uint8_t>(-(block[0] >> 7));  // all bits, or none
  for (uint8_t i = 0; i < kAesBlock; ++i) {
    const uint8_t next = i + 1u < kAesBlock ? block[i + 1u] : uint8_t{0};
    block[i] = static_cast<uint8_t>((block[i] << 1) | (next >> 7));
  }
  const uint8_t last = block[kAesBlock - 1];
  block[kAesBlock - 1] = static_cast<uint8_t>(last ^ (0x87u & carry));
}

}  // namespace protocol
}  // namespace pheromone
