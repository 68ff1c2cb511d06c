// TLS on real sockets, of a real server. proto_tests/tls_test.py has foreign clients.

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "server/net/testing/make_certificate.h"
#include "server/operators/web/testing/listening_server.h"

namespace pheromone::web {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kLong{60'000};  // never comes in a test that works

// A connection of a client, blocking, first without TLS.
class TlsClient {
 public:
  explicit TlsClient(uint16_t port) : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  TlsClient(const TlsClient&) = delete;
  TlsClient& operator=(const TlsClient&) = delete;
  ~TlsClient() { close(socket_); }

  // Returns whether the server has this certificate, which is its own authority, for 127.0.0.1.
  // With these `ciphers` of TLS 1.2 alone, if there are any.
  bool ShakeHands(const Certificate& expected, int version = 0, const char* ciphers = nullptr) {
    const Context context(SSL_CTX_new(TLS_client_method()), SSL_CTX_free);
    BIO* const pem = BIO_new_mem_buf(expected.chain.data(), -1);
    X509* const authority = PEM_read_bio_X509(pem, nullptr, nullptr, nullptr);
    X509_STORE_add_cert(SSL_CTX_get_cert_store(context.get()), authority);
    X509_free(authority);
    BIO_free(pem);
    SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER, nullptr);
    if (version != 0) {
      SSL_CTX_set_security_level(context.get(), 0);
      SSL_CTX_set_min_proto_version(context.get(), version);
      SSL_CTX_set_max_proto_version(context.get(), version);
    }
    if (ciphers != nullptr) {
      EXPECT_EQ(SSL_CTX_set_cipher_list(context.get(), ciphers), 1);
    }
    ssl_.reset(SSL_new(context.get()));
    X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(ssl_.get()), "127.0.0.1");
    SSL_set_fd(ssl_.get(), socket_);
    return SSL_connect(ssl_.get()) == 1;
  }

  void Send(std::string_view bytes) {
    SSL_write(ssl_.get(), bytes.data(), static_cast<int>(bytes.size()));
  }
  void SendPlain(std::string_view bytes) const {
    EXPECT_EQ(send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(bytes.size()));
  }
  void EndSending() { SSL_shutdown(ssl_.get()); }

  std::string ReadAll() {
    std::string all;
    char buffer[4096];
    for (int size = 0; (size = SSL_read(ssl_.get(), buffer, sizeof buffer)) > 0;) {
      all.append(buffer, static_cast<size_t>(size));
    }
    return all;
  }
  std::string ReadUntil(std::string_view end) {
    std::string all;
    char byte = 0;
    while (!all.ends_with(end) && SSL_read(ssl_.get(), &byte, 1) == 1) {
      all += byte;
    }
    return all;
  }
  bool server_said_goodbye() const {
    return (SSL_get_shutdown(ssl_.get()) & SSL_RECEIVED_SHUTDOWN) != 0;
  }
  std::string ReadAllPlain() const {
    std::string all;
    char buffer[4096];
    for (ssize_t size = 0; (size = read(socket_, buffer, sizeof buffer)) > 0;) {
      all.append(buffer, static_cast<size_t>(size));
    }
    return all;
  }

 private:
  using Context = std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)>;

  const int socket_;
  std::unique_ptr<SSL, decltype(&SSL_free)> ssl_{nullptr, SSL_free};
};

class TlsTest : public testing::ListeningServer {
 protected:
  TlsTest() {
    options_.patience = kLong;
    options_.handshake_patience = kLong;
  }

  // Answers with what it knows of a request; /long has a body of 16 MiB.
  void Start(int threads = 2) {
    Make([](const Request& request, const Respond& respond) {
      respond(request.target == "/long"
                  ? Response{.body = std::string(size_t{16} << 20, 'x')}
                  : Response{.body = request.method + " " + request.target +
                                     (request.local ? " local" : "") +
                                     (request.encrypted ? " encrypted " : " plain ") +
                                     std::to_string(request.body.size()) + "."});
    });
    server_->SetCertificate(CheckCertificate(certificate_).context);
    Listen(threads);
  }

