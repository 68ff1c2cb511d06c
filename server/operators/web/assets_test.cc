// The dashboard's files, and what keeps a client from getting others.

#include "server/operators/web/assets.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <tuple>

#include "server/operators/web/embedded.h"
#include "server/operators/web/testing/fake_control.h"

namespace pheromone::web {
namespace {

namespace fs = std::filesystem;

std::string HeaderOf(const Response& response, const std::string& name) {
  for (const auto& [key, value] : response.headers) {
    if (key == name) {
      return value;
    }
  }
  return "";
}

// A GET with these headers.
Request With(const std::string& accept_encoding, const std::string& if_none_match = "") {
  Request request{.method = "GET", .target = "/"};
  request.accept_encoding = accept_encoding;
  request.if_none_match = if_none_match;
  return request;
}

std::string ReadSource(const std::string& file) {
  std::ifstream in(fs::path(PHEROMONE_SOURCE_DIR) / "server/operators/web/dashboard" / file,
                   std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

std::string Unzipped(const std::string& gzip) {
  const fs::path path = fs::path(::testing::TempDir()) / "assets_test.gz";
  std::ofstream(path, std::ios::binary) << gzip;
  gzFile file = gzopen(path.c_str(), "rb");
  std::string text(size_t{1} << 20, '\0');
  text.resize(static_cast<size_t>(std::max(0, gzread(file, text.data(), 1 << 20))));
  gzclose(file);
  fs::remove(path);
  return text;
}

TEST(AssetsTest, EveryFileOfTheSourceTreeIsThereCompressedAndNot) {
  const Assets assets;
  ASSERT_GT(EmbeddedFiles().size(), 20u);
  for (const EmbeddedFile& file : EmbeddedFiles()) {
    const std::string name(file.name);
    const std::string source = ReadSource(name);
    ASSERT_FALSE(source.empty()) << name;
    EXPECT_EQ(assets.Get(name, With("")).body, source) << name;
    const Response zipped = assets.Get(name, With("gzip, deflate, br"));
    EXPECT_EQ(HeaderOf(zipped, "Content-Encoding"), "gzip");
    EXPECT_EQ(Unzipped(zipped.body), source) << name;
  }
}

TEST(AssetsTest, ThePageNamesOnlyFilesThatAreThereAndRunsNothingInline) {
  const std::string page = ReadSource("index.html");
  const Assets assets;
  for (const char* attribute : {"src=\"", "href=\""}) {
    for (size_t at = page.find(attribute); at != std::string::npos;
         at = page.find(attribute, at + 1)) {
      const size_t begin = at + std::string(attribute).size();
      const std::string path = page.substr(begin, page.find('"', begin) - begin);
      ASSERT_TRUE(Assets::FileOf(path)) << path;
      EXPECT_EQ(assets.Get(*Assets::FileOf(path), With("")).status, 200) << path;
    }
  }
  for (const char* inlined : {" style=", "<style", " onclick=", "<script>"}) {
    EXPECT_EQ(page.find(inlined), std::string::npos) << inlined;
  }
}

TEST(AssetsTest, HeadersLetThePageReachNothingButTheServer) {
  const Response page = Assets().Get("index.html", With(""));
  EXPECT_EQ(page.content_type, "text/html; charset=utf-8");
  EXPECT_EQ(HeaderOf(page, "Content-Security-Policy"),
            "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
            "connect-src 'self'; worker-src 'self'; base-uri 'none'; form-action 'none'; "
            "frame-ancestors 'none'");
  EXPECT_EQ(HeaderOf(page, "X-Frame-Options"), "DENY");
  EXPECT_EQ(HeaderOf(page, "Referrer-Policy"), "no-referrer");
  EXPECT_EQ(HeaderOf(page, "Vary"), "Accept-Encoding");
  EXPECT_EQ(Assets().Get("main.js", With("")).content_type, "text/javascript; charset=utf-8");
  EXPECT_EQ(Assets().Get("theme.css", With("")).content_type, "text/css; charset=utf-8");
}

TEST(AssetsTest, AFileThatTheBrowserHasIsNotSentAgain) {
  const Assets assets;
  const std::string etag = HeaderOf(assets.Get("main.js", With("gzip")), "ETag");
  ASSERT_GT(etag.size(), 10u);
  for (const std::string& list : {etag, "W/" + etag, "\"a\", " + etag, std::string("*")}) {
    const Response again = assets.Get("main.js", With("gzip", list));
    EXPECT_EQ(again.status, 304) << list;
    EXPECT_EQ(again.body, "");
    EXPECT_EQ(HeaderOf(again, "ETag"), etag);
  }
  EXPECT_EQ(assets.Get("main.js", With("gzip", "\"a\"")).status, 200);
  EXPECT_EQ(assets.Get("main.js", With("", etag)).status, 200) << "of the other encoding";
}

TEST(AssetsTest, GzipIsTakenOnlyByThoseWhoSaySo) {
  for (const char* takes : {"gzip", "br, gzip;q=0.5", "gzip ;q=1.0", "deflate,gzip"}) {
    EXPECT_TRUE(TakesGzip(takes)) << takes;
  }
  for (const char* refuses :
       {"", "identity", "br", "gzip;q=0", "gzip; q=0.000", "x-gzip", "gzipped"}) {
    EXPECT_FALSE(TakesGzip(refuses)) << refuses;
  }
}

TEST(AssetsTest, ThroughTheApiThePageIsAtTheRoot) {
  testing::FakeControl control;
  Api api(&control, {"0123456789abcdef", {}});
  const Request get{.method = "GET", .target = "/", .host = "localhost"};
  EXPECT_NE(testing::AnswerOf(&api, get).body.find("<title>Pheromone</title>"), std::string::npos);
  for (const auto& [method, target, host, status] :
       std::vector<std::tuple<const char*, const char*, const char*, int>>{
           {"HEAD", "/", "localhost", 200},
           {"GET", "/dashboard/panels/robots.js?v=1", "127.0.0.1:8377", 200},
           {"GET", "/dashboard/vendor/uPlot.iife.min.js", "localhost", 200},
           {"POST", "/", "localhost", 405},
           {"GET", "/", "evil.example", 421},
           {"GET", "/dashboard/", "localhost", 404},
           {"GET", "/dashboard/none.js", "localhost", 404},
           {"GET", "/dashboard/..%2fapi.cc", "localhost", 404}}) {
    EXPECT_EQ(testing::AnswerOf(&api, {.method = method, .target = target, .host = host}).status,
              status)
        << method << ' ' << target << ' ' << host;
  }
}

class WebRootTest : public ::testing::Test {
 protected:
  WebRootTest() {
    fs::create_directories(root_ / "panels");
    Write(root_ / "index.html", "<p>edited");
    Write(root_ / "panels/a.js", "1");
    Write(root_ / ".hidden", "confidential");
    Write(above_ / "secret", "confidential");
    fs::create_symlink(above_ / "secret", root_ / "link.js");
    fs::create_directory_symlink(above_, root_ / "up");
  }
  void TearDown() override { fs::remove_all(above_); }

  static void Write(const fs::path& path, const std::string& text) { std::ofstream(path) << text; }

  const fs::path above_ =
      fs::path(::testing::TempDir()) /
      ("web_root_" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) + "_" +
       ::testing::UnitTest::GetInstance()->current_test_info()->name());
  const fs::path root_ = above_ / "root";
};

TEST_F(WebRootTest, FilesAreReadAnewEachTime) {
  const Assets assets(root_.string());
  EXPECT_TRUE(assets.reads_disk());
  EXPECT_EQ(assets.Get("index.html", With("gzip")).body, "<p>edited");
  EXPECT_EQ(assets.Get("panels/a.js", With("")).body, "1");
  const std::string before = HeaderOf(assets.Get("panels/a.js", With("")), "ETag");
  Write(root_ / "panels/a.js", "2");
  EXPECT_EQ(assets.Get("panels/a.js", With("", before)).body, "2");
}

TEST_F(WebRootTest, NothingOutsideTheFolderIsReached) {
  const Assets assets(root_.string());
  for (const char* path :
       {"../secret", "panels/../../secret", "link.js", "up/secret", ".hidden", "/etc/passwd",
        "panels", "panels/", "", ".", "..", "panels//a.js", "a\\b", "none.js", "a/b/c/d/e"}) {
    const Response response = assets.Get(path, With(""));
    EXPECT_EQ(response.status, 404) << path;
    EXPECT_EQ(response.body.find("confidential"), std::string::npos) << path;
  }
  EXPECT_EQ(assets.Get(std::string("index.html\0", 11), With("")).status, 404);
  EXPECT_EQ(Assets((above_ / "none").string()).Get("index.html", With("")).status, 404);
}

}  // namespace
}  // namespace pheromone::web
