// Recordings replayed over real sockets: who may, what they get, and that nothing can be changed.

#include "server/operators/web/stream/replays.h"

#include <gtest/gtest.h>

#include <bit>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include <boost/asio/ip/tcp.hpp>

#include "server/base/bytes.h"
#include "server/formats/foxglove/pheromone_raster.h"
#include "server/formats/foxglove/testing/tiles_viewer.h"
#include "server/operators/playback/testing/recording.h"
#include "server/operators/web/stream/playback_messages.h"
#include "server/operators/web/stream/testing/client.h"
#include "server/operators/web/testing/fake_control.h"
#include "server/operators/web/testing/listening_server.h"

namespace pheromone::web {
namespace {

namespace asio = boost::asio;
namespace json = boost::json;
using Phase = playback::State::Phase;
using testing::Client;
using testing::Knock;

std::string Ask(bool play, uint64_t seek_ns, const std::string& id) {
  ByteWriter writer;
  writer.U8(kPlaybackRequestOp);
  writer.U8(play ? 0 : 1);
  writer.U32(std::bit_cast<uint32_t>(1.0F));
  writer.Flag(true);
  writer.U64(seek_ns);
  writer.Text(id);
  return writer.Take();
}

class ReplaysTest : public testing::ListeningServer {
 protected:
  void Start(size_t max_replays = 4) {
    control_.status.capture.folder = std::filesystem::path(recording().path).parent_path();
    api_ = std::make_unique<Api>(&control_, ApiOptions{.token = "0123456789abcdef"});
    replays_ =
        std::make_unique<Replays>(&control_, api_.get(), ReplayOptions{.max_replays = max_replays});
    Make([this](Request request, Respond respond) {
      api_->Handle(std::move(request), std::move(respond));
    });
    server_->OnUpgrade(kReplayFolder, replays_->Handler());
    Listen(1);
    thread_ = std::thread([this] { replays_->Run(); });
  }

  void TearDown() override {
    server_->Stop();
    replays_->Stop();
    thread_.join();
    ListeningServer::TearDown();
    replays_.reset();
  }

  std::unique_ptr<Client> Connect(Knock knock = {}, int expected = 101) {
    if (knock.target == "/") {
      knock.target = "/replay/" + name_;
    }
    Client::Socket socket(client_io_);
    socket.connect(asio::ip::tcp::endpoint(asio::ip::address_v4::loopback(), server_->port()));
    auto client = std::make_unique<Client>(std::move(socket));
    EXPECT_EQ(client->Shake(knock), expected);
    return client;
  }

  // The next state that is paused, that is: reached.
  static uint64_t AwaitPaused(Client* client) {
    while (true) {
      const std::string bytes = client->AwaitBinary(kPlaybackStateOp);
      ByteReader reader(std::string_view(bytes).substr(1));
      if (reader.U8() == static_cast<uint8_t>(Phase::kPaused)) {
        return reader.U64();
      }
    }
  }

