// The API over a control interface of tests: requests as plain values, and what they are answered.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>

#include "server/operators/web/api/api.h"
#include "server/operators/web/testing/fake_control.h"

namespace pheromone::web::testing {

constexpr char kToken[] = "0123456789abcdef";

class ApiFixture : public ::testing::Test {
 protected:
  Response Get(const std::string& target) {
    return AnswerOf(&api_, {.method = "GET", .target = target});
  }

  Response Post(const std::string& path, const std::string& body) {
    return AnswerOf(&api_,
                    {.method = "POST", .target = "/api/v1/" + path, .local = true, .body = body});
  }

  static boost::json::value Parsed(const Response& response) {
    EXPECT_EQ(response.content_type, "application/json") << response.body;
    boost::json::error_code error;
    boost::json::value value = boost::json::parse(response.body, error);
    EXPECT_FALSE(error) << response.body;
    return value;
  }

  // The refusal, as "STATUS where: what, expected ...".
  static std::string Refusal(const Response& response) {
    const boost::json::value parsed = Parsed(response);
    if (response.status == 200 || !parsed.as_object().contains("error")) {
      return "none: " + response.body;
    }
    const boost::json::object& error = parsed.as_object().at("error").as_object();
    const auto text = [&](const char* key) { return std::string(error.at(key).as_string()); };
    return std::to_string(response.status) + " " + text("where") + ": " + text("what") +
           ", expected " + text("expected");
  }

  FakeControl control_;
  Api api_{&control_, {kToken, {"lab"}}};
};

}  // namespace pheromone::web::testing
