// The certificate and the key of [web], and each way to get them wrong.

#include <filesystem>
#include <string>

#include "server/config/describe.h"
#include "server/config/testing/folder_test.h"
#include "server/net/testing/make_certificate.h"

namespace pheromone::config {
namespace {

using pheromone::testing::MakeCertificate;

constexpr std::string_view kKeys = "[web]\ntls_certificate = \"lab.pem\"\ntls_key = \"lab.key\"\n";

class TlsSectionTest : public FolderTest {
 protected:
  void WriteBoth(const Certificate& certificate) const {
    Write("lab.pem", certificate.chain);
    WriteKey(certificate.key);
  }
  void WriteKey(const std::string& key) const {
    Write("lab.key", key);
    std::filesystem::permissions(folder_ / "lab.key", std::filesystem::perms::owner_read |
                                                          std::filesystem::perms::owner_write);
  }
};

TEST_F(TlsSectionTest, BothFilesAreReadAndTheirWholeChain) {
  const Certificate own = MakeCertificate();
  const Certificate chained{own.chain + MakeCertificate().chain, own.key};
  for (const Certificate& each : {own, chained, MakeCertificate({.rsa_bits = 2048})}) {
    WriteBoth(each);
    const Result<Config> parsed = Parse(kKeys);
    ASSERT_TRUE(parsed.ok()) << parsed.error();
    EXPECT_EQ(parsed.value().web.tls, each);
    EXPECT_TRUE(parsed.value().warnings.empty());
  }
  EXPECT_FALSE(Parse("[web]\n").value().web.tls);
}

TEST_F(TlsSectionTest, TheAddressThatIsToldBeginsWithHttps) {
  WriteBoth(MakeCertificate());
  const Result<Config> parsed = Parse(std::string(kKeys) + "listen = \"127.0.0.1:8443\"\n");
  ASSERT_TRUE(parsed.ok()) << parsed.error();
  EXPECT_EQ(DescribeReach(parsed.value(), nullptr).back(),
            "web: https://127.0.0.1:8443, read-only");
}

TEST_F(TlsSectionTest, OneFileWithoutTheOtherIsRefused) {
  WriteBoth(MakeCertificate());
  EXPECT_EQ(ErrorOf("[web]\ntls_certificate = \"lab.pem\"\n"),
            "f.toml:29:1: web.tls_key: missing, expected the private key of tls_certificate, a "
            "file in PEM");
  EXPECT_EQ(ErrorOf("[web]\ntls_key = \"lab.key\"\n"),
            "f.toml:29:1: web.tls_certificate: missing, expected the certificate of tls_key, a "
            "file in PEM");
}

TEST_F(TlsSectionTest, AnErrorNamesTheFileAndTheReason) {
  EXPECT_EQ(ErrorOf(kKeys),
            "f.toml:30:19: web.tls_certificate: lab.pem: No such file or directory, expected a "
            "file\nf.toml:31:11: web.tls_key: lab.key: No such file or directory, expected a file");
  const Certificate good = MakeCertificate();
  WriteBoth({good.key, good.key});
  EXPECT_EQ(ErrorOf(kKeys),
            "f.toml:30:19: web.tls_certificate: lab.pem: found no certificate in PEM, expected "
            "-----BEGIN CERTIFICATE-----");
  WriteBoth({good.chain, good.chain});
  EXPECT_EQ(ErrorOf(kKeys),
            "f.toml:31:11: web.tls_key: lab.key: found no private key in PEM, expected -----BEGIN "
            "PRIVATE KEY-----");
  for (const unsigned rsa_bits : {0u, 2048u}) {
    WriteBoth({good.chain, MakeCertificate({.rsa_bits = rsa_bits}).key});
    EXPECT_EQ(ErrorOf(kKeys),
              "f.toml:31:11: web.tls_key: lab.key: the key does not belong to the certificate");
  }
  WriteBoth(MakeCertificate({.passphrase = "secret"}));
  EXPECT_EQ(ErrorOf(kKeys),
            "f.toml:31:11: web.tls_key: lab.key: the key has a passphrase, expected one without, "
            "such as the output of `openssl pkey`");
  WriteBoth(MakeCertificate({.rsa_bits = 1024}));
  EXPECT_EQ(ErrorOf(kKeys),
            "f.toml:30:19: web.tls_certificate: lab.pem: the certificate is refused by OpenSSL: ee "
            "key too small");
  Write("lab.pem", std::string((64 << 10) + 1, 'a'));
  EXPECT_NE(ErrorOf(kKeys).find("f.toml:30:19: web.tls_certificate: lab.pem: "), std::string::npos);
}

TEST_F(TlsSectionTest, DamagedFilesAreRefused) {
  const Certificate good = MakeCertificate();
  WriteBoth({good.chain.substr(0, good.chain.size() / 2), good.key});
  EXPECT_NE(ErrorOf(kKeys).find("lab.pem: the certificate is damaged: "), std::string::npos);
  WriteBoth({good.chain + good.chain.substr(0, good.chain.size() / 2), good.key});
  EXPECT_NE(ErrorOf(kKeys).find("lab.pem: a certificate after the first is damaged: "),
            std::string::npos);
  WriteBoth({good.chain, good.key.substr(0, good.key.size() / 2)});
  EXPECT_NE(ErrorOf(kKeys).find("lab.key: the private key is damaged: "), std::string::npos);
}

TEST_F(TlsSectionTest, ACertificateThatIsNotValidTodayIsWarnedOf) {
  for (const auto& [options, words] :
       {std::pair(pheromone::testing::CertificateOptions{.begins_s = -7200, .ends_s = -3600},
                  "lab.pem: expired on "),
        std::pair(pheromone::testing::CertificateOptions{.begins_s = 3600, .ends_s = 7200},
                  "lab.pem: not valid before ")}) {
    WriteBoth(MakeCertificate(options));
    const Result<Config> parsed = Parse(kKeys);
    ASSERT_TRUE(parsed.ok()) << parsed.error();
    ASSERT_EQ(parsed.value().warnings.size(), 1u);
    EXPECT_NE(parsed.value().warnings[0].text.find(words), std::string::npos)
        << parsed.value().warnings[0].text;
    EXPECT_TRUE(parsed.value().warnings[0].urgent);
  }
}

TEST_F(TlsSectionTest, AKeyThatAllUsersCanReadIsWarnedOf) {
  WriteBoth(MakeCertificate());
  std::filesystem::permissions(folder_ / "lab.key", std::filesystem::perms(0644));
  const Result<Config> parsed = Parse(kKeys);
  ASSERT_TRUE(parsed.ok()) << parsed.error();
  ASSERT_EQ(parsed.value().warnings.size(), 1u);
  EXPECT_NE(parsed.value().warnings[0].text.find("lab.key is readable by all users"),
            std::string::npos);
}

}  // namespace
}  // namespace pheromone::config
