#include "client_fw/ros2/server_thread.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <utility>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/serialize.hpp>

#include "client_fw/boards/host/real_time.h"
#include "client_fw/ros2/diagnostics.h"
#include "client_fw/ros2/state_style.h"
#include "client_fw/ros2/text.h"
#include "server/base/percent.h"
#include "server/base/say_line.h"
#include "server/operators/ctl/json_read.h"

namespace pheromone::ros2 {
namespace {

namespace json = boost::json;

constexpr std::chrono::seconds kPatience{5};
constexpr int64_t kTurnMs = 200;
constexpr int64_t kDiagnosticMs = 1000;
constexpr int64_t kLawMs = 5000;  // what the map has is asked again
constexpr size_t kMaxOrders = 100;
constexpr char kHalt[] = "halt";
constexpr uint32_t kMaxPathPoints = 1024;

std::string NameOf(const json::value& client) {
  return ctl::TextAt(client, "link") + "/" + std::to_string(ctl::CountAt(client, "id"));
}

}  // namespace

ServerThread::ServerThread(Node* node, const BridgeOptions& options, const RobotReports* reports)
    : node_(node),
      options_(options),
      reports_(reports),
      start_ns_(MonotonicNs()),
      turns_(kTurnMs),
      laws_due_(kLawMs),
      diagnostics_due_(kDiagnosticMs),
      scene_(options.map_frame) {
  diagnostics_ = node_->Advertise<DiagnosticArray>("/diagnostics", Quality::kOrders);
  if (!options_.socket.empty()) {
    markers_ = node_->Advertise<MarkerArray>("/pheromone/markers", Quality::kOrders);
    AddLayer("");
  }
  // Who finds map -> odometry in /tf must not be contradicted.
  if (!options_.link.empty() && options_.localisation == Localisation::kStart) {
    frames_ = node_->Advertise<TFMessage>("/tf", Quality::kOrders);
  }
  thread_ = std::thread([this] { Run(); });
}

ServerThread::~ServerThread() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void ServerThread::Send(const std::string& name, const std::string& target,
                        const std::string& body) {
  const std::lock_guard lock(mutex_);
  Order order{name, target, body};
  if (name == kHalt) {
    if (orders_.empty() || orders_.front().name != kHalt) {
      orders_.push_front(std::move(order));
    }
  } else if (orders_.size() < kMaxOrders) {
    orders_.push_back(std::move(order));
  } else {
    SayLine(NowMs(), fmt::format("{}: dropped, {} orders wait for the server", name, kMaxOrders));
  }
  wake_.notify_all();
}

bool ServerThread::IsEnding() {
  const std::lock_guard lock(mutex_);
  return ending_;
}

// True when it is time to end.
bool ServerThread::Wait(int64_t ms) {
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, std::chrono::milliseconds(ms),
                 [this] { return ending_ || !orders_.empty(); });
  return ending_;
}

int64_t ServerThread::NowMs() const {
  return (MonotonicNs() - start_ns_) / 1'000'000;
}

void ServerThread::Run() {
  int64_t rest_ms = 0;
  for (;;) {
    const bool ending = Wait(std::max<int64_t>(0, std::max(turns_.next_ms(), rest_ms) - NowMs()));
    SendOrders();
    if (ending) {
      return;
    }
    const int64_t begin_ms = NowMs();
    if (begin_ms < rest_ms || !turns_.Claim(begin_ms)) {
      continue;
    }
    Turn(begin_ms);
    rest_ms = begin_ms + 4 * (NowMs() - begin_ms);
  }
}

void ServerThread::SendOrders() {
  for (;;) {
    Order order;
    {
      const std::lock_guard lock(mutex_);
      if (ending_ && !orders_.empty() && orders_.front().name != kHalt) {
        SayLine(NowMs(), fmt::format("dropped at the end: {} orders to the server, the first is {}",
                                     orders_.size(), orders_.front().name));
        orders_.clear();
      }
      if (orders_.empty()) {
        return;
      }
      order = std::move(orders_.front());
      orders_.pop_front();
    }
    const ctl::Reply reply = ctl::Ask({.socket = options_.socket, .patience = kPatience}, "POST",
                                      order.target, order.body);
    SayLine(NowMs(), order.name + ": " + (reply.exit_status == 0 ? "done" : reply.error));
  }
}

std::optional<ctl::Reply> ServerThread::Get(const std::string& target) {
  SendOrders();
  if (is_unreachable_ || IsEnding()) {
    return std::nullopt;
  }
  ctl::Reply reply = ctl::Ask({.socket = options_.socket, .patience = kPatience}, "GET", target);
  if (reply.exit_status == 0) {
    return reply;
  }
  // What one request is refused for, others are not: pheromones come and go.
  is_unreachable_ = reply.exit_status == ctl::kNoServer;
  trouble_ = reply.error;
  return std::nullopt;
}

