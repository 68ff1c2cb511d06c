// A viewer over a real socket, which reads when it is told to.
//
//   Client client(std::move(connected_socket));
//   ASSERT_EQ(client.Shake({.target = "/"}), 101);
//   client.Subscribe({"/status"});
//   client.AwaitMessage(1);
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>

namespace pheromone::web::testing {

struct Knock {
  std::string target = "/";
  std::string origin = {};
  std::string host = "127.0.0.1";
  std::string subprotocol = "foxglove.websocket.v1";
  bool local = false;
};

class Client {
 public:
  using Socket = boost::asio::generic::stream_protocol::socket;

  explicit Client(Socket socket) : socket_(std::move(socket)) {}

  // The status of the handshake; 101: connected.
  int Shake(const Knock& knock) {
    socket_.set_option(boost::beast::websocket::stream_base::decorator(
        [&knock](boost::beast::websocket::request_type& request) {
          using boost::beast::http::field;
          if (!knock.origin.empty()) {
            request.set(field::origin, knock.origin);
          }
          if (!knock.subprotocol.empty()) {
            request.set(field::sec_websocket_protocol, knock.subprotocol);
          }
        }));
    boost::beast::websocket::response_type response;
    boost::system::error_code error;
    socket_.handshake(response, knock.host, knock.target, error);
    subprotocol = std::string(response[boost::beast::http::field::sec_websocket_protocol]);
    return static_cast<int>(response.result_int());
  }

  void Send(const std::string& text) {
    socket_.binary(false);
    socket_.write(boost::asio::buffer(text));
  }
  void SendBinary(const std::string& bytes) {
    socket_.binary(true);
    socket_.write(boost::asio::buffer(bytes));
  }

  // A text message with this op.
  boost::json::object Await(const std::string& op) {
    return boost::json::parse(Next([&](const std::string& bytes, bool is_binary) {
             return !is_binary && boost::json::parse(bytes).at("op").as_string() == op;
           }))
        .as_object();
  }
  // A message of this subscription.
  std::string AwaitMessage(uint32_t subscription) {
    return Next([&](const std::string& bytes, bool is_binary) {
             return is_binary && bytes.size() >= 13 && bytes[0] == 1 &&
                    static_cast<unsigned char>(bytes[1]) == subscription;
           })
        .substr(13);
  }
  std::string AwaitBinary(char op) {
    return Next(
        [&](const std::string& bytes, bool is_binary) { return is_binary && bytes.at(0) == op; });
  }

  // Subscribes and notes the channels.
  void Subscribe(const std::vector<std::string>& topics) {
    std::map<std::string, int64_t> ids;
    const boost::json::object offer = Await("advertise");
    for (const boost::json::value& channel : offer.at("channels").as_array()) {
      ids[std::string(channel.at("topic").as_string())] = channel.at("id").as_int64();
    }
    boost::json::array list;
    for (size_t i = 0; i < topics.size(); ++i) {
      list.push_back(boost::json::object{{"id", i + 1}, {"channelId", ids.at(topics[i])}});
    }
    Send(boost::json::serialize(boost::json::object{{"op", "subscribe"}, {"subscriptions", list}}));
  }

  // Until the server has closed the connection.
  void AwaitEnd() {
    boost::system::error_code error;
    while (!error) {
      boost::beast::flat_buffer buffer;
      socket_.read(buffer, error);
    }
  }

  std::string subprotocol;

 private:
  // The first message that is wanted; others are kept for later.
  std::string Next(const std::function<bool(const std::string&, bool)>& is_wanted) {
    for (size_t i = 0;; ++i) {
      if (i == kept_.size()) {
        boost::beast::flat_buffer buffer;
        socket_.read(buffer);
        kept_.emplace_back(boost::beast::buffers_to_string(buffer.data()), socket_.got_binary());
      }
      if (is_wanted(kept_[i].first, kept_[i].second)) {
        std::string bytes = std::move(kept_[i].first);
        kept_.erase(kept_.begin() + static_cast<ptrdiff_t>(i));
        return bytes;
      }
    }
  }

  std::deque<std::pair<std::string, bool>> kept_;
  boost::beast::websocket::stream<Socket, false> socket_;
};

}  // namespace pheromone::web::testing
