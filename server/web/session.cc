#include "server/web/session.h"

namespace pheromone::web {
namespace {

namespace http = boost::beast::http;

std::string HeaderOf(const Message& message, http::field name) {
  const auto value = message[name];
  return {value.data(), value.size()};
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
      return Problem{"found it twice", {text.data(), text.size()}, "the header once"};
    }
  }
  return std::nullopt;
}

Request ToRequest(const Message& message, bool local) {
  const auto method = message.method_string();
  const auto target = message.target();
  return {.method = {method.data(), method.size()},
          .target = {target.data(), target.size()},
          .local = local,
          .authorization = HeaderOf(message, http::field::authorization),
          .origin = HeaderOf(message, http::field::origin),
          .host = HeaderOf(message, http::field::host),
          .body = message.body()};
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
  answer.prepare_payload();
  return answer;
}

}  // namespace pheromone::web
