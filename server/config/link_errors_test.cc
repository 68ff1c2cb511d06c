// Each way to get a link, a frame or a tracker wrong.

#include "server/config/testing/config_text.h"

namespace pheromone::config {
namespace {

class LinkErrorsTest : public ErrorsTest {};

TEST_P(LinkErrorsTest, NamesPlaceKeyAndExpectation) {
  ExpectError();
}

INSTANTIATE_TEST_SUITE_P(
    Links, LinkErrorsTest,
    ::testing::Values(
        Case{28, "kind = \"can\"",
             "28:8: link[1].kind: found the string \"can\", expected one of "
             "\"pty\", \"serial\", \"tcp\", \"udp\""},
        Case{31, "name = \"radio-a\"",
             "31:8: link[2].name: found the string \"radio-a\" again, expected a value not used by "
             "link \"radio-a\""},
        Case{27, "name = \"a b\"",
             "27:8: link[1].name: found the string \"a b\", expected at most "
             "32 letters, digits, hyphens, underscores and dots"},
        Case{29, "path = \"/dev/ttyS0\"",
             "33:8: link[2].port: found the string \"/dev/ttyS0\" "
             "again, expected a value not used by link \"radio-a\""},
        Case{33, "port = \"/dev/ttyS0\"\nbaud = 9600.5",
             "34:8: link[2].baud: found 9600.5, expected a whole number from 50 to 4000000"},
        Case{33, "port = \"/dev/ttyS0\"\nturnaround_ms = 30\nresponse_window_ms = 78",
             "35:22: link[2].response_window_ms: found 78, expected at least 79, what the modems, "
             "the adapter and two bytes take before the server's answer arrives"},
        Case{29,
             "path = \"./x/../b.pty\"\n[[link]]\nname = \"b\"\nkind = \"pty\"\npath = \"b.pty\"",
             "33:8: link[2].path: found the string \"b.pty\" again, expected a value not used by "
             "link \"radio-a\""},
        Case{33, "port = \"/dev/ttyS0\"\nbaud = 300\ngap_timeout_ms = 66",
             "35:18: link[2].gap_timeout_ms: found 66, expected more than the time of two bytes, "
             "which is 66.666 ms at 300 baud, or 0 for no limit"},
        Case{33, "port = \"/dev/ttyS0\"\nbaud = 75",
             "30:1: link[2].response_window_ms: missing, and its default 297, derived from "
             "turnaround_ms, adapter_latency_ms, server_delay_ms, ptt_lead_ms and baud, is more "
             "than 255; expected a faster line, shorter times or a whole number from 1 to 255"},
        Case{37, "listen = \"localhost:4950\"",
             "37:10: link[3].listen: found the string \"localhost:4950\", expected a numeric "
             "address and a port such as \"127.0.0.1:4950\" or \"[::1]:4950\""},
        Case{37,
             "listen = \"127.0.0.1:4950\"\n[[link]]\nname = \"n\"\nkind = \"tcp\"\n"
             "listen = \"127.0.0.1:4950\"",
             "41:10: link[4].listen: found the string \"127.0.0.1:4950\" again, expected a value "
             "not used by link "
             "\"net\""},
        Case{37,
             "listen = \"127.0.0.1:4950\"\n[[link]]\nname = \"n\"\nkind = \"udp\"\n"
             "listen = \"127.0.0.1:4951\"\ngap_timeout_ms = 5",
             "42:1: link[4].gap_timeout_ms: unknown key, expected one of name, kind, required, "
             "clients, security, keys, listen, slot_ms, response_window_ms"},
        Case{37, "listen = \"127.0.0.1:4950\"\nmax_connections = 255",
             "38:19: link[3].max_connections: found 255, expected a whole number from 1 to 254"},
        Case{33, "usb = \"0403-6001\"",
             "33:7: link[2].usb: found the string \"0403-6001\", expected vendor and product IDs "
             "in hexadecimal and optionally the serial number, such as "
             "\"0403:6001\" or \"0403:6001:A50285BI\""},
        Case{33, "usb = \"0403:6001\"\nport = \"/dev/ttyS0\"",
             "34:1: link[2].port: not permitted with usb, expected only one of them"},
        Case{33, "baud = 9600", "30:1: link[2].port: missing, expected a string"},
        Case{33, "port = \"/dev/ttyS0\"\ncarrier_sense = \"dsr\"",
             "34:17: link[2].carrier_sense: found the string \"dsr\", expected one of \"none\", "
             "\"dcd\", \"cts\""},
        Case{33, "port = \"/dev/ttyS0\"\nptt = true",
             "34:7: link[2].ptt: found true, expected one of \"none\", \"rts\", \"dtr\", "
             "\"rs485\""},
        Case{33, "port = \"/dev/ttyS0\"\nptt = \"rts\"\nptt_lead_ms = 1001",
             "35:15: link[2].ptt_lead_ms: found 1001, expected a whole number from 0 to 1000"},
        Case{33, "port = \"/dev/ttyS0\"\nptt_tail_ms = 5",
             "34:1: link[2].ptt_tail_ms: not permitted with ptt = \"none\", expected ptt = "
             "\"rts\", \"dtr\" or "
             "\"rs485\""},
        Case{33, "port = \"/dev/ttyS0\"\nmedium_access = false\nturnaround_ms = 5",
             "35:1: link[2].turnaround_ms: not permitted with medium_access = false, expected only "
             "on a shared medium"},
        Case{33, "port = \"/dev/ttyS0\"\nptt = \"rts\"\nptt_lead_ms = 30\nresponse_window_ms = 34",
             "36:22: link[2].response_window_ms: found 34, expected at least 51, what the modems, "
             "the adapter and two bytes take before the server's answer arrives"},
        Case{33, "port = \"/dev/ttyS0\"\nsilence_s = -1",
             "34:13: link[2].silence_s: found -1, expected a whole number from 0 to 1000000"},
        Case{29, "path = \"a.pty\"\nptt = \"rts\"",
             "30:1: link[1].ptt: unknown key, expected one of name, kind, required, clients, "
             "security, keys, on, path, baud, medium_access, slot_ms, response_window_ms, "
             "turnaround_ms, "
             "adapter_latency_ms, server_delay_ms, gap_timeout_ms"},
        Case{29, "path = \"a.pty\"\nclients = 7",
             "30:11: link[1].clients: found 7, expected client IDs from 1 to 254 and ranges of "
             "them, such as [1, 2, \"10-20\"]"},
        Case{29, "path = \"a.pty\"\nclients = []",
             "30:11: link[1].clients: found an array of 0, expected client IDs from 1 to 254 and "
             "ranges of them, such as [1, 2, \"10-20\"]"},
        Case{29, "path = \"a.pty\"\nclients = [1, 255]",
             "30:15: link[1].clients: found 255, expected client IDs from 1 to 254 and ranges of "
             "them, such as [1, 2, \"10-20\"]"}));

// After the text, whose last line is 37.
INSTANTIATE_TEST_SUITE_P(
    Poses, LinkErrorsTest,
    ::testing::Values(
        Case{37, "listen = \"127.0.0.1:4950\"\n[[frame]]\nid = 3\nx_m = 1",
             "38:1: frame[1].link: missing, expected a string"},
        Case{37, "listen = \"127.0.0.1:4950\"\n[[frame]]\nlink = \"radio\"\nid = 3",
             "39:8: frame[1].link: found the string \"radio\", expected one of the links "
             "\"radio-a\", \"radio-b\", \"net\""},
        Case{37, "listen = \"127.0.0.1:4950\"\n[[frame]]\nlink = \"net\"",
             "38:1: frame[1].id: missing, expected a whole number from 1 to 254"},
        Case{37, "listen = \"127.0.0.1:4950\"\n[[frame]]\nlink = \"net\"\nid = 255",
             "40:6: frame[1].id: found 255, expected a whole number from 1 to 254"},
        Case{37, "listen = \"127.0.0.1:4950\"\n[[frame]]\nlink = \"net\"\nid = 1\nx_m = 2e6",
             "41:7: frame[1].x_m: found 2000000, expected a number from -1000000 to 1000000"},
        Case{37, "listen = \"127.0.0.1:4950\"\n[[frame]]\nlink = \"net\"\nid = 1\ny_m = \"0\"",
             "41:7: frame[1].y_m: found the string \"0\", expected a number from -1000000 to "
             "1000000"},
        Case{37,
             "listen = \"127.0.0.1:4950\"\n[[frame]]\nlink = \"net\"\nid = 1\nheading_deg = 361",
             "41:15: frame[1].heading_deg: found 361, expected a number from -360 to 360"},
        Case{37, "listen = \"127.0.0.1:4950\"\n[[frame]]\nlink = \"net\"\nid = 1\nheading = 1",
             "41:1: frame[1].heading: unknown key, expected heading_deg?"},
        Case{37,
             "listen = \"127.0.0.1:4950\"\n[[frame]]\nlink = \"net\"\nid = 1\n"
             "[[frame]]\nlink = \"net\"\nid = 1",
             "43:6: frame[2].id: found 1 again, expected one frame for robot 1 on link \"net\""},
        Case{37, "listen = \"127.0.0.1:4950\"\n[[tracker]]\nlisten = \"127.0.0.1:4960\"",
             "38:1: tracker[1].name: missing, expected a string"},
        Case{37, "listen = \"127.0.0.1:4950\"\n[[tracker]]\nname = \"t\"",
             "38:1: tracker[1].listen: missing, expected a string"},
        Case{37, "listen = \"127.0.0.1:4950\"\n[[tracker]]\nname = \"t\"\nlisten = \"here\"",
             "40:10: tracker[1].listen: found the string \"here\", expected a numeric address and "
             "a port such as \"127.0.0.1:4950\" or \"[::1]:4950\""},
        Case{37,
             "listen = \"127.0.0.1:4950\"\n[[tracker]]\nname = \"t\"\nlisten = "
             "\"127.0.0.1:1\"\nvalid_s = 0",
             "41:11: tracker[1].valid_s: found 0, expected a number from 0.001 to 3600"},
        Case{37,
             "listen = \"127.0.0.1:4950\"\n[[tracker]]\nname = \"t\"\nlisten = "
             "\"127.0.0.1:1\"\nport = 3",
             "41:1: tracker[1].port: unknown key, expected one of name, listen, valid_s"},
        Case{37,
             "listen = \"127.0.0.1:4950\"\n[[tracker]]\nname = \"t\"\nlisten = "
             "\"127.0.0.1:1\"\n[[tracker]]\nname = \"u\"\nlisten = \"127.0.0.1:1\"",
             "43:10: tracker[2].listen: found the string \"127.0.0.1:1\" again, expected a value "
             "not used by tracker \"t\""},
        Case{37,
             "listen = \"127.0.0.1:4950\"\n[[tracker]]\nname = \"t\"\nlisten = "
             "\"127.0.0.1:1\"\n[[tracker]]\nname = \"t\"\nlisten = \"127.0.0.1:2\"",
             "42:8: tracker[2].name: found the string \"t\" again, expected a value not used by "
             "tracker \"t\""}));

const links::LinkConfig& SerialLinkOf(const Result<Config>& config) {
  return config.value().links[1];
}

TEST(LinksTest, APortIsAPathOrANameInByIdOrAUsbAdapter) {
  const auto parse = [](std::string_view with) {
    return ParseConfig(Replaced(33, with), "f.toml");
  };
  EXPECT_EQ(SerialLinkOf(parse("port = \"./modem\"")).path, "./modem");
  EXPECT_EQ(SerialLinkOf(parse("port = \"usb-FTDI_FT232R_A50285BI-if00-port0\"")).path,
            "/dev/serial/by-id/usb-FTDI_FT232R_A50285BI-if00-port0");
  EXPECT_EQ(SerialLinkOf(parse("usb = \"0403:6001\"")).usb,
            (links::UsbIdentity{0x0403, 0x6001, ""}));
  EXPECT_EQ(SerialLinkOf(parse("usb = \"1A86:7523:A:5\"")).usb,
            (links::UsbIdentity{0x1a86, 0x7523, "A:5"}));
  EXPECT_EQ(SerialLinkOf(parse("usb = \"1A86:7523\"")).path, "");
  for (const std::string_view bad : {"", "0403", "0403:", "403:6001", "0403:6001:", "0403:60011",
                                     "0403:6001A", "0x03:6001", "0403:+601", "0403 6001"}) {
    EXPECT_NE(ErrorOf(Replaced(33, "usb = \"" + std::string(bad) + "\"")), "") << bad;
  }
}

TEST(LinksTest, OneAdapterServesOneLink) {
  const std::string other =
      "usb = \"0403:6001\"\n[[link]]\nname = \"c\"\nkind = \"serial\"\nusb = ";
  EXPECT_EQ(ErrorOf(Replaced(33, other + "\"0403:6001\"")),
            "f.toml:37:7: link[3].usb: found the string \"0403:6001\" again, expected a value not "
            "used by link "
            "\"radio-b\"");
  EXPECT_EQ(ErrorOf(Replaced(33, other + "\"0403:6001:X\"")), "");
}

TEST(LinksTest, ModemLinesAreRead) {
  const Result<Config> config = ParseConfig(
      Replaced(33,
               "port = \"/dev/ttyS0\"\ncarrier_sense = \"cts\"\nptt = \"rs485\"\nptt_lead_ms = 3\n"
               "ptt_tail_ms = 4\nsilence_s = 60\nbaud = 9600\nturnaround_ms = 2"),
      "f.toml");
  ASSERT_TRUE(config.ok()) << config.error();
  const links::LinkConfig& link = SerialLinkOf(config);
  EXPECT_EQ(link.lines.carrier_sense, links::CarrierSense::kCts);
  EXPECT_EQ(link.lines.ptt, links::Ptt::kRs485);
  EXPECT_EQ(link.lines.ptt_lead_ms, 3);
  EXPECT_EQ(link.lines.ptt_tail_ms, 4);
  EXPECT_EQ(link.silence_s, 60u);
  EXPECT_EQ(link.slot_ms, 4);  // 2 ms and a byte of 1.04 ms, rounded up
  EXPECT_EQ(link.response_window_ms, 2 + 3 + 16 + 10 + 3);  // two bytes take 2.08 ms
}

TEST(LinksTest, ACableNeedsNoMediumAccess) {
  const Result<Config> config =
      ParseConfig(Replaced(33, "port = \"/dev/ttyS0\"\nmedium_access = false"), "f.toml");
  ASSERT_TRUE(config.ok()) << config.error();
  const links::LinkConfig& link = SerialLinkOf(config);
  EXPECT_FALSE(link.medium_access);
  EXPECT_EQ(link.turnaround_ms, 0);
  EXPECT_EQ(link.slot_ms, 1);
  EXPECT_EQ(link.response_window_ms, 100);
  EXPECT_EQ(link.gap_timeout_ms, 20);
}

TEST(LinksTest, ClientsAreIdsAndRangesOfThem) {
  for (const std::string_view bad :
       {"0", "-1", "1.5", "\"1\"", "\"20-10\"", "\"0-3\"", "\"1-255\"", "\"1-\"", "\"-3\"",
        "\"1-2-3\"", "\" 1-2\"", "\"1 - 2\"", "\"\"", "true", "[1]"}) {
    EXPECT_NE(ErrorOf(Replaced(29, "path = \"a.pty\"\nclients = [" + std::string(bad) + "]")), "")
        << bad;
  }
  const Result<Config> config =
      ParseConfig(Replaced(29, "path = \"a.pty\"\nclients = [1, \"3-5\", 254, \"4-4\"]"), "f.toml");
  ASSERT_TRUE(config.ok()) << config.error();
  for (size_t id = 0; id < 256; ++id) {
    EXPECT_EQ(config.value().links[0].admission.clients.test(id),
              id == 1 || id == 3 || id == 4 || id == 5 || id == 254);
  }
  EXPECT_TRUE(config.value().links[1].admission.clients.all());  // without a list, everyone
}

// A TCP and a UDP port of one number are two ports.
TEST(LinksTest, UdpIsReadAndSharesNoPortWithAnotherOfItsKind) {
  const std::string udp = "\n[[link]]\nname = \"u\"\nkind = \"udp\"\nlisten = \"127.0.0.1:4950\"";
  const std::string text = Replaced(37, "listen = \"127.0.0.1:4950\"" + udp);
  const Result<Config> config = ParseConfig(text, "f.toml");
  ASSERT_TRUE(config.ok()) << config.error();
  const links::LinkConfig& link = config.value().links[3];
  EXPECT_EQ(link.kind, links::LinkKind::kUdp);
  EXPECT_EQ(link.listen.address, "127.0.0.1");
  EXPECT_EQ(link.listen.port, 4950);
  EXPECT_EQ(link.gap_timeout_ms, 0);
  EXPECT_EQ(ErrorOf(text + "[[link]]\nname = \"v\"\nkind = \"udp\"\nlisten = \"127.0.0.1:4950\""),
            "f.toml:45:10: link[5].listen: found the string \"127.0.0.1:4950\" again, expected a "
            "value not used by link \"u\"");
}

TEST(LinksTest, RatesAreThoseOfEveryLink) {
  const std::string text = std::string(kGood);
  const Result<Config> config = ParseConfig(
      text + "[limits]\nrequests_per_client_s = 20\nrequests_per_link_s = 500", "f.toml");
  ASSERT_TRUE(config.ok()) << config.error();
  for (const links::LinkConfig& link : config.value().links) {
    EXPECT_EQ(link.admission.per_client_per_s, 20u);
    EXPECT_EQ(link.admission.per_link_per_s, 500u);
  }
  EXPECT_EQ(ErrorOf(text + "[limits]\nrequests_per_link_s = -1"),
            "f.toml:39:23: limits.requests_per_link_s: found -1, expected a whole number from 0 to "
            "1000000");
}

TEST(LinksTest, AnAddressIsFourNumbersOrBracketedAndAPort) {
  for (const std::string_view bad :
       {"", ":1", "1.2.3:5", "1.2.3.4", "1.2.3.4:", "1.2.3.4:65536", "1.2.3.256:1", "1.2.3.4.5:1",
        "1.2.3.4:1 ", "127.0.0.01:4951", "[::::]:4950", "[:::1]:1", "[1:2:3:4:5:6:7]:1", "::1:4950",
        "[::1]", "[]:4", "[1.2.3.4]:5", "1..2.3:4", "-1.2.3.4:5"}) {
    EXPECT_NE(ErrorOf(Replaced(37, "listen = \"" + std::string(bad) + "\"")), "") << bad;
  }
  for (const std::string_view good : {"0.0.0.0:0", "[::]:65535", "[fe80::1:2]:80"}) {
    EXPECT_EQ(ErrorOf(Replaced(37, "listen = \"" + std::string(good) + "\"")), "") << good;
  }
}

}  // namespace
}  // namespace pheromone::config