std::optional<json::value> ServerThread::Parse(const std::string& text) {
  Result<json::value> value = ctl::ParseAnswer(text);
  if (!value.ok()) {
    trouble_ = value.error();
    return std::nullopt;
  }
  return std::move(value).value();
}

std::optional<json::value> ServerThread::Ask(const std::string& target) {
  const std::optional<ctl::Reply> reply = Get(target);
  return reply ? Parse(reply->body) : std::nullopt;
}

void ServerThread::AddLayer(const std::string& pheromone) {
  const auto [found, is_new] = layers_.try_emplace(pheromone);
  if (!is_new) {
    return;
  }
  const std::string topic = pheromone.empty() ? std::string(ros::kObstaclesTopic)
                                              : "/pheromone/" + names_.PartOf(pheromone);
  Layer& layer = found->second;
  layer.publisher = node_->Advertise<OccupancyGrid>(topic, Quality::kLatched);
  if (!pheromone.empty() && options_.allowed.deposit) {
    layer.deposit = node_->Subscribe<PointStamped>(topic + "/deposit", Quality::kMany);
  }
  if (!pheromone.empty() && options_.allowed.paint) {
    layer.paint = node_->Subscribe<Path>(topic + "/paint", Quality::kMany);
  }
}

void ServerThread::DropLayers(const std::vector<std::string>& pheromones) {
  std::erase_if(layers_, [&](const auto& it) {
    const auto& [pheromone, layer] = it;
    if (pheromone.empty() ||
        std::find(pheromones.begin(), pheromones.end(), pheromone) != pheromones.end()) {
      return false;
    }
    names_.Forget(pheromone);
    node_->Withdraw(layer.publisher);
    node_->Withdraw(layer.deposit);
    node_->Withdraw(layer.paint);
    return true;
  });
}

void ServerThread::FindLayers() {
  const std::optional<json::value> laws = Ask("/api/v1/laws");
  if (!laws) {
    return;
  }
  scene_.SetLaws(*laws);
  std::vector<std::string> pheromones;
  for (const json::value& law : ctl::ItemsAt(*laws, "pheromones")) {
    if (ctl::At(law, "blend").is_null()) {  // a blend has no content
      pheromones.push_back(ctl::TextAt(law, "name"));
    }
  }
  DropLayers(pheromones);  // first: another one may get its topic
  for (const std::string& pheromone : pheromones) {
    AddLayer(pheromone);
  }
  if (const std::optional<json::value> tags = Ask("/api/v1/tags")) {
    scene_.SetTags(*tags);
  }
}

void ServerThread::PublishLayer(const std::string& pheromone, Layer* layer) {
  const std::optional<ctl::Reply> reply =
      Get(pheromone.empty() ? "/api/v1/obstacles?format=npy"
                            : "/api/v1/field?format=npy&pheromone=" + PercentEncode(pheromone));
  const std::optional<json::value> facts = reply ? Parse(reply->raster) : std::nullopt;
  if (!facts) {
    return;
  }
  Result<Grid> grid = ReadGrid(*facts, reply->body);
  if (!grid.ok()) {
    trouble_ = grid.error();
    return;
  }
  if (layer->last == grid.value()) {
    return;
  }
  layer->last = std::move(grid).value();
  OccupancyGrid message;
  layer->last->Fill(options_.map_frame, &message);
  layer->publisher.Publish(message);
}

bool ServerThread::IsOnMap(const Header& header, const std::string& what) {
  const std::string frame = FrameOf(header.frame_id);
  if (frame == options_.map_frame) {
    return true;
  }
  SayLine(NowMs(),
          fmt::format("{}: frame \"{}\", expected \"{}\"", what, frame, options_.map_frame));
  return false;
}

void ServerThread::ReceiveOrders(const std::string& pheromone, Layer* layer) {
  layer->deposit.Receive([&](const PointStamped& message) {
    if (!std::isfinite(message.point.x) || !std::isfinite(message.point.y)) {
      SayLine(NowMs(), fmt::format("deposit: x {}, y {}, expected finite ones", message.point.x,
                                   message.point.y));
    } else if (IsOnMap(message.header, "deposit")) {
      Send("deposit", "/api/v1/deposit",
           json::serialize(json::object{
               {"pheromone", pheromone}, {"x_m", message.point.x}, {"y_m", message.point.y}}));
    }
  });
  layer->paint.Receive([&](const Path& message) {
    json::array points;
    bool good = message.poses._length > 0 && message.poses._length <= kMaxPathPoints;
    for (uint32_t i = 0; good && i < message.poses._length; ++i) {
      const auto& at = message.poses._buffer[i].pose.position;
      good = std::isfinite(at.x) && std::isfinite(at.y);
      points.push_back({at.x, at.y});
    }
    if (!good) {
      SayLine(NowMs(), fmt::format("paint: a path of {} poses, expected 1 to {} finite ones",
                                   message.poses._length, kMaxPathPoints));
    } else if (IsOnMap(message.header, "paint")) {
      Send(
          "paint", "/api/v1/paint",
          json::serialize(json::object{{"pheromone", pheromone}, {"points_m", std::move(points)}}));
    }
  });
}

