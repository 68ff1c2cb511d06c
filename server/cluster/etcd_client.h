// Talks to the members of etcd over their HTTP gateways: keep-alive connections, the first member
// that responds.
//
//   auto client = std::make_shared<EtcdClient>(strand, members, patience, on_member);
//   const Result<EtcdAnswer> answer = co_await client->Call(kTxnPath, request);
//
// The members are asked in their order; one that failed is asked last, until it responds again to
// a probe, once a second. So a request may be executed more than once, and later than its answer is
// given up: all must be such that this does no harm.
//
// On one executor, also Stop. Who awaits something holds the client.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>

#include "server/base/result.h"
#include "server/net/endpoint.h"

namespace pheromone::cluster {

struct EtcdAnswer {
  size_t member = 0;  ///< that gave it
  std::string text;
};

class EtcdStream;

class EtcdClient : public std::enable_shared_from_this<EtcdClient> {
 public:
  /// Told when a member stops responding, with the error, and when it responds again.
  using OnMember = std::function<void(const Endpoint&, const Status&)>;

  /// `patience`: how long a member may be silent when it is to answer, and in addition the same for
  /// each 512 KiB that it is sent.
  EtcdClient(boost::asio::any_io_executor executor, const std::vector<Endpoint>& members,
             std::chrono::milliseconds patience, OnMember on_member);

  /// The answer of the first member that gives one. Errors: none does, told after kMinFailure at
  /// the soonest, so that who asks again at once does no harm; a refusal that each member would
  /// repeat.
  boost::asio::awaitable<Result<EtcdAnswer>> Call(const std::string& path, const std::string& body);
  static constexpr std::chrono::milliseconds kMinFailure{50};
  /// Of this member only; its failure has no consequences.
  boost::asio::awaitable<Result<std::string>> CallMember(size_t member, const std::string& path,
                                                         const std::string& body);
  /// An answer that goes on and on.
  boost::asio::awaitable<Result<std::unique_ptr<EtcdStream>>> Open(size_t member,
                                                                   const std::string& path,
                                                                   const std::string& body);

  /// Asks this member last from now on: its answer is unusable, or its stream ended.
  void SetDown(size_t member, const Error& error);
  size_t size() const { return members_.size(); }
  /// "etcd at 10.0.0.1:2379: WHAT"
  Error ErrorAt(size_t member, const std::string& what) const;

  boost::asio::awaitable<void> Pause(std::chrono::milliseconds time);
  /// Ends everything that waits, with errors.
  void Stop();
  bool stopped() const { return stopped_; }

 private:
  friend class EtcdStream;

  struct Connection {
    Connection(EtcdClient* client, size_t of_member);
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;
    ~Connection();

    EtcdClient* client;  // whose Stop closes it
    size_t member;
    bool is_new = true;
    boost::beast::tcp_stream stream;
    boost::beast::flat_buffer buffer;
  };
  struct Member {
    Endpoint endpoint;
    bool is_up = true;
    bool is_probed = false;
    std::vector<std::unique_ptr<Connection>> idle;
  };
  struct Reply {
    unsigned status = 0;
    std::string text;
  };
  using Parser = boost::beast::http::response_parser<boost::beast::http::string_body>;

  std::vector<size_t> Order() const;
  void SetUp(size_t member);
  boost::asio::awaitable<void> Probe(size_t member);
  std::unique_ptr<Connection> Idle(size_t member);
  boost::asio::awaitable<Result<Reply>> Ask(size_t member, const std::string& path,
                                            const std::string& body);
  boost::asio::awaitable<boost::system::error_code> Connect(Connection* connection);
  boost::asio::awaitable<boost::system::error_code> Send(Connection* connection,
                                                         const std::string& path,
                                                         const std::string& body);
  boost::asio::awaitable<boost::system::error_code> Receive(Connection* connection, Parser* parser);
  Error Describe(size_t member, const boost::system::error_code& error) const;
  Error Describe(size_t member, const std::string& path, const Reply& reply) const;

  const boost::asio::any_io_executor executor_;
  const std::chrono::milliseconds patience_;
  const OnMember on_member_;
  bool stopped_ = false;
  std::set<Connection*> open_;
  std::set<boost::asio::steady_timer*> pauses_;
  std::vector<Member> members_;  // after open_: idle connections are in it
};

/// The lines of an answer that goes on and on.
class EtcdStream {
 public:
  /// The next line; none if nothing came for `silence`: then the stream has ended. Errors: it
  /// ended, or a line is too long.
  boost::asio::awaitable<Result<std::optional<std::string>>> Next(
      std::chrono::milliseconds silence);

 private:
  friend class EtcdClient;
  EtcdStream(std::shared_ptr<EtcdClient> client,
             std::unique_ptr<EtcdClient::Connection> connection);

  std::shared_ptr<EtcdClient> client_;  // before the connection, which refers to it
  std::unique_ptr<EtcdClient::Connection> connection_;
  EtcdClient::Parser parser_;
  std::string rest_;     // what was received after the last line
  size_t searched_ = 0;  // bytes of it in which no line ends
};

}  // namespace pheromone::cluster
