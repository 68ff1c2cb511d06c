// What HTTP clients send: any bytes, as one connection; a few requests of it are read by the
// server's parser, with its limits, and answered by the API over a control interface of tests. Bit
// 0 of the first byte: over the Unix socket. Each request is answered once, with a status of the
// interface; errors are told as such; headers are one line each; and without the right to it,
// nothing is changed.
#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>

#include <boost/beast/http.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>

#include "proto_tests/fuzz/require.h"
#include "server/operators/web/api/api.h"
#include "server/operators/web/server.h"
#include "server/operators/web/session.h"
#include "server/operators/web/testing/fake_control.h"

namespace {

using pheromone::fuzz::Require;
using namespace pheromone::web;  // NOLINT(google-build-using-namespace)
namespace http = boost::beast::http;

constexpr char kToken[] = "0123456789abcdef";
constexpr int kMaxRequests = 4;

struct Bench {
  Bench() { control.status.capture.folder = PHEROMONE_SOURCE_DIR "/proto_tests/replay"; }

  bool has_changed() const {
    return !control.edits.empty() || !control.commands.empty() || !control.goals.empty() ||
           !control.tag_changes.empty() || !control.net_changes.empty() ||
           control.status.capture.recording;
  }
  void Forget() {
    control.edits.clear();
    control.commands.clear();
    control.goals.clear();
    control.tag_changes.clear();
    control.net_changes.clear();
    control.status.capture.recording = false;
  }

  pheromone::web::testing::FakeControl control;
  Api api{&control, {.token = kToken, .hosts = {"lab.local"}}};
};

void CheckError(const Response& response) {
  boost::system::error_code failed;
  const boost::json::value body = boost::json::parse(response.body, failed);
  Require(!failed && body.is_object() && body.as_object().contains("error"));
  const boost::json::object& error = body.at("error").as_object();
  Require(error.size() == 3 && !error.at("what").as_string().empty());
}

void CheckAnswer(const Response& response) {
  static const std::set<int> statuses = {200, 206, 400, 401, 403, 404, 405,
                                         409, 416, 421, 500, 501, 503};
  Require(statuses.count(response.status) == 1);
  if (response.status >= 400) {
    CheckError(response);
  }
  for (const auto& [name, value] : response.headers) {
    Require(value.find_first_of("\r\n") == std::string::npos);
  }
  if (response.content != nullptr) {
    std::string portion;
    response.content->Read(response.content_offset, 100,
                           [&](Response read) { portion = std::move(read.body); });
    Require(portion.size() == 100 || portion.size() >= response.content_bytes);
  }
  (void)ToAnswer(response, 11, true);
}

void Serve(Bench* bench, const Request& request) {
  int answers = 0;
  bench->api.Handle(request, [&](const Response& response) {
    ++answers;
    CheckAnswer(response);
  });
  Require(answers == 1);
  const bool may_change = request.local || request.authorization == std::string("Bearer ") + kToken;
  Require((may_change && request.method == "POST") || !bench->has_changed());
  (void)IsUrgent(request);
  (void)bench->api.CheckStream(request);
  bench->Forget();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static Bench bench;
  if (size == 0) {
    return 0;
  }
  SessionTraits traits;
  traits.local = (data[0] & 1) != 0;
  traits.encrypted = (data[0] & 2) != 0;
  std::string_view input(reinterpret_cast<const char*>(data) + 1, size - 1);
  for (int i = 0; i < kMaxRequests && !input.empty(); ++i) {
    http::request_parser<http::string_body> parser;
    parser.header_limit(static_cast<uint32_t>(kMaxHeaderBytes));
    parser.body_limit(kMaxBodyBytes);
    parser.eager(true);
    boost::beast::error_code error;
    const size_t taken = parser.put(boost::asio::buffer(input.data(), input.size()), error);
    input.remove_prefix(taken);
    if (error == http::error::need_more) {
      return 0;  // the rest does not come
    }
    if (error || !parser.is_done()) {
      const int status = error ? StatusOf(error) : 0;
      Require(status == 0 || status == 400 || status == 413 || status == 431);
      return 0;
    }
    if (!ProblemOf(parser.get())) {
      Serve(&bench, ToRequest(parser.get(), traits));
    }
  }
  return 0;
}
