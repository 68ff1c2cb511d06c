#include "server/operators/web/api/capture_files.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <utility>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>

#include "server/base/testing/temporary_folder.h"
#include "server/operators/web/api/api.h"
#include "server/operators/web/testing/fake_control.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;

class CaptureFilesTest : public ::testing::Test {
 protected:
  CaptureFilesTest() {
    control_.status.capture.folder = folder_ / "captures";
    std::filesystem::create_directory(folder_ / "captures");
    Write("captures/b.pcapng", "0123456789");
  }
  void Write(const std::string& name, const std::string& bytes) {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
  }
  Response Get(const std::string& name, const std::string& range = "",
               const std::string& if_range = "") {
    return testing::AnswerOf(&api_, {.method = "GET",
                                     .target = "/api/v1/captures" + name,
                                     .range = range,
                                     .if_range = if_range});
  }
  static std::string Header(const Response& response, const std::string& name) {
    for (const auto& [key, value] : response.headers) {
      if (key == name) {
        return value;
      }
    }
    return "";
  }
  // In portions of three bytes.
  static std::string Content(const Response& response) {
    std::string all;
    while (response.content != nullptr && all.size() < response.content_bytes) {
      std::string portion;
      response.content->Read(response.content_offset + all.size(),
                             std::min<uint64_t>(3, response.content_bytes - all.size()),
                             [&](Response read) { portion = std::move(read.body); });
      if (portion.empty()) {
        break;
      }
      all += portion;
    }
    return all;
  }

  const TemporaryFolder folder_;
  testing::FakeControl control_;
  Api api_{&control_, {}};
};

TEST_F(CaptureFilesTest, RecordingsAreListedByName) {
  Write("captures/a.mcap", "12");
  Write("captures/notes.txt", "12");
  Write("captures/.hidden.pcapng", "12");
  std::filesystem::create_directory(folder_ / "captures/folder.pcapng");
  std::filesystem::create_symlink("b.pcapng", folder_ / "captures/link.pcapng");
  control_.status.capture.recording = true;
  control_.status.capture.file = folder_ / "captures/b.pcapng";
  const json::value list = json::parse(Get("").body);
  const json::array& captures = list.at("captures").as_array();
  ASSERT_EQ(captures.size(), 2u) << list;
  EXPECT_EQ(captures[0].at("name"), "a.mcap");
  EXPECT_EQ(captures[0].at("bytes").to_number<int>(), 2);
  EXPECT_EQ(captures[0].at("recording"), false);
  EXPECT_EQ(captures[1].at("name"), "b.pcapng");
  EXPECT_EQ(captures[1].at("recording"), true);
}

TEST_F(CaptureFilesTest, WithoutAFolderThereAreNone) {
  control_.status.capture.folder = folder_ / "none";
  EXPECT_EQ(json::parse(Get("").body), json::parse(R"({"captures":[]})"));
}

TEST_F(CaptureFilesTest, AWholeRecording) {
  const Response answer = Get("/b.pcapng");
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(Header(answer, "Accept-Ranges"), "bytes");
  EXPECT_EQ(answer.content_bytes, 10u);
  EXPECT_EQ(Content(answer), "0123456789");
}

TEST_F(CaptureFilesTest, APartOfIt) {
  const Response answer = Get("/b.pcapng", "bytes=2-5");
  EXPECT_EQ(answer.status, 206);
  EXPECT_EQ(Header(answer, "Content-Range"), "bytes 2-5/10");
  EXPECT_EQ(Content(answer), "2345");
}

TEST_F(CaptureFilesTest, APartOfAnotherVersionIsRefusedByGivingTheWhole) {
  const std::string tag = Header(Get("/b.pcapng"), "ETag");
  EXPECT_EQ(Get("/b.pcapng", "bytes=2-5", tag).status, 206);
  Write("captures/b.pcapng", "0123456789more");
  const Response answer = Get("/b.pcapng", "bytes=2-5", tag);
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(Content(answer), "0123456789more");
}

TEST_F(CaptureFilesTest, ARangeBeyondTheEndIsRefused) {
  const Response answer = Get("/b.pcapng", "bytes=10-");
  EXPECT_EQ(answer.status, 416);
  EXPECT_EQ(Header(answer, "Content-Range"), "bytes */10");
}

TEST_F(CaptureFilesTest, NothingOutsideTheFolderIsSent) {
  Write("secret.pcapng", "secret");
  std::filesystem::create_symlink(folder_ / "secret.pcapng", folder_ / "captures/link.pcapng");
  std::filesystem::create_directory(folder_ / "captures/folder.pcapng");
  for (const char* name :
       {"/", "/../secret.pcapng", "/%2e%2e%2fsecret.pcapng", "/..%2Fsecret.pcapng",
        "//etc/passwd.pcapng", "/link.pcapng", "/folder.pcapng", "/none.pcapng", "/b.pcapng%00",
        "/b.pcapng/", "/x%00/../b.pcapng", "/.pcapng"}) {
    EXPECT_EQ(Get(name).status, 404) << name;
  }
}

TEST_F(CaptureFilesTest, AFileThatBecomesShorterEndsEarly) {
  const Response answer = Get("/b.pcapng");
  std::filesystem::resize_file(folder_ / "captures/b.pcapng", 4);
  EXPECT_EQ(Content(answer), "0123");
}

}  // namespace
}  // namespace pheromone::web