  const Certificate certificate_ = pheromone::testing::MakeCertificate();
};

constexpr char kGetOnce[] = "GET /a HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n";

TEST_F(TlsTest, RequestsAreServedAndKnownToBeEncrypted) {
  Start();
  for (const int version : {TLS1_2_VERSION, TLS1_3_VERSION}) {
    TlsClient client(server_->port());
    ASSERT_TRUE(client.ShakeHands(certificate_, version));
    client.Send("GET /a HTTP/1.1\r\nHost: x\r\n\r\n");
    EXPECT_TRUE(client.ReadUntil("0.").ends_with("GET /a encrypted 0."));
    const std::string body(900'000, 'b');  // more than all buffers on its way
    client.Send(
        "POST /b HTTP/1.1\r\nHost: x\r\nContent-Length: 900000\r\nConnection: close\r\n\r\n");
    client.Send(body);
    EXPECT_TRUE(client.ReadAll().ends_with("POST /b encrypted 900000."));
    EXPECT_TRUE(client.server_said_goodbye());  // so that the client knows that it has all
  }
  EXPECT_EQ(server_->tls_counters().accepted, 2u);
}

TEST_F(TlsTest, OlderVersionsAndForeignAuthoritiesAreRefused) {
  Start();
  EXPECT_FALSE(TlsClient(server_->port()).ShakeHands(certificate_, TLS1_1_VERSION));
  EXPECT_FALSE(TlsClient(server_->port()).ShakeHands(pheromone::testing::MakeCertificate()));
}

// Without forward secrecy, who gets the key later reads all that was said; CBC has had its attacks.
TEST_F(TlsTest, OfTls12OnlyCiphersWithForwardSecrecyAndAuthenticatedEncryptionAreTaken) {
  Start();
  const auto shake = [this](const char* ciphers) {
    return TlsClient(server_->port()).ShakeHands(certificate_, TLS1_2_VERSION, ciphers);
  };
  EXPECT_TRUE(shake("ECDHE-ECDSA-AES128-GCM-SHA256:ECDHE-RSA-AES128-GCM-SHA256"));
  EXPECT_TRUE(shake("ECDHE-ECDSA-CHACHA20-POLY1305:ECDHE-RSA-CHACHA20-POLY1305"));
  EXPECT_FALSE(shake("AES128-GCM-SHA256:AES256-GCM-SHA384:AES128-SHA"));
  EXPECT_FALSE(shake("ECDHE-ECDSA-AES128-SHA:ECDHE-RSA-AES128-SHA:ECDHE-ECDSA-AES128-SHA256"));
}

TEST_F(TlsTest, AnotherCertificateIsForNewConnectionsAndOldOnesStay) {
  Start();
  TlsClient old(server_->port());
  ASSERT_TRUE(old.ShakeHands(certificate_));
  const Certificate next = pheromone::testing::MakeCertificate();
  server_->SetCertificate(CheckCertificate(next).context);
  TlsClient client(server_->port());
  EXPECT_TRUE(client.ShakeHands(next));
  EXPECT_FALSE(TlsClient(server_->port()).ShakeHands(certificate_));
  for (TlsClient* each : {&old, &client}) {
    each->Send(kGetOnce);
    EXPECT_TRUE(each->ReadAll().ends_with("GET /a encrypted 0."));
  }
}

TEST_F(TlsTest, AClientThatHasNothingMoreToSayStillGetsItsAnswer) {
  Start();
  TlsClient client(server_->port());
  ASSERT_TRUE(client.ShakeHands(certificate_));
  client.Send("GET /long HTTP/1.1\r\nHost: x\r\n\r\n");
  client.EndSending();
  EXPECT_GT(client.ReadAll().size(), size_t{16} << 20);
}

TEST_F(TlsTest, WhoIsRefusedWhileSendingGetsTheReason) {
  Start();
  TlsClient client(server_->port());
  ASSERT_TRUE(client.ShakeHands(certificate_));
  client.Send("POST /b HTTP/1.1\r\nHost: x\r\nContent-Length: 9000000\r\n\r\n");
  client.Send(std::string(500'000, 'b'));
  EXPECT_TRUE(client.ReadAll().starts_with("HTTP/1.1 413 "));
}

TEST_F(TlsTest, PlainHttpIsToldWhatToSpeak) {
  Start();
  const TlsClient client(server_->port());
  client.SendPlain("GET / HTTP/1.1\r\nHost: x\r\n\r\n");
  const std::string answer = client.ReadAllPlain();
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 400 ")) << answer;
  const size_t body = answer.find("\r\n\r\n") + 4;
  EXPECT_NE(answer.find("Content-Length: " + std::to_string(answer.size() - body) + "\r\n"),
            std::string::npos)
      << answer;
}

TEST_F(TlsTest, RubbishEndsTheConnection) {
  Start();
  for (const std::string& rubbish :
       {std::string("\x16\x03\x01\xff\xff", 5) + std::string(70'000, '\xff'),
        std::string(100, '\0'), std::string("\x80\x2e\x01\x03\x01", 5) + std::string(60, 'a')}) {
    const TlsClient client(server_->port());
    client.SendPlain(rubbish);
    client.ReadAllPlain();  // an alert perhaps, and then the end
  }
  TlsClient client(server_->port());  // instead of a record, once it is established
  ASSERT_TRUE(client.ShakeHands(certificate_));
  client.SendPlain(std::string(20'000, '\xff'));
  client.ReadAllPlain();
}

TEST_F(TlsTest, AHandshakeThatStopsIsEndedAfterItsTime) {
  options_.handshake_patience = milliseconds{50};
  Start();
  const TlsClient silent(server_->port());
  const TlsClient stopped(server_->port());
  stopped.SendPlain(std::string("\x16\x03\x01\x02\x00\x01", 6));
  EXPECT_EQ(silent.ReadAllPlain(), "");
  EXPECT_EQ(stopped.ReadAllPlain(), "");
}

TEST_F(TlsTest, AClientThatDoesNotReadHoldsUpTheServersWritingAndIsEndedAfterItsTime) {
  options_.patience = milliseconds{50};
  Start();
  TlsClient client(server_->port());
  ASSERT_TRUE(client.ShakeHands(certificate_));
  client.Send("GET /long HTTP/1.1\r\nHost: x\r\n\r\n");
  while (server_->tls_counters().connections > 0) {  // at last the server ends it
    std::this_thread::yield();
  }
  EXPECT_LT(client.ReadAll().size(), size_t{16} << 20);
}

TEST_F(TlsTest, IdleConnectionsAndHandshakesMakeRoom) {
  options_.max_connections = 10;
  options_.max_handshakes = 20;
  Start();
  std::vector<std::unique_ptr<TlsClient>> others;
  for (int i = 0; i < 100; ++i) {
    others.push_back(std::make_unique<TlsClient>(server_->port()));
    if (i % 2 == 0) {
      EXPECT_TRUE(others.back()->ShakeHands(certificate_)) << i;
    }
    EXPECT_LE(server_->tls_counters().connections, 40u);
  }
  TlsClient client(server_->port());
  ASSERT_TRUE(client.ShakeHands(certificate_));
  client.Send(kGetOnce);
  EXPECT_TRUE(client.ReadAll().ends_with("GET /a encrypted 0."));
}

TEST_F(TlsTest, StopEndsIdleClientsHandshakesAndThoseWhoDoNotRead) {
  Start();
  TlsClient idle(server_->port());
  ASSERT_TRUE(idle.ShakeHands(certificate_));
  const TlsClient silent(server_->port());
  TlsClient stuck(server_->port());
  ASSERT_TRUE(stuck.ShakeHands(certificate_));
  stuck.Send("GET /long HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_TRUE(stuck.ReadUntil("xxx").ends_with("xxx"));
  TearDown();  // returns when all is closed
  EXPECT_EQ(idle.ReadAll(), "");
  EXPECT_TRUE(idle.server_said_goodbye());
}

}  // namespace
}  // namespace pheromone::web
