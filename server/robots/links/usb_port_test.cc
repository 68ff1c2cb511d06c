#include "server/robots/links/usb_port.h"

#include <gtest/gtest.h>

namespace pheromone::links {
namespace {

const std::vector<UsbPort> kPorts = {
    {"/dev/ttyACM0", {0x2341, 0x0043, "7573"}},
    {"/dev/ttyUSB0", {0x0403, 0x6001, "A50285BI"}},
    {"/dev/ttyUSB1", {0x0403, 0x6001, "A9007UX1"}},
    {"/dev/ttyUSB2", {0x1a86, 0x7523, ""}},
};

TEST(UsbPortTest, AnIdentityIsWrittenAsTheSystemWritesIt) {
  EXPECT_EQ(ToText({0x0403, 0x6001, "A50285BI"}), "0403:6001:A50285BI");
  EXPECT_EQ(ToText({0x1a86, 0x7523, ""}), "1a86:7523");
}

TEST(UsbPortTest, TheOneOfItsKindNeedsNoSerialNumber) {
  EXPECT_EQ(ChooseUsbPort({0x2341, 0x0043, ""}, kPorts).value(), "/dev/ttyACM0");
  EXPECT_EQ(ChooseUsbPort({0x1a86, 0x7523, ""}, kPorts).value(), "/dev/ttyUSB2");
}

TEST(UsbPortTest, TheSerialNumberTellsEqualAdaptersApart) {
  EXPECT_EQ(ChooseUsbPort({0x0403, 0x6001, "A9007UX1"}, kPorts).value(), "/dev/ttyUSB1");
}

TEST(UsbPortTest, WithoutItEqualAdaptersAreAnErrorThatListsThem) {
  EXPECT_EQ(ChooseUsbPort({0x0403, 0x6001, ""}, kPorts).error(),
            "more than one USB adapter 0403:6001: 0403:6001:A50285BI at /dev/ttyUSB0, "
            "0403:6001:A9007UX1 at /dev/ttyUSB1; specify its serial number, or configure its port "
            "instead");
}

TEST(UsbPortTest, OneThatIsNotThereIsAnErrorThatListsWhatIs) {
  EXPECT_EQ(ChooseUsbPort({0x0403, 0x6001, "X"}, std::span(kPorts).last(1)).error(),
            "no USB adapter 0403:6001:X; found 1a86:7523 at /dev/ttyUSB2");
  EXPECT_EQ(ChooseUsbPort({0x0403, 0x6001, ""}, {}).error(),
            "no USB adapter 0403:6001; found none");
}

}  // namespace
}  // namespace pheromone::links
