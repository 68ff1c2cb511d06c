// [control] and [web], and each way to get them wrong.

#include <filesystem>

#include "server/config/testing/folder_test.h"

namespace pheromone::config {
namespace {

constexpr std::string_view kToken = "0123456789abcdef";

class ControlTest : public FolderTest {
 protected:
  void WriteToken(std::string_view text, std::filesystem::perms perms) const {
    Write("token", text);
    std::filesystem::permissions(folder_ / "token", perms);
  }

  static constexpr auto kPrivate =
      std::filesystem::perms::owner_read | std::filesystem::perms::owner_write;
};

TEST_F(ControlTest, WithoutTablesThereIsASocketAndNoWeb) {
  const Config config = Parse("").value();
  EXPECT_EQ(config.control.socket, "pheromoned.sock");
  EXPECT_EQ(config.web, WebSettings());
}

TEST_F(ControlTest, TheDefaultConfigurationIsReadableOnLocalhostAndNamesATokenToBeMade) {
  WebSettings expected{{"127.0.0.1", 8377}, "", {}};
  EXPECT_EQ(ParseConfig(DefaultConfigText(), "default").value().web, expected);  // of no server
  expected.token_file = (folder_ / "web-token").string();
  EXPECT_EQ(ParseConfig(DefaultConfigText(), "default", folder_).value().web, expected);
}

TEST_F(ControlTest, EveryKeyIsRead) {
  WriteToken("\n " + std::string(kToken) + "\r\n", kPrivate);
  const Result<Config> parsed = Parse(
      "[control]\nsocket = \"/run/lab.sock\"\n[web]\nlisten = \"[::1]:80\"\n"
      "token_file = \"token\"\nhosts = [\"Lab.Local\", \"robots\"]\n");
  ASSERT_TRUE(parsed.ok()) << parsed.error();
  EXPECT_EQ(parsed.value().control.socket, "/run/lab.sock");
  WebSettings expected{{"::1", 80}, std::string(kToken), {"lab.local", "robots"}};
  expected.token_file = (folder_ / "token").string();
  EXPECT_EQ(parsed.value().web, expected);
  EXPECT_TRUE(parsed.value().warnings.empty());
  EXPECT_EQ(Parse("[control]\nenabled = false\n").value().control.socket, "");
}

TEST_F(ControlTest, ATokenThatAllUsersCanReadIsWarnedOf) {
  WriteToken(kToken, kPrivate | std::filesystem::perms::others_read);
  const Result<Config> parsed = Parse("[web]\ntoken_file = \"token\"\n");
  ASSERT_TRUE(parsed.ok()) << parsed.error();
  ASSERT_EQ(parsed.value().warnings.size(), 1u);
  EXPECT_NE(parsed.value().warnings[0].text.find("f.toml:30:14: web.token_file: "),
            std::string::npos);
  EXPECT_NE(parsed.value().warnings[0].text.find("is readable by all users"), std::string::npos);
  EXPECT_TRUE(parsed.value().warnings[0].urgent);
}

TEST_F(ControlTest, AnAddressForOthersWithoutTlsIsWarnedOf) {
  for (const auto& [listen, warnings] :
       {std::pair("0.0.0.0:8377", 1u), std::pair("[::]:8377", 1u), std::pair("192.0.2.7:80", 1u),
        std::pair("127.0.0.1:8377", 0u), std::pair("127.3.0.1:80", 0u),
        std::pair("[::1]:80", 0u)}) {
    const Result<Config> parsed = Parse("[web]\nlisten = \"" + std::string(listen) + "\"\n");
    ASSERT_TRUE(parsed.ok()) << parsed.error();
    ASSERT_EQ(parsed.value().warnings.size(), warnings) << listen;
    if (warnings != 0) {
      EXPECT_EQ(
          parsed.value().warnings[0].text,
          "f.toml:30:10: web.listen: the token, and all that is shown, can be read on the way "
          "to " +
              std::string(listen) +
              ", expected tls_certificate and tls_key, or 127.0.0.1 "
              "and an HTTPS proxy before it");
    }
  }
}

TEST_F(ControlTest, MistakesAreToldWithTheirPlace) {
  EXPECT_EQ(ErrorOf("[control]\nsokket = \"a\"\n"),
            "f.toml:30:1: control.sokket: unknown key, expected socket?");
  EXPECT_NE(ErrorOf("[control]\nsocket = \"" + std::string(108, 'a') + "\"\n")
                .find("expected a path of at most 107 bytes"),
            std::string::npos);
  EXPECT_EQ(ErrorOf("[web]\nport = 80\n"),
            "f.toml:30:1: web.port: unknown key, expected one of listen, token_file, hosts, "
            "origins, max_viewers, ros_distro, click_pheromone, tls_certificate, tls_key");
  EXPECT_EQ(ErrorOf("[web]\nlisten = \"localhost:80\"\n"),
            "f.toml:30:10: web.listen: found the string \"localhost:80\", expected a numeric "
            "address and a port such as \"127.0.0.1:4950\" or \"[::1]:4950\"");
  EXPECT_EQ(ErrorOf("[web]\ntoken_file = \"/nonexistent/token\"\n"),
            "f.toml:30:14: web.token_file: /nonexistent/token: No such file or directory, expected "
            "a file");
}

TEST_F(ControlTest, AHostIsANameWithoutSchemeAndPort) {
  EXPECT_EQ(ErrorOf("[web]\nhosts = [\"robots\", \"lab:8377\"]\n"),
            "f.toml:30:20: web.hosts: found the string \"lab:8377\", expected host names without a "
            "port, such as [\"lab.local\", \"robots\"]");
  for (const char* bad : {"\"lab\"", "[1]", "[\"\"]", "[\"http://lab\"]", "[\"*\"]", "[\"a b\"]"}) {
    EXPECT_NE(ErrorOf("[web]\nhosts = " + std::string(bad) + "\n").find("web.hosts: found "),
              std::string::npos)
        << bad;
  }
}

TEST_F(ControlTest, ReadsWhatConcernsViewers) {
  const Result<Config> parsed = Parse(
      "[web]\norigins = [\"https://app.foxglove.dev\", \"http://lab:8080\", \"null\", "
      "\"file://\"]\n"
      "max_viewers = 5\nros_distro = \"none\"\nclick_pheromone = \"path\"\n");
  ASSERT_TRUE(parsed.ok()) << parsed.error();
  EXPECT_EQ(
      parsed.value().web.origins,
      (std::vector<std::string>{"https://app.foxglove.dev", "http://lab:8080", "null", "file://"}));
  EXPECT_EQ(parsed.value().web.max_viewers, 5u);
  EXPECT_EQ(parsed.value().web.ros_distro, "");
  EXPECT_EQ(parsed.value().web.click_pheromone, "path");
  for (const char* bad :
       {"\"https://a\"", "[1]", "[\"app.foxglove.dev\"]", "[\"https://\"]", "[\"https://a/b\"]",
        "[\"*\"]", "[\"https://*.a\"]", "[\"file://a\"]", "[\"NULL\"]"}) {
    EXPECT_NE(ErrorOf("[web]\norigins = " + std::string(bad) + "\n").find("web.origins: found "),
              std::string::npos)
        << bad;
  }
  EXPECT_NE(ErrorOf("[web]\nmax_viewers = 49\n").find("web.max_viewers: "), std::string::npos);
}

TEST_F(ControlTest, ATokenThatCouldBeGuessedOrNotBeSentIsRefused) {
  for (const std::string& bad :
       {std::string(), std::string("short"), std::string("0123456789 abcdefgh"),
        std::string("0123456789abcdef\x01"), std::string(257, 'a')}) {
    WriteToken(bad, kPrivate);
    EXPECT_NE(ErrorOf("[web]\ntoken_file = \"token\"\n").find("expected 16 to 256 letters"),
              std::string::npos)
        << bad;
  }
}

}  // namespace
}  // namespace pheromone::config
