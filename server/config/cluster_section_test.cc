// [cluster], `on` of a [[link]], and each way to get them wrong.

#include <gmock/gmock.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/config/describe.h"
#include "server/config/folders.h"
#include "server/config/testing/folder_test.h"

namespace pheromone::config {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kSecret = "00112233445566778899aabbccddeeff00112233445566778899AABBCCDDEEFF";

class ClusterSection : public FolderTest {
 protected:
  static constexpr auto kPrivate =
      std::filesystem::perms::owner_read | std::filesystem::perms::owner_write;

  ClusterSection() { WriteSecret(std::string(kSecret) + "\n", kPrivate); }

  void WriteSecret(std::string_view text, std::filesystem::perms perms) const {
    Write("secret", text);
    std::filesystem::permissions(folder_ / "secret", perms);
  }

  // From line 30 on; each key on a line of its own, in the order of the manual.
  struct Keys {
    std::string name = "name = \"lab\"";
    std::string engine = "engine = [\"http://10.0.0.1:2379\", \"http://10.0.0.2:2379\"]";
    std::string nodes = "nodes = {b = \"10.0.0.2:8390\", a = \"10.0.0.1:8390\"}";
    std::string node = "node = \"a\"";
    std::string secret = "secret_file = \"secret\"";
    std::string more{};

    std::string Text() const {
      return "[cluster]\n" + name + '\n' + engine + '\n' + nodes + '\n' + node + '\n' + secret +
             '\n' + more + '\n';
    }
  };

  static std::string Good() { return Keys{}.Text(); }

