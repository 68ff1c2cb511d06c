#include "server/cluster/etcd_client.h"

#include <cstdint>
#include <exception>
#include <limits>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>

#include "server/cluster/etcd_messages.h"

namespace pheromone::cluster {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using boost::system::error_code;
using std::chrono::milliseconds;

constexpr milliseconds kBetweenProbes{1000};
constexpr size_t kBytesPerPatience = size_t{512} << 10;
constexpr size_t kMaxAnswerBytes = size_t{64} << 20;
constexpr size_t kMaxLineBytes = size_t{16} << 20;
constexpr size_t kMaxIdle = 4;  // connections of a member
constexpr unsigned kOk = 200;
constexpr unsigned kBadRequest = 400;
constexpr unsigned kPreconditionFailed = 412;

// Only a member that has heard of a majority answers it. The key is a byte 0.
constexpr char kProbePath[] = "/v3/kv/range";
constexpr char kProbe[] = R"({"key":"AA=="})";

auto Into(error_code* error) {
  return asio::redirect_error(asio::use_awaitable, *error);
}

}  // namespace

EtcdClient::Connection::Connection(EtcdClient* of_client, size_t of_member)
    : client(of_client), member(of_member), stream(of_client->executor_) {
  client->open_.insert(this);
}

EtcdClient::Connection::~Connection() {
  client->open_.erase(this);
}

EtcdClient::EtcdClient(asio::any_io_executor executor, const std::vector<Endpoint>& members,
                       milliseconds patience, OnMember on_member)
    : executor_(std::move(executor)), patience_(patience), on_member_(std::move(on_member)) {
  for (const Endpoint& endpoint : members) {
    members_.emplace_back().endpoint = endpoint;
  }
}

void EtcdClient::Stop() {
  stopped_ = true;
  for (Member& member : members_) {
    member.idle.clear();
  }
  for (Connection* const connection : open_) {
    connection->stream.close();
  }
  for (asio::steady_timer* const pause : pauses_) {
    pause->cancel();
  }
}

Error EtcdClient::ErrorAt(size_t member, const std::string& what) const {
  return Error{"etcd at " + ToText(members_[member].endpoint) + ": " + what};
}

Error EtcdClient::Describe(size_t member, const error_code& error) const {
  return ErrorAt(member, error == beast::error::timeout
                             ? "no answer within " + std::to_string(patience_.count()) + " ms"
                             : error.message());
}

Error EtcdClient::Describe(size_t member, const std::string& path, const Reply& reply) const {
  return ErrorAt(member,
                 path + ": status " + std::to_string(reply.status) + ": " + ErrorOf(reply.text));
}

void EtcdClient::SetDown(size_t member, const Error& error) {
  if (!members_[member].is_up || stopped_) {
    return;
  }
  members_[member].is_up = false;
  members_[member].idle.clear();
  // One that was up for a moment may still be probed.
  if (!std::exchange(members_[member].is_probed, true)) {
    const auto self = shared_from_this();
    asio::co_spawn(
        executor_, [self, member] { return self->Probe(member); },
        [](const std::exception_ptr& thrown) {
          if (thrown) {
            std::rethrow_exception(thrown);
          }
        });
  }
  if (on_member_) {
    on_member_(members_[member].endpoint, error);
  }
}

void EtcdClient::SetUp(size_t member) {
  if (members_[member].is_up || stopped_) {
    return;
  }
  members_[member].is_up = true;
  if (on_member_) {
    on_member_(members_[member].endpoint, Ok());
  }
}

asio::awaitable<void> EtcdClient::Probe(size_t member) {
  const std::string path = kProbePath;
  const std::string body = kProbe;
  while (!stopped_ && !members_[member].is_up) {
    co_await Pause(kBetweenProbes);
    const Result<std::string> answer = co_await CallMember(member, path, body);
    if (answer.ok()) {
      SetUp(member);
    }
  }
  members_[member].is_probed = false;
}

asio::awaitable<void> EtcdClient::Pause(milliseconds time) {
  if (stopped_) {
    co_return;
  }
  asio::steady_timer timer(executor_, time);
  pauses_.insert(&timer);
  error_code ignored;
  co_await timer.async_wait(Into(&ignored));
  pauses_.erase(&timer);
}

std::vector<size_t> EtcdClient::Order() const {
  std::vector<size_t> order;
  for (const bool is_up : {true, false}) {
    for (size_t member = 0; member < members_.size(); ++member) {
      if (members_[member].is_up == is_up) {
        order.push_back(member);
      }
    }
  }
  return order;
}

asio::awaitable<Result<EtcdAnswer>> EtcdClient::Call(const std::string& path,
                                                     const std::string& body) {
  std::string errors;
  const std::vector<size_t> order = Order();
  for (const size_t member : order) {
    Result<Reply> reply = co_await Ask(member, path, body);
    if (stopped_) {
      co_return Error{"stopped"};
    }
    if (reply.ok() && reply.value().status == kOk) {
      SetUp(member);
      co_return EtcdAnswer{member, std::move(reply.value().text)};
    }
    const Error error = reply.ok() ? Describe(member, path, reply.value()) : reply.error();
    if (reply.ok() &&
        (reply.value().status == kBadRequest || reply.value().status == kPreconditionFailed)) {
      co_return error;
    }
    SetDown(member, error);
    errors += (errors.empty() ? "" : "; ") + error;
  }
  co_await Pause(kMinFailure);
  co_return Error{errors.empty() ? "no member of etcd is given, expected at least one" : errors};
}