  static const playback::testing::Recording& recording() {
    static const playback::testing::Recording made(7, 5'000);
    return made;
  }

  const std::string name_ = std::filesystem::path(recording().path).filename();
  testing::FakeControl control_;
  std::unique_ptr<Api> api_;
  std::unique_ptr<Replays> replays_;
  std::thread thread_;
  asio::io_context client_io_;
};

TEST_F(ReplaysTest, ShowsTheMapOfTheMomentThatIsSought) {
  Start();
  playback::Player player = recording().MakePlayer();
  const auto client = Connect({.subprotocol = "foxglove.sdk.v1"});
  const json::object info = client->Await("serverInfo");
  const uint64_t begin_ns = player.range().begin_ns;
  EXPECT_EQ(info.at("dataStartTime").at("sec").to_number<uint64_t>(), begin_ns / 1'000'000'000);
  EXPECT_EQ(client->AwaitBinary(kPlaybackStateOp)[1], static_cast<char>(Phase::kPlaying));
  const std::string type_name = "type 1";
  client->SendBinary(Ask(false, begin_ns + 3'000'000'000, "there"));
  client->Subscribe({"/pheromone_delta/" + type_name, "/clients"});
  EXPECT_EQ(AwaitPaused(client.get()), begin_ns + 3'000'000'000);
  for (const uint64_t after_ms : {3'000u, 4'500u, 1'200u}) {
    const uint64_t time_ns = begin_ns + after_ms * 1'000'000;
    if (after_ms != 3'000) {
      client->SendBinary(Ask(false, time_ns, "again"));
      EXPECT_EQ(AwaitPaused(client.get()), time_ns);
    }
    player.Seek(time_ns);
    while (!player.Arrive(1'000'000)) {
    }
    const control::FieldView view = player.Field(time_ns);
    const field::FieldReader reader(*view.field);
    PheromoneRaster expected(view.config, 1);
    expected.Update(reader, view.now_ms, true);
    testing::TilesViewer picture;
    do {  // from before it was there
      ASSERT_TRUE(picture.Take(client->AwaitMessage(1)));
    } while (picture.field_time_ms != view.now_ms);
    EXPECT_TRUE(picture.full);
    EXPECT_EQ(std::string(picture.bytes.begin(), picture.bytes.end()), expected.bytes());
  }
}

TEST_F(ReplaysTest, ShowsTheObstaclesAgainAfterALeap) {
  Start();
  const uint64_t begin_ns = recording().MakePlayer().range().begin_ns;
  const auto client = Connect({.subprotocol = "foxglove.sdk.v1"});
  client->SendBinary(Ask(false, begin_ns + 1'000'000'000, "there"));
  client->Subscribe({"/obstacles"});
  const std::string before = client->AwaitMessage(1);
  EXPECT_FALSE(before.empty());
  for (const uint64_t after_ms : {3'000u, 2'000u}) {  // forwards and backwards
    client->SendBinary(Ask(false, begin_ns + after_ms * 1'000'000, "leap"));
    EXPECT_FALSE(client->AwaitMessage(1).empty());
  }
}

TEST_F(ReplaysTest, PlaysByItselfForViewersThatKnowNoPlayback) {
  Start();
  const auto client = Connect();
  client->Await("serverInfo");
  uint64_t before_ns = 0;
  for (int i = 0; i < 4; ++i) {  // op 2: the time
    const std::string bytes = client->AwaitBinary(2);
    ByteReader reader(std::string_view(bytes).substr(1));
    const uint64_t time_ns = reader.U64();
    EXPECT_GE(time_ns, before_ns);
    EXPECT_GE(time_ns, recording().moments.begin()->first - 10'000'000'000);
    EXPECT_LE(time_ns, recording().moments.rbegin()->first);
    before_ns = time_ns;
  }
}

TEST_F(ReplaysTest, RefusesOtherNamesAndPagesAndWhatIsTooMuch) {
  Start(1);
  for (const char* target : {"/replay/", "/replay/x.mcap", "/replay/.x.pcapng", "/replay/x",
                             "/replay/..%2Fx.pcapng", "/replay/x.pcapng%00.pcapng"}) {
    Connect({.target = target}, 404);
  }
  Connect({.origin = "https://evil.example"}, 403);
  Connect({.subprotocol = "chat"}, 400);
  const auto first = Connect();
  first->Await("serverInfo");
  Connect({}, 503);
}

TEST_F(ReplaysTest, TellsWhatCannotBeReplayed) {
  Start();
  const auto client = Connect({.target = "/replay/none.pcapng"});
  EXPECT_EQ(client->Await("serverInfo").at("metadata").at("recording"), "none.pcapng");
  const json::object status = client->Await("status");
  EXPECT_EQ(status.at("level"), 2);
  EXPECT_EQ(status.at("message"), "none.pcapng: No such file or directory");
}

TEST_F(ReplaysTest, ChangesNothing) {
  using std::string_literals::operator""s;
  Start();
  const auto client = Connect({.target = "/replay/" + name_ + "?token=0123456789abcdef"});
  client->Await("serverInfo");
  client->SendBinary("\x02\x03\0\0\0\x09\0\0\0\x04\0\0\0json{}"s);
  EXPECT_EQ(client->Await("serviceCallFailure").at("message"),
            "a recording is replayed: nothing can be changed");
}

TEST_F(ReplaysTest, EndsConnectionsWhenItStops) {
  Start();
  const auto client = Connect();
  server_->Stop();
  client->AwaitEnd();
}

}  // namespace
}  // namespace pheromone::web
