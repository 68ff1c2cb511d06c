// The divisors of the AVR's clock for the usual crystals, against the datasheet's equations in
// floating point, and against its tables of examples.
#include "client_fw/boards/avr/clock.h"

#include <gtest/gtest.h>

#include <cmath>

namespace pheromone {
namespace client {
namespace {

constexpr uint32_t kCrystals[] = {7372800, 11059200, 14745600, 16000000, 18432000, 20000000};
constexpr uint32_t kBauds[] = {600,   1200,  2400,  4800,  9600,  14400,
                               19200, 28800, 38400, 57600, 76800, 115200};

// ATmega1284P datasheet, "Examples of Baud Rate Setting": UBRR with U2X 0 and 1.
TEST(AvrClockTest, TheDivisorsAreThoseOfTheDatasheet) {
  EXPECT_EQ(47u, BaudDivisor(7372800, 9600, 16));
  EXPECT_EQ(95u, BaudDivisor(7372800, 9600, 8));
  EXPECT_EQ(3u, BaudDivisor(7372800, 115200, 16));
  EXPECT_EQ(71u, BaudDivisor(11059200, 9600, 16));
  EXPECT_EQ(17u, BaudDivisor(11059200, 38400, 16));
  EXPECT_EQ(95u, BaudDivisor(14745600, 9600, 16));
  EXPECT_EQ(103u, BaudDivisor(16000000, 9600, 16));
  EXPECT_EQ(207u, BaudDivisor(16000000, 9600, 8));
  EXPECT_EQ(25u, BaudDivisor(16000000, 38400, 16));
  EXPECT_EQ(34u, BaudDivisor(16000000, 57600, 8));
  EXPECT_EQ(119u, BaudDivisor(18432000, 9600, 16));
  EXPECT_EQ(129u, BaudDivisor(20000000, 9600, 16));
  EXPECT_EQ(42u, BaudDivisor(20000000, 57600, 8));
}

TEST(AvrClockTest, EveryCrystalGivesEveryRateUpTo57600) {
  for (const uint32_t hz : kCrystals) {
    for (const uint32_t baud : kBauds) {
      const uint32_t samples = Samples(hz, baud);
      const double divisor = BaudDivisor(hz, baud, samples);
      const double error = std::abs(hz / (samples * (divisor + 1)) / baud - 1) * 1000;
      EXPECT_NEAR(error, BaudError(hz, baud, samples), 1 + 4000.0 / baud) << hz << ' ' << baud;
      if (baud <= 57600) {
        EXPECT_LE(error, kMaxBaudError) << hz << ' ' << baud;
        EXPECT_LE(divisor, 4095) << hz << ' ' << baud;
      }
    }
  }
}

// Of which the data sheet recommends to miss none by over 1.5 %.
TEST(AvrClockTest, EveryCrystalGivesThePioneersRatesWithEightSamplesABit) {
  for (const uint32_t hz : kCrystals) {
    for (const uint32_t baud : {9600u, 19200u, 38400u, 57600u}) {
      const double divisor = BaudDivisor(hz, baud, 8);
      EXPECT_LE(std::abs(hz / (8 * (divisor + 1)) / baud - 1), 0.015) << hz << ' ' << baud;
      EXPECT_LE(divisor, 4095) << hz << ' ' << baud;
    }
  }
  EXPECT_EQ(259, (DoubleSpeedDivisor<20'000'000, 9600>()));
}

TEST(AvrClockTest, CrystalsOfUartsGiveTheirRatesExactly) {
  for (const uint32_t hz : {7372800u, 11059200u, 14745600u, 18432000u}) {
    for (const uint32_t baud : {9600u, 19200u, 38400u, 57600u, 115200u}) {
      EXPECT_EQ(0u, BaudError(hz, baud, 16)) << hz << ' ' << baud;
    }
  }
  EXPECT_GT(BaudError(16000000, 115200, Samples(16000000, 115200)), kMaxBaudError)
      << "which therefore does not compile";
}

TEST(AvrClockTest, AMillisecondIsOneToLessThanACrystalsOwnError) {
  for (const uint32_t hz : kCrystals) {
    const double ppm = std::abs(CyclesPerMs(hz) * 1000.0 / hz - 1) * 1e6;
    EXPECT_LT(ppm, 50) << hz;
    EXPECT_NEAR(ppm, MillisecondErrorPpm(hz), 2) << hz;
    EXPECT_LE(CyclesPerMs(hz), 65536u);
  }
}

}  // namespace
}  // namespace client
}  // namespace pheromone