asio::awaitable<Result<std::string>> EtcdClient::CallMember(size_t member, const std::string& path,
                                                            const std::string& body) {
  Result<Reply> reply = co_await Ask(member, path, body);
  if (!reply.ok()) {
    co_return reply.error();
  }
  if (reply.value().status != kOk) {
    co_return Describe(member, path, reply.value());
  }
  co_return std::move(reply.value().text);
}

std::unique_ptr<EtcdClient::Connection> EtcdClient::Idle(size_t member) {
  std::vector<std::unique_ptr<Connection>>& idle = members_[member].idle;
  if (idle.empty()) {
    return std::make_unique<Connection>(this, member);
  }
  std::unique_ptr<Connection> connection = std::move(idle.back());
  idle.pop_back();
  return connection;
}

asio::awaitable<Result<EtcdClient::Reply>> EtcdClient::Ask(size_t member, const std::string& path,
                                                           const std::string& body) {
  while (!stopped_) {
    std::unique_ptr<Connection> connection = Idle(member);
    const bool was_new = connection->is_new;
    error_code error = co_await Send(connection.get(), path, body);
    Parser parser;
    parser.body_limit(kMaxAnswerBytes);
    while (!error && !parser.is_done()) {
      error = co_await Receive(connection.get(), &parser);
    }
    if (!error) {
      Reply reply{parser.get().result_int(), std::move(parser.get().body())};
      if (parser.keep_alive() && !stopped_ && members_[member].idle.size() < kMaxIdle) {
        connection->stream.expires_never();
        members_[member].idle.push_back(std::move(connection));
      }
      co_return reply;
    }
    // The member may have closed a connection that was idle, for example by a restart.
    if (was_new || error == beast::error::timeout) {
      co_return Describe(member, error);
    }
  }
  co_return Error{"stopped"};
}

asio::awaitable<error_code> EtcdClient::Connect(Connection* connection) {
  const Endpoint& where = members_[connection->member].endpoint;
  error_code error;
  const asio::ip::address address = asio::ip::make_address(where.address, error);
  if (!error) {
    const asio::ip::tcp::endpoint endpoint(address, where.port);
    co_await connection->stream.async_connect(endpoint, Into(&error));
  }
  if (!error) {
    connection->stream.socket().set_option(asio::ip::tcp::no_delay(true), error);
  }
  connection->is_new = false;
  co_return error;
}

asio::awaitable<error_code> EtcdClient::Send(Connection* connection, const std::string& path,
                                             const std::string& body) {
  const auto factor = static_cast<milliseconds::rep>(1 + body.size() / kBytesPerPatience);
  connection->stream.expires_after(patience_ * factor);
  error_code error;
  if (connection->is_new) {
    error = co_await Connect(connection);
  }
  if (!error) {
    http::request<http::string_body> request;
    request.method(http::verb::post);
    request.target(path);
    request.set(http::field::host, ToText(members_[connection->member].endpoint));
    request.set(http::field::content_type, "application/json");
    request.body() = body;
    request.prepare_payload();
    co_await http::async_write(connection->stream, request, Into(&error));
  }
  co_return error;
}

asio::awaitable<error_code> EtcdClient::Receive(Connection* connection, Parser* parser) {
  error_code error;
  co_await http::async_read_some(connection->stream, connection->buffer, *parser, Into(&error));
  connection->stream.expires_after(patience_);  // it makes progress
  co_return error;
}

asio::awaitable<Result<std::unique_ptr<EtcdStream>>> EtcdClient::Open(size_t member,
                                                                      const std::string& path,
                                                                      const std::string& body) {
  auto connection = std::make_unique<Connection>(this, member);
  std::unique_ptr<EtcdStream> stream(new EtcdStream(shared_from_this(), std::move(connection)));
  error_code error = co_await Send(stream->connection_.get(), path, body);
  while (!error && !stream->parser_.is_header_done()) {
    error = co_await Receive(stream->connection_.get(), &stream->parser_);
  }
  if (stopped_) {
    co_return Error{"stopped"};
  }
  if (error) {
    co_return Describe(member, error);
  }
  const unsigned status = stream->parser_.get().result_int();
  if (status != kOk) {
    const Reply reply{status, stream->parser_.get().body()};
    co_return Describe(member, path, reply);
  }
  co_return std::move(stream);
}

EtcdStream::EtcdStream(std::shared_ptr<EtcdClient> client,
                       std::unique_ptr<EtcdClient::Connection> connection)
    : client_(std::move(client)), connection_(std::move(connection)) {
  parser_.body_limit(std::numeric_limits<uint64_t>::max());
}

asio::awaitable<Result<std::optional<std::string>>> EtcdStream::Next(milliseconds silence) {
  while (true) {
    rest_ += std::exchange(parser_.get().body(), {});
    if (const size_t end = rest_.find('\n', searched_); end != std::string::npos) {
      std::string line = rest_.substr(0, end);
      rest_.erase(0, end + 1);
      searched_ = 0;
      co_return std::optional<std::string>(std::move(line));
    }
    searched_ = rest_.size();
    const size_t member = connection_->member;
    if (rest_.size() > kMaxLineBytes) {
      co_return client_->ErrorAt(
          member, "a line of more than " + std::to_string(kMaxLineBytes) + " bytes in a watch");
    }
    if (parser_.is_done()) {
      co_return client_->ErrorAt(member, "the watch has ended");
    }
    connection_->stream.expires_after(silence);
    error_code error;
    co_await http::async_read_some(connection_->stream, connection_->buffer, parser_, Into(&error));
    if (error == beast::error::timeout) {
      co_return std::optional<std::string>();
    }
    if (error) {
      co_return client_->Describe(member, error);
    }
  }
}

}  // namespace pheromone::cluster
