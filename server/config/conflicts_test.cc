// Ports and paths that two sections of a configuration would share.

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <string_view>

#include "server/config/testing/config_text.h"
#include "server/config/testing/folder_test.h"

namespace pheromone::config {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string Link(std::string_view name, std::string_view kind, std::string_view where) {
  const std::string key = kind == "pty" ? "path" : kind == "serial" ? "port" : "listen";
  return "[[link]]\nname = \"" + std::string(name) + "\"\nkind = \"" + std::string(kind) + "\"\n" +
         key + " = \"" + std::string(where) + "\"\n";
}

std::string Web(std::string_view listen) {
  return "[web]\nlisten = \"" + std::string(listen) + "\"\n";
}

std::string Tracker(std::string_view listen) {
  return "[[tracker]]\nname = \"t\"\nlisten = \"" + std::string(listen) + "\"\n";
}

// kGood has 37 lines, three links, and a TCP link "net" on 127.0.0.1:4950.
std::string Error(const std::string& more) {
  return ErrorOf(std::string(kGood) + more);
}

TEST(ConflictsTest, TheWebAndATcpLinkCannotShareAPort) {
  EXPECT_EQ(Error(Web("127.0.0.1:4950")),
            "f.toml:39:10: web.listen: found the string \"127.0.0.1:4950\" again, expected a value "
            "not used by link \"net\"");
  EXPECT_EQ(Error(Web("0.0.0.0:4950")),
            "f.toml:39:10: web.listen: found the string \"0.0.0.0:4950\", expected another port "
            "than that of link \"net\", which listens on \"127.0.0.1:4950\"");
  EXPECT_EQ(ErrorOf("[web]\nlisten = \"127.0.0.1:4950\"\n" + std::string(kGood)),
            "f.toml:39:10: link[3].listen: found the string \"127.0.0.1:4950\" again, expected a "
            "value not used by [web]");
}

// What the system refuses: each was tried with two sockets.
TEST(ConflictsTest, AddressesThatIncludeEachOtherCannotShareAPort) {
  struct Pair {
    std::string_view a;
    std::string_view b;
    bool clash;
  };
  for (const Pair& it : {Pair{"127.0.0.1:80", "127.0.0.1:80", true},
                         {"127.0.0.1:80", "127.0.0.1:81", false},
                         {"127.0.0.1:80", "127.0.0.2:80", false},
                         {"127.0.0.1:80", "0.0.0.0:80", true},
                         {"127.0.0.1:80", "[::]:80", true},
                         {"0.0.0.0:80", "[::]:80", true},
                         {"127.0.0.1:80", "[::1]:80", false},
                         {"0.0.0.0:80", "[::1]:80", false},
                         {"[::1]:80", "[::]:80", true},
                         {"[::1]:80", "[0:0:0:0:0:0:0:1]:80", true},
                         {"127.0.0.1:80", "[::ffff:127.0.0.1]:80", true},
                         {"[::1]:80", "[::2]:80", false},
                         {"127.0.0.1:0", "127.0.0.1:0", false},  // the system chooses two
                         {"0.0.0.0:0", "127.0.0.1:0", false}}) {
    EXPECT_EQ(Error(Link("a", "tcp", it.a) + Link("b", "tcp", it.b)).empty(), !it.clash)
        << it.a << ' ' << it.b;
    EXPECT_EQ(Error(Link("a", "udp", it.b) + Tracker(it.a)).empty(), !it.clash)
        << it.b << ' ' << it.a;
    EXPECT_EQ(Error(Link("a", "tcp", it.a) + Web(it.b)).empty(), !it.clash) << it.a << ' ' << it.b;
    EXPECT_EQ(Error(Link("a", "udp", it.a) + Web(it.b)), "") << it.a << ' ' << it.b;
  }
}

TEST(ConflictsTest, ATrackerAndAUdpLinkCannotShareAPort) {
  EXPECT_EQ(Error(Link("u", "udp", "0.0.0.0:4960") + Tracker("127.0.0.1:4960")),
            "f.toml:44:10: tracker[1].listen: found the string \"127.0.0.1:4960\", expected "
            "another port than that of link \"u\", which listens on \"0.0.0.0:4960\"");
}

TEST(ConflictsTest, AConflictIsToldBesideOtherMistakes) {
  EXPECT_THAT(ErrorOf(Replaced(4, "cell_m = 0") + Web("127.0.0.1:4950")),
              HasSubstr("\nf.toml:39:10: web.listen: found the string "));
}

class PlacesTest : public FolderTest {
 protected:
  // A configuration lab.toml in the folder, whose own link is "a".
  Result<Config> Load(const std::string& more) const {
    Write("lab.toml", std::string(kGood) + more);
    return LoadConfig(Here("lab.toml"));
  }
  std::string LoadError(const std::string& more) const {
    const Result<Config> loaded = Load(more);
    return loaded.ok() ? "" : loaded.error().substr(folder_.string().size());
  }
  std::string Here(const std::string& name) const { return (folder_ / name).string(); }
};

TEST_F(PlacesTest, APtyIsNotMadeWhereTheConfigurationIs) {
  const std::string found = "/lab.toml:41:8: link[4].path: found the string \"";
  const std::string expected = "\", which is this configuration file, expected a path of its own";
  EXPECT_EQ(LoadError(Link("p", "pty", Here("lab.toml"))), found + Here("lab.toml") + expected);
  EXPECT_EQ(LoadError(Link("p", "pty", Here("./lab.toml"))), found + Here("./lab.toml") + expected);
  std::filesystem::create_directory_symlink(folder_, folder_ / "again");
  EXPECT_EQ(LoadError(Link("p", "pty", Here("again/lab.toml"))),
            found + Here("again/lab.toml") + expected);
}

TEST_F(PlacesTest, APtyIsNotMadeWhereAFileIsThatTheConfigurationNames) {
  Write("token", "0123456789abcdef");
  std::filesystem::permissions(folder_ / "token", std::filesystem::perms::owner_read);
  EXPECT_EQ(LoadError(Link("p", "pty", Here("token")) + "[web]\ntoken_file = \"token\"\n"),
            "/lab.toml:41:8: link[4].path: found the string \"" + Here("token") +
                "\", which is the file of web.token_file, expected a path of its own");
  Write("p.csv", "x_m,y_m\n1,1\n2,2\n");
  EXPECT_THAT(LoadError("[[path]]\npheromone = \"path\"\nfile = \"p.csv\"\n" +
                        Link("p", "pty", Here("p.csv"))),
              HasSubstr("which is the file of path[2].file, "));
}

TEST_F(PlacesTest, APtyAndTheControlSocketAreTwo) {
  EXPECT_EQ(Error(Link("p", "pty", "pheromoned.sock")),
            "f.toml:41:8: link[4].path: found the string \"pheromoned.sock\", which is the control "
            "socket, expected a path of its own");
  EXPECT_EQ(Error(Link("p", "pty", "x/../s") + "[control]\nsocket = \"s\"\n"),
            "f.toml:43:10: control.socket: found the string \"s\", which is link \"p\", expected a "
            "path of its own");
  EXPECT_EQ(Error(Link("p", "pty", "pheromoned.sock") + "[control]\nenabled = false\n"), "");
}

TEST_F(PlacesTest, WhatIsInTheWayOfAPtyOrASocketIsAWarning) {
  Write("old", "");
  const Result<Config> loaded =
      Load(Link("p", "pty", Here("old")) + "[control]\nsocket = \"" + folder_.string() + "\"\n");
  ASSERT_TRUE(loaded.ok()) << loaded.error();
  ASSERT_EQ(loaded.value().warnings.size(), 2u);
  EXPECT_EQ(loaded.value().warnings[0].text,
            Here("lab.toml") + ":41:8: link[4].path: " + Here("old") +
                " already exists, expected no file there or a link to a pseudo-terminal");
  EXPECT_EQ(loaded.value().warnings[1].text,
            Here("lab.toml") + ":43:10: control.socket: " + folder_.string() +
                " already exists, expected no file there or a socket");
}

TEST_F(PlacesTest, WhatAnEarlierRunLeftIsNotInTheWay) {
  std::filesystem::create_symlink("/dev/pts/99999", folder_ / "old");
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  Here("s").copy(address.sun_path, sizeof address.sun_path - 1);
  const int listener = socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  close(listener);
  const Result<Config> loaded =
      Load(Link("p", "pty", Here("old")) + "[control]\nsocket = \"" + Here("s") + "\"\n");
  ASSERT_TRUE(loaded.ok()) << loaded.error();
  EXPECT_THAT(loaded.value().warnings, IsEmpty());
}

}  // namespace
}  // namespace pheromone::config
