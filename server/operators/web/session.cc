#include "server/operators/web/session.h"

#include <algorithm>

#include <boost/asio/buffer.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/websocket/rfc6455.hpp>

namespace pheromone::web {
namespace {

namespace asio = boost::asio;
namespace http = boost::beast::http;

using Parser = http::request_parser<http::string_body>;

constexpr std::chrono::milliseconds kLinger{2'000};
constexpr std::chrono::milliseconds kHurry{200};  // when the place is needed

std::string HeaderOf(const Message& message, http::field name) {
  const auto value = message[name];
  return {value.data(), value.size()};
}

auto Into(boost::beast::error_code* error) {
  return asio::redirect_error(asio::use_awaitable, *error);
}

}  // namespace

int StatusOf(const boost::beast::error_code& error) {
  if (error == http::error::body_limit || error == http::error::buffer_overflow) {
    return 413;
  }
  if (error == http::error::header_limit) {
    return 431;
  }
  const bool hung_up = error == http::error::end_of_stream || error == http::error::partial_message;
  return !hung_up && error.category() == http::make_error_code(http::error::bad_version).category()
             ? 400
             : 0;
}

std::optional<Problem> ProblemOf(const Message& message) {
  for (const http::field name :
       {http::field::host, http::field::authorization, http::field::origin}) {
    if (message.count(name) > 1) {
      const auto text = http::to_string(name);
      return Problem{"found twice", {text.data(), text.size()}, "the header once"};
    }
  }
  return std::nullopt;
}

std::optional<Response> CheckHandshake(const Message& message) {
  if (HeaderOf(message, http::field::sec_websocket_version) != "13") {
    Response refused = Refuse(
        426, {"found no version of WebSocket, or another one", "Sec-WebSocket-Version", "13"});
    refused.headers.emplace_back("Sec-WebSocket-Version", "13");
    return refused;
  }
  const std::string key = HeaderOf(message, http::field::sec_websocket_key);
  const auto is_base64 = [](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '+' ||
           c == '/';
  };
  const bool is_key =
      key.size() == 24 && key.ends_with("==") && std::all_of(key.begin(), key.end() - 2, is_base64);
  return is_key ? std::nullopt
                : std::optional(Refuse(400, {"found " + (key.empty() ? "none" : key.substr(0, 40)),
                                             "Sec-WebSocket-Key", "16 bytes in base64"}));
}

Request ToRequest(const Message& message, const SessionTraits& traits) {
  const auto method = message.method_string();
  const auto target = message.target();
  return {.method = {method.data(), method.size()},
          .target = {target.data(), target.size()},
          .local = traits.local,
          .encrypted = traits.encrypted,
          .authorization = HeaderOf(message, http::field::authorization),
          .origin = HeaderOf(message, http::field::origin),
          .host = HeaderOf(message, http::field::host),
          .fetch_site = HeaderOf(message, http::field::sec_fetch_site),
          .fetch_dest = HeaderOf(message, http::field::sec_fetch_dest),
          .subprotocols = HeaderOf(message, http::field::sec_websocket_protocol),
          .accept_encoding = HeaderOf(message, http::field::accept_encoding),
          .if_none_match = HeaderOf(message, http::field::if_none_match),
          .range = HeaderOf(message, http::field::range),
          .if_range = HeaderOf(message, http::field::if_range),
          .body = message.body(),
          .client = traits.client};
}

Answer ToAnswer(Response response, unsigned version, bool keep_alive) {
  Answer answer(static_cast<http::status>(response.status), version);
  answer.set(http::field::server, "pheromoned");
  answer.set(http::field::content_type, response.content_type);
  answer.set(http::field::cache_control, "no-store");
  answer.set("X-Content-Type-Options", "nosniff");
  for (const auto& [name, value] : response.headers) {
    answer.set(name, value);
  }
  answer.body() = std::move(response.body);
  answer.keep_alive(keep_alive);
  if (response.content != nullptr) {
    answer.content_length(response.content_bytes);
  } else {
    answer.prepare_payload();
  }
  return answer;
}

asio::awaitable<void> Session::Run() {
  const auto self = shared_from_this();
  while (!closing_ && co_await ServeOne()) {
    EndRequest();
  }
  end_timer_.cancel();
  if (place_ == nullptr) {
    co_await HangUp();
  }
}

// Whether another request may follow.
asio::awaitable<bool> Session::ServeOne() {
  boost::beast::error_code error;
  Parser parser;
  parser.header_limit(static_cast<uint32_t>(kMaxHeaderBytes));
  parser.body_limit(kMaxBodyBytes);
  connection_.SetPatience(traits_.patience);
  if (buffer_.size() == 0) {
    buffer_.commit(
        co_await connection_.async_read_some(buffer_.prepare(kMaxHeaderBytes), Into(&error)));
  }
  Touch();
  if (!error && !closing_) {
    co_await http::async_read_header(connection_, buffer_, parser, Into(&error));
  }
  if (!error && parser.get()[http::field::expect] == "100-continue" && !closing_) {
    http::response<http::empty_body> go_on(http::status::continue_, parser.get().version());
    co_await http::async_write(connection_, go_on, Into(&error));
  }
  if (!error && !closing_) {
    co_await http::async_read(connection_, buffer_, parser, Into(&error));
  }
  if (closing_) {
    co_return false;
  }
  if (error) {
    if (const int status = StatusOf(error); status != 0) {
      Answer answer = ToAnswer(Refuse(status, {error.message(), "request",
                                               "HTTP/1.1, a header of at most 8 KiB and a body "
                                               "of at most 1 MiB"}),
                               11, false);
      co_await Write(&answer, false);
    }
    co_return false;
  }
  if (!BeginRequest()) {
    co_return false;
  }
  const Message& message = parser.get();
  if (const auto problem = ProblemOf(message)) {
    Answer answer = ToAnswer(Refuse(400, *problem), message.version(), false);
    co_await Write(&answer, message.method() == http::verb::head);
    co_return false;
  }
  Request request = ToRequest(message, traits_);
  const UpgradeHandler* const upgrade = FindUpgrade(message);
  std::optional<Response> refused;
  if (upgrade != nullptr) {
    refused = upgrade->check(request);
    refused = refused ? std::move(refused) : CheckHandshake(message);
  }
  if (upgrade != nullptr && !refused) {
    HandOn(*upgrade, parser.release());
    co_return false;
  }
  const bool keep_alive = message.keep_alive() && !traits_.once;
  Response response;  // g++ 12 destroys too much of a "?:" that co_awaits
  if (refused) {
    response = *std::move(refused);
  } else {
    std::function<void(Respond)> ask = [this, &request](Respond respond) {
      handle_(std::move(request), std::move(respond));
    };
    is_answering_ = true;
    is_asking_ = true;
    response = co_await Ask(std::move(ask));
    is_asking_ = false;
    if (closing_) {
      BeginEnd();
    }
  }
  ShareLongBody(&response);
  std::shared_ptr<void> permit;
  if (response.content != nullptr) {
    permit = traits_.long_answers->Enter(traits_.client, response.content);
    if (permit == nullptr) {
      response = Refuse(503, {"the server is sending as many long answers as it may", "",
                              "fewer at a time, or parts of them; try again in a moment"});
    }
  }
  const std::shared_ptr<Content> content = response.content;
  const uint64_t offset = response.content_offset;
  const uint64_t bytes = response.content_bytes;
  const bool is_head = message.method() == http::verb::head;
  Answer answer = ToAnswer(std::move(response), message.version(), keep_alive);
  bool written = co_await Write(&answer, is_head || content != nullptr);
  if (written && content != nullptr && !is_head) {
    written = co_await WriteContent(content, offset, bytes);
  }
  is_answering_ = false;
  co_return written&& keep_alive && !closing_;
}

const UpgradeHandler* Session::FindUpgrade(const Message& message) const {
  if (upgrades_ == nullptr || !boost::beast::websocket::is_upgrade(message)) {
    return nullptr;
  }
  const auto text = message.target();
  const auto target = ParseTarget({text.data(), text.size()});
  if (!target) {
    return nullptr;
  }
  const std::string& path = target->path;
  auto found = upgrades_->find(path);
  if (found == upgrades_->end()) {  // or what is in a folder
    found = upgrades_->find(path.substr(0, path.rfind('/') + 1));
    found = found != upgrades_->end() && found->first != "/" ? found : upgrades_->end();
  }
  return found != upgrades_->end() ? &found->second : nullptr;
}

// To others it appears to be processing a request, so it is not closed to make room.
void Session::HandOn(const UpgradeHandler& to, Message message) {
  std::string rest = boost::beast::buffers_to_string(buffer_.data());
  buffer_.clear();
  buffer_.shrink_to_fit();
  connection_.SetPatience(std::nullopt);
  place_ = std::make_shared<PlaceState>();
  Place place(place_);
  to.take({std::move(connection_), std::move(message), traits_.local, std::move(rest),
           std::move(place), traits_.client});
}

asio::awaitable<Response> Session::Ask(std::function<void(Respond)> ask) {
  PendingResponse pending(connection_.get_executor(), [this] { answer_timer_.cancel(); });
  ask(pending.MakeRespond());
  std::optional<Response> response = pending.Take();
  if (!response) {
    boost::beast::error_code error;
    answer_timer_.expires_after(traits_.patience);
    co_await answer_timer_.async_wait(Into(&error));
    response = pending.Take();
  }
  if (!response) {
    response = Refuse(504, {"no answer yet; the request may still take effect", "",
                            "check the status in a moment"});
  }
  co_return std::move(*response);
}

asio::awaitable<bool> Session::Write(Answer* answer, bool header_alone) {
  boost::beast::error_code error;
  connection_.SetPatience(traits_.patience);
  http::response_serializer<http::string_body> serializer(*answer);
  if (header_alone) {
    co_await http::async_write_header(connection_, serializer, Into(&error));
  } else {
    co_await http::async_write(connection_, serializer, Into(&error));
  }
  co_return !error;
}

// If it ends too early, the client notices by the length.
asio::awaitable<bool> Session::WriteContent(std::shared_ptr<Content> content, uint64_t offset,
                                            uint64_t bytes) {
  for (const uint64_t end = offset + bytes; offset < end;) {
    std::function<void(Respond)> ask = [content, offset, end](Respond respond) {
      content->Read(offset, std::min(kPortionBytes, end - offset), std::move(respond));
    };
    const Response portion = co_await Ask(std::move(ask));
    // What the handler made is still sent when the server stops; a file may be of any length.
    const bool ends = closing_ && content->bytes_in_memory() == 0;
    if (portion.status != 200 || portion.body.empty() || ends) {
      co_return false;
    }
    boost::beast::error_code error;
    connection_.SetPatience(traits_.patience);
    co_await asio::async_write(connection_, asio::buffer(portion.body), Into(&error));
    if (error) {
      co_return false;
    }
    offset += portion.body.size();
  }
  co_return true;
}

// The server stops while an answer is sent: its client has a short while to take it.
void Session::BeginEnd() {
  end_timer_.expires_after(std::min<std::chrono::milliseconds>(traits_.patience, kLinger));
  end_timer_.async_wait([self = shared_from_this()](const boost::beast::error_code& stopped) {
    if (!stopped) {
      self->connection_.Cancel();
    }
  });
}

// What the client still sends is read for a while, unless the place is needed.
asio::awaitable<void> Session::HangUp() {
  EndRequest();
  const auto patience = closing_ ? kHurry : kLinger;
  co_await connection_.End(std::min<std::chrono::milliseconds>(traits_.patience, patience),
                           !closing_);
}

}  // namespace pheromone::web
