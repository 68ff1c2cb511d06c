// CMAC, and what both ends of a signed link compute, against the vectors.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "protocol/byte_order.h"
#include "protocol/coded_frame.h"
#include "protocol/decoder.h"
#include "protocol/signing.h"
#include "protocol/testing/vectors.h"

namespace pheromone::protocol {
namespace {

using testing::Bytes;
using testing::SignedVector;

Bytes MacOf(const SignedVector& vector) {
  MacKey<Aes> key;
  key.Set(vector.key.data());
  Bytes mac(kAesBlock);
  const MacHead head{static_cast<MacUse>(vector.use), vector.counter, vector.covered[0],
                     vector.covered[1]};
  ComputeMac(key, head, vector.covered.data() + 2, static_cast<uint8_t>(vector.covered.size() - 2),
             mac.data());
  return mac;
}

SignedVector Named(const std::string& name) {
  for (const SignedVector& vector : testing::LoadSigned()) {
    if (vector.name == name) {
      return vector;
    }
  }
  throw std::runtime_error("no signed vector is called " + name);
}

// The bytes before the tag that are not covered as DATA, and the counter that they stand for.
struct Added {
  size_t before_tag = 0;
  uint32_t counter = 0;
};

Added AddedOf(const SignedVector& vector, const Bytes& body) {
  const auto low = [&body](size_t at) {
    return static_cast<uint32_t>(body[body.size() - kTagSize - at]);
  };
  switch (static_cast<MacUse>(vector.use)) {
    case MacUse::kClientFrame:
    case MacUse::kServerFrame:
      return {1, NextCounter(vector.last, low(1), 0xFFu)};
    case MacUse::kToAll:
      return {2, NextCounter(vector.last, low(2) | low(1) << 8, 0xFFFFu)};
    case MacUse::kHello:
      return {2, low(2) | low(1) << 8};
    default:
      return {0, vector.last};
  }
}

size_t SizeOfAdded(unsigned use) {
  const std::map<MacUse, size_t> sizes{{MacUse::kClientFrame, kSignature},
                                       {MacUse::kServerFrame, kSignature},
                                       {MacUse::kToAll, kSignatureToAll},
                                       {MacUse::kHello, kSignatureOfHello},
                                       {MacUse::kGreeting, kTagSize}};
  return sizes.at(static_cast<MacUse>(use));
}

Bytes DecodedBody(const Bytes& wire) {
  FrameDecoder decoder(0);
  Bytes body;
  for (const uint8_t byte : wire) {
    if (decoder.Push(byte, 0)) {
      body = testing::ToBody(decoder.message());
    }
  }
  return body;
}

TEST(SignedVectors, EveryMacIsComputed) {
  std::map<std::string, int> seen;
  for (const SignedVector& vector : testing::LoadSigned()) {
    if (!vector.mac.empty()) {
      EXPECT_EQ(MacOf(vector), vector.mac) << vector.name;
    }
    ++seen[vector.verdict];
  }
  EXPECT_GE(seen["ok"], 20);
  EXPECT_GE(seen["wrong"], 50);
  EXPECT_EQ(seen["key"], 2);
}

TEST(SignedVectors, CounterAndTagOfEveryFrameGiveTheVerdict) {
  for (const SignedVector& vector : testing::LoadSigned()) {
    if (vector.verdict == "key" || vector.name.find("_coded") != std::string::npos) {
      continue;
    }
    SCOPED_TRACE(vector.name);
    const Bytes body = DecodedBody(vector.wire);
    if (vector.mac.empty()) {
      EXPECT_LT(body.size(), 2 + SizeOfAdded(vector.use));
      EXPECT_EQ(vector.verdict, "wrong");
      continue;
    }
    ASSERT_GE(body.size(), 2 + SizeOfAdded(vector.use));
    const Added added = AddedOf(vector, body);
    EXPECT_EQ(added.counter, vector.counter);
    const Bytes covered(body.begin(),
                        body.end() - static_cast<std::ptrdiff_t>(added.before_tag + kTagSize));
    EXPECT_EQ(covered, vector.covered);
    const bool same = SameTag(body.data() + body.size() - kTagSize, MacOf(vector).data());
    EXPECT_EQ(same, vector.verdict == "ok");
  }
}

// ID, OPCODE, DATA and what is added, of the covered bytes.
Bytes SignedBody(const SignedVector& vector) {
  Bytes body = vector.covered;
  for (size_t i = 0; i < SizeOfAdded(vector.use) - kTagSize; ++i) {
    body.push_back(static_cast<uint8_t>((vector.counter >> (8 * i)) & 0xFFu));
  }
  body.insert(body.end(), vector.mac.begin(), vector.mac.begin() + kTagSize);
  return body;
}

TEST(SignedVectors, ACodedFrameCodesItsSignature) {
  int seen = 0;
  for (const char* name : {"round_coded", "round_coded_rows_as_unsigned", "round_coded_largest",
                           "greeting_coded", "hello_answer_coded"}) {
    SCOPED_TRACE(name);
    const SignedVector vector = Named(name);
    const Bytes body = SignedBody(vector);
    Bytes wire(CodedBytes(body.size() - 2));
    ASSERT_EQ(EncodeCoded(testing::ToMessage(body), wire.data()), wire.size());
    EXPECT_EQ(wire, vector.wire);
    ++seen;
  }
  EXPECT_EQ(seen, 5);
}

TEST(SignedVectors, ACodedFrameArrivesThoughItIsDamaged) {
  int arrived = 0;
  int lost = 0;
  for (const SignedVector& vector : testing::LoadSigned()) {
    if (vector.name.find("_coded") != std::string::npos) {
      const bool arrives = vector.verdict == "ok";
      EXPECT_EQ(DecodedBody(vector.wire), arrives ? SignedBody(vector) : Bytes{}) << vector.name;
      ++(arrives ? arrived : lost);
    }
  }
  EXPECT_GE(arrived, 15);
  EXPECT_GE(lost, 3);
}

// The session's key is that of its frames, and the greeting's mask hides that of the frames to all.
TEST(SignedVectors, TheKeysAreThoseOfTheFrames) {
  EXPECT_EQ(Named("session_key").mac, Named("sense").key);
  const Bytes greeting = DecodedBody(Named("greeting").wire);
  ASSERT_TRUE(IsGreeting(testing::ToMessage(greeting)));
  const SignedVector halt = Named("halt_to_all");
  const auto data = greeting.begin() + 2;
  const Bytes mask = Named("group_mask").mac;
  Bytes group(kAesBlock);
  std::transform(mask.begin(), mask.end(), data + kGroupKeyAt, group.begin(),
                 [](uint8_t a, uint8_t b) { return static_cast<uint8_t>(a ^ b); });
  EXPECT_EQ(group, halt.key);
  EXPECT_EQ(GetU32(&*(data + kGroupCounterAt)), halt.last);
  const Bytes nonces(data, data + kGroupKeyAt);
  const Bytes derived_from = Named("session_key").covered;
  EXPECT_EQ(nonces, Bytes(derived_from.begin() + 2, derived_from.end()));
}

TEST(SignedVectors, TheReadmeQuotesThem) {
  std::ifstream stream(std::string(PHEROMONE_SOURCE_DIR) + "/protocol/README.md");
  std::string readme;
  for (std::string word; stream >> word;) {
    std::erase(word, '`');
    readme += word + " ";
  }
  const auto hexadecimal = [](const Bytes& bytes) {
    std::string text;
    for (const uint8_t byte : bytes) {
      constexpr char kDigits[] = "0123456789ABCDEF";
      text += {kDigits[byte / 16], kDigits[byte % 16], ' '};
    }
    return text;
  };
  for (const char* name : {"hello", "greeting", "hello_in_session", "hello_answer", "sense",
                           "sense_answer", "halt_to_all", "greeting_coded"}) {
    EXPECT_NE(readme.find(hexadecimal(Named(name).wire)), std::string::npos) << name;
    EXPECT_NE(readme.find(hexadecimal(Named(name).key)), std::string::npos) << name;
  }
  EXPECT_NE(readme.find(hexadecimal(Named("group_mask").mac)), std::string::npos);
}

}  // namespace
}  // namespace pheromone::protocol