// Only where the server's tracker is what knows the pose.
void ServerThread::PublishFrames(const json::value& clients) {
  std::vector<geometry_msgs_msg_dds__TransformStamped_> frames;
  const std::vector<RobotReport> reports = reports_->Get();
  for (const json::value& client : ctl::ItemsAt(clients, "clients")) {
    const json::value& pose = ctl::At(client, "pose");
    const auto robot = std::find_if(reports.begin(), reports.end(), [&](const RobotReport& it) {
      return it.id == ctl::CountAt(client, "id") && ctl::TextAt(client, "link") == options_.link;
    });
    if (ctl::TextAt(pose, "source") != "tracker" || robot == reports.end() || !robot->odometry) {
      continue;
    }
    const PlanePose map{ctl::NumberAt(pose, "x_m"), ctl::NumberAt(pose, "y_m"),
                        ctl::NumberAt(pose, "heading_deg") * std::numbers::pi / 180};
    const PlanePose frame = Compose(map, Inverse(*robot->odometry));
    frames.push_back({MakeHeader(options_.map_frame),
                      Text(robot->odometry_frame),
                      {{frame.x_m, frame.y_m, 0}, ToQuaternion(frame.heading_rad)}});
  }
  if (!frames.empty()) {
    TFMessage message{};
    PointAt(&message.transforms, &frames);
    frames_.Publish(message);
  }
}

void ServerThread::PublishDiagnostics(const json::value& clients) {
  Diagnostics diagnostics;
  for (const RobotReport& robot : reports_->Get()) {
    diagnostics.Add(robot.health, "pheromone: " + robot.name_space, robot.state,
                    {{"id", std::to_string(robot.id)},
                     {"requests", std::to_string(robot.requests)},
                     {"answers", std::to_string(robot.answers)}});
  }
  if (options_.socket.empty()) {
    diagnostics.Publish(diagnostics_);
    return;
  }
  const std::optional<json::value> status = Ask("/api/v1/status");
  const std::string warning = status ? ctl::TextAt(*status, "warning") : "";
  diagnostics.Add(
      !trouble_.empty()  ? Health::kError
      : !warning.empty() ? Health::kWarning
                         : Health::kOk,
      "pheromone: server",
      !trouble_.empty() ? trouble_
      : warning.empty() ? "answers"
                        : warning,
      status ? std::vector{std::pair{std::string("version"), ctl::TextAt(*status, "version")}}
             : std::vector<std::pair<std::string, std::string>>{});
  if (const std::optional<json::value> links = status ? Ask("/api/v1/links") : std::nullopt) {
    for (const json::value& link : ctl::ItemsAt(*links, "links")) {
      diagnostics.Add(ctl::FlagAt(link, "up") ? Health::kOk : Health::kError,
                      "pheromone: link " + ctl::TextAt(link, "name"), ctl::TextAt(link, "state"),
                      {{"address", ctl::TextAt(link, "address")}});
    }
  }
  for (const json::value& client : ctl::ItemsAt(clients, "clients")) {
    const json::value& state = ctl::At(client, "state");
    const std::string is = ctl::TextAt(state, "is");
    const std::string reason = ctl::TextAt(state, "reason");
    diagnostics.Add(StyleOf(is).health, "pheromone: robot " + NameOf(client),
                    is + (reason.empty() ? "" : ": " + reason),
                    {{"follows", ctl::TextAt(client, "follows")}});
  }
  diagnostics.Publish(diagnostics_);
}

void ServerThread::Turn(int64_t now_ms) {
  const bool had_trouble = !trouble_.empty();
  trouble_.clear();
  is_unreachable_ = false;
  json::value clients;
  if (!options_.socket.empty()) {
    const bool asks_for_laws = laws_due_.Claim(now_ms) || layers_.size() == 1 || had_trouble;
    if (asks_for_laws) {
      FindLayers();
    }
    for (auto& [pheromone, layer] : layers_) {
      if (asks_for_laws || !pheromone.empty()) {  // obstacles change with a new configuration only
        PublishLayer(pheromone, &layer);
      }
      ReceiveOrders(pheromone, &layer);
    }
    if (std::optional<json::value> answer = Ask("/api/v1/clients")) {
      clients = std::move(*answer);
      scene_.Publish(clients, markers_);
      if (frames_.exists()) {
        PublishFrames(clients);
      }
    }
    if (IsEnding()) {
      return;  // what was not asked is no trouble
    }
    if (trouble_ != said_) {
      SayLine(NowMs(), "server: " + (trouble_.empty() ? "answers" : trouble_));
      said_ = trouble_;
    }
  }
  if (diagnostics_due_.Claim(now_ms)) {
    PublishDiagnostics(clients);
  }
}

}  // namespace pheromone::ros2
