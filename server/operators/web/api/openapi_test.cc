// The description of the API and its routes name the same resources and methods. (That answers are
// as described, is tried with a running server: openapi_walk_test.py.)

#include "server/operators/web/api/openapi.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>

#include "server/operators/web/api/api.h"
#include "server/operators/web/testing/fake_control.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;

TEST(OpenApi, DescribesExactlyTheResourcesThatThereAre) {
  std::set<std::string> described;
  const json::value document = json::parse(OpenApiText());
  for (const auto& [path, item] : document.at("paths").as_object()) {
    std::string text(path);
    if (text.ends_with("{name}")) {
      text.resize(text.size() - std::string("{name}").size());
    }
    for (const auto& [method, operation] : item.as_object()) {
      described.insert(std::string(method) + ' ' + text);
    }
  }
  std::set<std::string> present;
  for (const Resource& resource : Resources()) {
    if (resource.can_get) {
      present.insert("get " + std::string(resource.path));
    }
    if (resource.can_post) {
      present.insert("post " + std::string(resource.path));
    }
  }
  EXPECT_EQ(described, present);
}

TEST(OpenApi, IsServed) {
  testing::FakeControl control;
  Api api(&control, {});
  const Response answer =
      testing::AnswerOf(&api, {.method = "GET", .target = "/api/v1/openapi.json"});
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.body, OpenApiText());
}

}  // namespace
}  // namespace pheromone::web