  // For a machine.
  Result<Config> ParseFor(const Machine& machine, std::string_view more) const {
    const std::string text =
        "[map]\nwidth_m = 1\nheight_m = 1\ncell_m = 0.1\n[antennas]\n"
        "bias_m = 0.3\n[[pheromone]]\ntype = 1\nname = \"t\"\n"
        "profile = \"cone\"\nradius_m = 0.2\ntau_s = 30\nquantum = 0.25\n"
        "maximum = 1\n" +
        std::string(more);
    return ParseConfig(text, "f.toml", folder_, machine);
  }
};

TEST_F(ClusterSection, WithoutItADaemonIsAlone) {
  EXPECT_EQ(Parse("").value().cluster, std::nullopt);
  EXPECT_EQ(ParseConfig(DefaultConfigText(), "default", folder_).value().cluster, std::nullopt);
}

TEST_F(ClusterSection, EveryKeyIsRead) {
  Keys keys;
  keys.more = "suspect_ms = 500\ngroup_ms = 7";
  const Result<Config> parsed = Parse(keys.Text());
  ASSERT_TRUE(parsed.ok()) << parsed.error();
  ClusterSettings expected;
  expected.name = "lab";
  expected.engine = {{"10.0.0.1", 2379}, {"10.0.0.2", 2379}};
  expected.nodes = {{"a", {"10.0.0.1", 8390}}, {"b", {"10.0.0.2", 8390}}};
  expected.node = "a";
  expected.secret = std::string(1, '\0') +
                    "\x11\x22\x33\x44\x55\x66\x77\x88\x99\xaa\xbb\xcc\xdd"
                    "\xee\xff";
  expected.secret += expected.secret;
  expected.suspect_ms = 500;
  expected.group_ms = 7;
  EXPECT_EQ(parsed.value().cluster, expected);
  EXPECT_THAT(parsed.value().warnings, IsEmpty());
  expected.suspect_ms = 300;
  expected.group_ms = 5;
  EXPECT_EQ(Parse(Good()).value().cluster, expected);
}

TEST_F(ClusterSection, TheNodeIsThatOfTheCommandLineOrOfTheFileOrTheHost) {
  Keys without;
  without.node = "";
  const auto node = [&](const Machine& machine, const Keys& keys) {
    const Result<Config> parsed = ParseFor(machine, keys.Text());
    return parsed.ok() ? parsed.value().cluster->node : std::string(parsed.error());
  };
  EXPECT_EQ(node({"c", "b"}, Keys{}), "b");
  EXPECT_EQ(node({"b", ""}, Keys{}), "a");
  EXPECT_EQ(node({"b", ""}, without), "b");
  EXPECT_EQ(node({"b.lab.local", ""}, without), "b");
  EXPECT_EQ(node({"a", "b"}, without), "b");
  EXPECT_EQ(node({"pc", ""}, without),
            "f.toml:15:1: cluster.node: missing, expected one of \"a\", \"b\", or the option "
            "--node: none is named as this machine, \"pc\"");
  EXPECT_EQ(node({"a", "c"}, Keys{}),
            "f.toml:18:9: cluster.nodes: found no node \"c\", which --node says, expected one of "
            "\"a\", \"b\"");
  EXPECT_EQ(Parse(without.Text()).value().cluster->node, "");  // it was not asked for
}

TEST_F(ClusterSection, MistakesAreToldWithTheirPlace) {
  const auto error = [this](auto change) {
    Keys keys;
    change(&keys);
    return ErrorOf(keys.Text());
  };
  EXPECT_THAT(ParseConfig("cluster = 3\n", "f.toml").ErrorOr(""),
              HasSubstr("f.toml:1:11: cluster: found 3, expected a table [cluster]"));
  EXPECT_EQ(error([](Keys* it) { it->more = "secret = \"x\""; }),
            "f.toml:35:1: cluster.secret: unknown key, expected secret_file?");
  EXPECT_EQ(error([](Keys* it) { it->name = "name = \"a/b\""; }),
            "f.toml:30:8: cluster.name: found the string \"a/b\", expected at most 32 letters, "
            "digits, hyphens, underscores and dots");
  EXPECT_EQ(error([](Keys* it) { it->node = "node = \"c\""; }),
            "f.toml:33:8: cluster.node: found the string \"c\", expected one of \"a\", \"b\"");
  EXPECT_EQ(error([](Keys* it) { it->more = "suspect_ms = 199"; }),
            "f.toml:35:14: cluster.suspect_ms: found 199, expected a whole number from 200 to "
            "60000");
  EXPECT_EQ(error([](Keys* it) { it->more = "group_ms = 51"; }),
            "f.toml:35:12: cluster.group_ms: found 51, expected a whole number from 1 to 50");
}

TEST_F(ClusterSection, AnEngineIsReachedByHttpWithoutTls) {
  const auto error = [this](const std::string& engine) {
    Keys keys;
    keys.engine = engine.empty() ? "" : "engine = " + engine;
    return ErrorOf(keys.Text());
  };
  const std::string expected =
      "expected 1 to 9 different numeric addresses of etcd's members, http://ADDRESS:PORT, such as "
      "[\"http://10.0.0.1:2379\"]";
  EXPECT_EQ(error(""), "f.toml:29:1: cluster.engine: missing, " + expected);
  EXPECT_EQ(error("\"http://1.2.3.4:1\""),
            "f.toml:31:10: cluster.engine: found the string \"http://1.2.3.4:1\", " + expected);
  EXPECT_EQ(error("[]"), "f.toml:31:10: cluster.engine: found an array of 0, " + expected);
  EXPECT_EQ(
      error("[\"https://10.0.0.1:2379\"]"),
      "f.toml:31:11: cluster.engine: found the string \"https://10.0.0.1:2379\", expected "
      "http://ADDRESS:PORT: there is no TLS between the server and etcd, whose ports belong on "
      "a network of the cluster's own");
  for (const char* bad :
       {"1", "\"http://1.2.3.4\"", "\"http://1.2.3.4:\"", "\"http://:1\"", "\"http://1.2.3.4:0\"",
        "\"http://1.2.3.4:65536\"", "\"http://1.2.3.4:1/\"", "\"http://u@1.2.3.4:1\"",
        "\"1.2.3.4:1\"", "\"http://[::1:1\"", "\"http://etcd-1:1\"", "\"http://1.2.3.4:1x\""}) {
    EXPECT_THAT(error("[" + std::string(bad) + "]"), HasSubstr("cluster.engine: found ")) << bad;
  }
  EXPECT_EQ(error("[\"http://[::1]:1\", \"http://10.0.0.2:65535\"]"), "");
  EXPECT_EQ(error("[\"http://1.2.3.4:1\", \"http://1.2.3.4:1\"]"),
            "f.toml:31:31: cluster.engine: found the string \"http://1.2.3.4:1\", " + expected);
  std::string ten = "[\"http://1.2.3.4:1\"";
  for (int i = 2; i <= 10; ++i) {
    ten += ", \"http://1.2.3.4:" + std::to_string(i) + '"';
  }
  EXPECT_THAT(error(ten + "]"), HasSubstr("f.toml:31:10: cluster.engine: found an array of 10, "));
}

TEST_F(ClusterSection, NodesHaveNamesAndAddressesOfTheirOwn) {
  const auto error = [this](const std::string& nodes) {
    Keys keys;
    keys.nodes = nodes;
    return ErrorOf(keys.Text());
  };
  EXPECT_THAT(error(""), HasSubstr("f.toml:29:1: cluster.nodes: missing, expected a table of 1 to "
                                   "9 names and addresses"));
  EXPECT_THAT(error("nodes = {}"), HasSubstr("f.toml:32:9: cluster.nodes: found "));
  EXPECT_THAT(error("nodes = [\"a\"]"), HasSubstr("f.toml:32:9: cluster.nodes: found an array"));
  EXPECT_EQ(error("nodes = {a = \"host:1\"}"),
            "f.toml:32:14: cluster.nodes.a: found the string \"host:1\", expected a numeric "
            "address and a port such as \"127.0.0.1:4950\" or \"[::1]:4950\"");
  EXPECT_EQ(error("nodes = {a = \"10.0.0.1:0\"}"),
            "f.toml:32:14: cluster.nodes.a: found the string \"10.0.0.1:0\", expected a port that "
            "the other nodes can know, not 0");
  EXPECT_EQ(error("nodes = {a = \"10.0.0.1:1\", b = \"10.0.0.1:1\"}"),
            "f.toml:32:32: cluster.nodes.b: found the string \"10.0.0.1:1\" again, expected a "
            "value not used by node \"a\"");
  EXPECT_EQ(error("nodes = {a = \"10.0.0.1:1\", \"b c\" = \"10.0.0.1:2\"}"),
            "f.toml:32:36: cluster.nodes.b c: found the name \"b c\", expected at most 32 letters, "
            "digits, hyphens, underscores and dots");
}

TEST_F(ClusterSection, ASecretIsLongAndOfOneHand) {
  for (const std::string& bad : {std::string(), std::string(63, 'a'), std::string(62, 'a'),
                                 std::string(63, 'a') + "g", std::string(514, 'a')}) {
    WriteSecret(bad, kPrivate);
    EXPECT_EQ(ErrorOf(Good()),
              "f.toml:34:15: cluster.secret_file: secret: expected at least 32 bytes as 64 to 512 "
              "hexadecimal digits, such as the output of `openssl rand -hex 32`; the same on all "
              "machines")
        << bad;
  }
  WriteSecret(kSecret, kPrivate | std::filesystem::perms::others_read);
  EXPECT_EQ(ErrorOf(Good()),
            "f.toml:34:15: cluster.secret_file: secret is readable by all users, expected mode "
            "0640 or stricter");
  WriteSecret(kSecret, kPrivate | std::filesystem::perms::group_read);
  EXPECT_EQ(ErrorOf(Good()), "");
  std::filesystem::remove(folder_ / "secret");
  EXPECT_EQ(ErrorOf(Good()),
            "f.toml:34:15: cluster.secret_file: secret: No such file or directory, expected a "
            "file");
  Keys none;
  none.secret = "";
  EXPECT_EQ(ErrorOf(none.Text()),
            "f.toml:29:1: cluster.secret_file: missing, expected a file with the secret that all "
            "nodes have");
}

TEST_F(ClusterSection, AClusterHasAJournal) {
  EXPECT_EQ(ErrorOf(Good() + "[journal]\ndurability = \"none\"\n"),
            "f.toml:37:14: journal.durability: found the string \"none\", expected \"durable\" or "
            "\"relaxed\": a cluster needs a journal on each machine");
  const Config alone = Parse("").value();
  const Config clustered = Parse(Good()).value();
  EXPECT_EQ(WhyNoJournal(alone, ""), "");
  EXPECT_EQ(WhyNoJournal(clustered, "/j"), "");
  EXPECT_EQ(WhyNoJournal(clustered, ""),
            "a cluster needs a journal, expected [journal] with a folder");
  EXPECT_THAT(LookAtFolders(clustered, nullptr).warnings,
              ElementsAre("journal.folder: a cluster needs a journal, expected [journal] with a "
                          "folder, or systemd's state directory"));
}

TEST_F(ClusterSection, APortThatTheNodeListensOnIsNoOthers) {
  const std::string web = "[web]\nlisten = \"10.0.0.1:8390\"\n";
  EXPECT_EQ(ErrorOf(Good() + web),
            "f.toml:37:10: web.listen: found the string \"10.0.0.1:8390\" again, expected a value "
            "not used by [cluster]");
  EXPECT_EQ(ErrorOf(Good() + "[web]\nlisten = \"10.0.0.2:8390\"\n"), "");  // another node's
}

TEST_F(ClusterSection, SerialAndPtyLinksMayBeOnSomeNodes) {
  const auto link = [](const std::string& keys) { return "[[link]]\nname = \"b\"\n" + keys; };
  const std::string pty = "kind = \"pty\"\npath = \"b\"\n";
  const std::string serial = "kind = \"serial\"\nport = \"/dev/ttyS0\"\n";
  const std::string tcp = "kind = \"tcp\"\nlisten = \"127.0.0.1:4950\"\n";
  const Config parsed = Parse(Good() + link(serial + "on = [\"b\", \"a\"]\n")).value();
  EXPECT_THAT(parsed.links.at(0).on, IsEmpty());
  EXPECT_THAT(parsed.links.at(1).on, ElementsAre("b", "a"));
  EXPECT_THAT(Parse(Good() + link(pty + "on = [\"b\"]\n")).value().links.at(1).on,
              ElementsAre("b"));
  const std::string expected = "expected different nodes of [cluster], such as [\"a\", \"b\"]";
  for (const auto& [on, found] :
       {std::pair("[\"c\"]", "the string \"c\""), std::pair("[\"a\", \"a\"]", "the string \"a\""),
        std::pair("[1]", "1"), std::pair("[]", "an array of 0"),
        std::pair("\"a\"", "the string \"a\"")}) {
    EXPECT_THAT(ErrorOf(Good() + link(serial + "on = " + on + "\n")),
                HasSubstr("link[2].on: found " + std::string(found) + ", " + expected))
        << on;
  }
  EXPECT_THAT(
      ErrorOf(Good() + link(pty + "on = [\"a\", \"b\"]\n")),
      HasSubstr("link[2].on: found an array of 2, expected one node, or medium_access = true"));
  EXPECT_EQ(ErrorOf(link(serial + "on = [\"a\"]\n")),
            "f.toml:33:6: link[2].on: found an array of 1, expected no such key without [cluster]");
  EXPECT_THAT(ErrorOf(Good() + link(tcp + "on = [\"a\"]\n")),
              HasSubstr("link[2].on: unknown key, expected one of "));
}

TEST_F(ClusterSection, PortsOfTwoMachinesMayHaveTheSameName) {
  const auto links = [](const std::string& port, const std::string& on_a, const std::string& on_b) {
    return "[[link]]\nname = \"b\"\nkind = \"serial\"\n" + port + '\n' + on_a +
           "\n[[link]]\nname = \"c\"\nkind = \"serial\"\n" + port + '\n' + on_b + '\n';
  };
  for (const std::string port : {"port = \"/dev/ttyS0\"", "usb = \"0403:6001\""}) {
    EXPECT_EQ(ErrorOf(Good() + links(port, "on = [\"a\"]", "on = [\"b\"]")), "");
    for (const std::string on : {"on = [\"a\", \"b\"]", "on = [\"b\"]", ""}) {
      EXPECT_THAT(ErrorOf(Good() + links(port, "on = [\"b\"]", on)),
                  HasSubstr("again, expected a value not used by link \"b\""))
          << on;
    }
  }
}

// Each of two servers computes for how long it may send on the port that both have, and when.
TEST_F(ClusterSection, LinksDifferIfTheirRateOrTheirNodesDo) {
  const auto hash = [this](const std::string& keys) {
    return LinksHash(
        Parse(Good() + "[[link]]\nname = \"b\"\nkind = \"serial\"\n" + keys + '\n').value());
  };
  const std::string timing = "slot_ms = 5\nresponse_window_ms = 100\n";
  const std::string port = timing + "port = \"/dev/ttyS0\"\n";
  const uint64_t both = hash(port + "on = [\"b\", \"a\"]");
  EXPECT_EQ(hash(timing + "port = \"/dev/ttyS1\"\non = [\"b\", \"a\"]"), both);
  for (const char* keys :
       {"", "on = [\"a\", \"b\"]", "on = [\"b\"]", "on = [\"b\", \"a\"]\nbaud = 19200"}) {
    EXPECT_NE(hash(port + keys), both) << keys;
  }
}

TEST_F(ClusterSection, IsToldInWords) {
  const Config config = Parse(Good() +
                              "[[link]]\nname = \"b\"\nkind = \"pty\"\npath = \"b\"\n"
                              "medium_access = true\non = [\"a\", \"b\"]\n")
                            .value();
  const std::vector<std::string> lines = DescribeReach(config, nullptr);
  EXPECT_EQ(lines.at(1), "link b: pty " + std::filesystem::current_path().string() + "/b, on a, b");
  EXPECT_EQ(lines.back(),
            "cluster lab: node a of a (10.0.0.1:8390), b (10.0.0.2:8390); log in etcd at "
            "10.0.0.1:2379, 10.0.0.2:2379; a leader that is silent for 300 ms is "
            "replaced");
  EXPECT_EQ(DescribeReach(Parse("").value(), nullptr).size(), 3u);
}

}  // namespace
}  // namespace pheromone::config
