#include "server/formats/maps/npy.h"

#include <gtest/gtest.h>

#include <cstring>

#include "server/formats/maps/testing/rasters.h"

namespace pheromone::maps {
namespace {

using testing::ErrorOf;
using testing::kNaN;
using testing::RasterOf;
using testing::Rows;
using testing::RowsOf;

// A file as the format's description has it, version 1.0.
std::string Npy(const std::string& header, const std::string& data) {
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes += static_cast<char>(header.size() % 256);
  bytes += static_cast<char>(header.size() / 256);
  return bytes + header + data;
}

std::string Dict(const std::string& descr, const std::string& order, const std::string& shape) {
  return "{'descr': '" + descr + "', 'fortran_order': " + order + ", 'shape': " + shape + ", }\n";
}

Rows Read(const std::string& descr, const std::string& data) {
  const size_t count = data.size() / static_cast<size_t>(descr[2] - '0');
  const auto read =
      ParseNpy(Npy(Dict(descr, "False", "(1, " + std::to_string(count) + ")"), data), "a.npy");
  EXPECT_TRUE(read.ok()) << ErrorOf(read);
  return read.ok() ? RowsOf(read.value()) : Rows();
}

std::string Bytes(std::initializer_list<int> bytes) {
  std::string text;
  for (const int byte : bytes) {
    text += static_cast<char>(byte);
  }
  return text;
}

std::string ErrorFor(const std::string& bytes) {
  return ErrorOf(ParseNpy(bytes, "a.npy"));
}

TEST(Npy, TheFirstRowOfTheArrayIsTheTopOne) {
  const auto read = ParseNpy(Npy(Dict("|u1", "False", "(2, 3)"), "\x01\x02\x03\x04\x05\x06"), "a");
  ASSERT_TRUE(read.ok()) << read.error();
  EXPECT_EQ(RowsOf(read.value()), (Rows{{1, 2, 3}, {4, 5, 6}}));
}

TEST(Npy, FortranOrderGoesDownTheColumns) {
  const auto read = ParseNpy(Npy(Dict("|u1", "True", "(2, 3)"), "\x01\x02\x03\x04\x05\x06"), "a");
  ASSERT_TRUE(read.ok()) << read.error();
  EXPECT_EQ(RowsOf(read.value()), (Rows{{1, 3, 5}, {2, 4, 6}}));
}

TEST(Npy, ElementsOfEachTypeAndByteOrderAreUnderstood) {
  EXPECT_EQ(Read("|b1", Bytes({0, 1})), (Rows{{0, 1}}));
  EXPECT_EQ(Read("|u1", Bytes({0, 127, 128, 255})), (Rows{{0, 127, 128, 255}}));
  EXPECT_EQ(Read("|i1", Bytes({0, 127, 128, 255})), (Rows{{0, 127, -128, -1}}));
  EXPECT_EQ(Read("<u2", Bytes({1, 2, 255, 255})), (Rows{{513, 65535}}));
  EXPECT_EQ(Read(">u2", Bytes({1, 2, 255, 255})), (Rows{{258, 65535}}));
  EXPECT_EQ(Read("<i2", Bytes({0, 128, 255, 255, 255, 127})), (Rows{{-32768, -1, 32767}}));
  EXPECT_EQ(Read(">i2", Bytes({128, 0, 255, 254})), (Rows{{-32768, -2}}));
  EXPECT_EQ(Read("<u4", Bytes({255, 255, 255, 255})), (Rows{{4294967295.0}}));
  EXPECT_EQ(Read(">u4", Bytes({0, 1, 0, 2})), (Rows{{65538}}));
  EXPECT_EQ(Read("<i4", Bytes({0, 0, 0, 128})), (Rows{{-2147483648.0}}));
  EXPECT_EQ(Read(">i4", Bytes({255, 255, 255, 255})), (Rows{{-1}}));
  EXPECT_EQ(Read("<i8", Bytes({0, 0, 0, 0, 0, 0, 0, 128})), (Rows{{-9223372036854775808.0}}));
  EXPECT_EQ(Read(">i8", Bytes({255, 255, 255, 255, 255, 255, 255, 254})), (Rows{{-2}}));
  EXPECT_EQ(Read(">u8", Bytes({128, 0, 0, 0, 0, 0, 0, 0})), (Rows{{9223372036854775808.0}}));
  EXPECT_EQ(Read("<f4", Bytes({0, 0, 0x20, 0xC1})), (Rows{{-10}}));
  EXPECT_EQ(Read(">f4", Bytes({0x3E, 0x80, 0, 0})), (Rows{{0.25}}));
  EXPECT_EQ(Read("<f8", Bytes({0, 0, 0, 0, 0, 0, 0xF8, 0x3F})), (Rows{{1.5}}));
  EXPECT_EQ(Read(">f8", Bytes({0xC0, 0, 0, 0, 0, 0, 0, 0})), (Rows{{-2}}));
}

TEST(Npy, AnIntegerThatADoubleCannotHoldIsNotRounded) {
  EXPECT_EQ(Read("<u8", Bytes({0, 0, 0, 0, 0, 0, 32, 0})), (Rows{{9007199254740992.0}}));
  const std::string dict = Dict("<u8", "False", "(1, 1)");
  EXPECT_EQ(ErrorFor(Npy(dict, Bytes({1, 0, 0, 0, 0, 0, 32, 0}))),
            "a.npy: byte " + std::to_string(10 + dict.size()) +
                ": found an integer that a 64-bit float cannot hold exactly");
}

TEST(Npy, TheHeaderMayBeLaidOutOtherwise) {
  const std::string odd = "{\"shape\":(1,2),\"fortran_order\":False,\"descr\":\"|u1\"}";
  EXPECT_TRUE(ParseNpy(Npy(odd, "ab"), "a").ok());
  std::string second("\x93NUMPY\x02\x00", 8);
  second += Bytes({static_cast<int>(odd.size()), 0, 0, 0}) + odd + "ab";
  const auto read = ParseNpy(second, "a");
  ASSERT_TRUE(read.ok()) << read.error();
  EXPECT_EQ(RowsOf(read.value()), (Rows{{'a', 'b'}}));
}

TEST(Npy, AHeaderOfMoreThan64KiBIsRefused) {
  const std::string dict = Dict("|u1", "False", "(1, 1)");
  const auto parse = [&dict](size_t length) {
    std::string bytes("\x93NUMPY\x02\x00", 8);
    for (const int shift : {0, 8, 16, 24}) {
      bytes += static_cast<char>(length >> shift & 0xFF);
    }
    return ErrorFor(bytes + dict + std::string(length - dict.size(), ' ') + "x");
  };
  EXPECT_EQ(parse(65'536), "no error");
  EXPECT_EQ(parse(65'537), "a.npy: byte 8: found a header of 65537 bytes, expected at most 65536");
}

TEST(Npy, IsWrittenByteForByteAsNumPyWritesIt) {
  // numpy.save(f, numpy.array([[1.5]])), 128 bytes of header as NumPy 1.24 pads it.
  const std::string bytes = EncodeNpy(RasterOf({{1.5}}));
  std::string dict = "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 1), }";
  dict.resize(117, ' ');
  EXPECT_EQ(bytes, std::string("\x93NUMPY\x01\x00\x76\x00", 10) + dict + "\n" +
                       Bytes({0, 0, 0, 0, 0, 0, 0xF8, 0x3F}));
}

TEST(Npy, ComesBackBitForBit) {
  Raster raster = RasterOf({{0.1, -0.0, kNaN}, {1e308, 5e-324, -1.0 / 3}});
  const auto back = ParseNpy(EncodeNpy(raster), "a");
  ASSERT_TRUE(back.ok()) << back.error();
  ASSERT_EQ(back.value().values.size(), raster.values.size());
  EXPECT_EQ(std::memcmp(back.value().values.data(), raster.values.data(),
                        raster.values.size() * sizeof(double)),
            0);
  EXPECT_EQ(back.value().columns, 3);
  EXPECT_EQ(back.value().rows, 2);
}

TEST(Npy, NoBeginningIsTakenForTheWhole) {
  testing::ExpectEveryBeginningRefused(EncodeNpy(RasterOf({{1, 2}, {3, 4}})), ParseNpy);
}

TEST(Npy, ErrorsSayWhereAndWhat) {
  EXPECT_EQ(ErrorFor("PK\x03\x04"), "a.npy: byte 0: expected \\x93NUMPY, as a .npy begins");
  EXPECT_EQ(ErrorFor(std::string("\x93NUMPY\x03\x00", 8)),
            "a.npy: byte 6: expected version 1.0 or 2.0 of the format");
  EXPECT_EQ(ErrorFor(std::string("\x93NUMPY\x01\x00\x0A\x00{}", 12)),
            "a.npy: byte 8: found a header of 10 bytes, expected at most 2");
  EXPECT_EQ(ErrorFor(Npy(Dict("|u1", "False", "(2, 2)"), "abc")).substr(14),
            ": found 3 bytes of values, expected 4");
  EXPECT_EQ(ErrorFor(Npy(Dict("|u1", "False", "(2, 2)"), "abcde")).substr(14),
            ": found 5 bytes of values, expected 4");
  EXPECT_EQ(ErrorFor(Npy("[]", "")), "a.npy: byte 10: found \"[]\", expected {");
  EXPECT_EQ(ErrorFor(Npy("{}", "")),
            "a.npy: byte 12: found the end of the header, expected "
            "'descr', 'fortran_order' and 'shape' before it");
  EXPECT_EQ(ErrorFor(Npy("{'descr': 5}", "")),
            "a.npy: byte 20: found \"5}\", expected the type '|b1', '|u1', '|i1' or < or > with "
            "u2, u4, u8, i2, i4, i8, f4, f8");
  EXPECT_EQ(ErrorFor(Npy("{'kind': 5}", "")),
            "a.npy: byte 11: found \"'kind': 5}\", expected 'descr', 'fortran_order' or 'shape'");
}

TEST(Npy, OtherTypesAndShapesAreRefused) {
  for (const char* descr : {"|O", "<c8", "<f2", "|u2", "|S1", "=f8", "<f9", "", "<M8[ns]"}) {
    EXPECT_FALSE(ParseNpy(Npy(Dict(descr, "False", "(1, 1)"), std::string(8, 'x')), "a").ok())
        << descr;
  }
  for (const char* shape :
       {"()", "(8,)", "(2, 2, 2)", "(-1, 8)", "(0, 8)", "(8, 1", "8", "(a, 1)", "(1 8)"}) {
    EXPECT_FALSE(ParseNpy(Npy(Dict("|u1", "False", shape), std::string(8, 'x')), "a").ok())
        << shape;
  }
}

TEST(Npy, AHugeClaimIsRefusedFromTheHeader) {
  for (const char* shape :
       {"(1000000000, 1000000000)", "(30000, 30000)", "(4294967296, 4294967296)",
        "(18446744073709551616, 1)", "(99999999999999999999999999, 1)"}) {
    EXPECT_FALSE(ParseNpy(Npy(Dict("<f8", "False", shape), "x"), "a").ok()) << shape;
  }
}

}  // namespace
}  // namespace pheromone::maps
