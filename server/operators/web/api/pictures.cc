#include "server/operators/web/api/pictures.h"

#include <optional>
#include <utility>

#include "server/operators/web/api/request_parameters.h"
#include "server/operators/web/long_answers.h"

namespace pheromone::web {
namespace {

constexpr int kLooks = 5;

}  // namespace

void Pictures::Show(const std::string& target, boost::json::object query, Respond respond) {
  const auto order = std::make_shared<Order>();
  {
    const std::lock_guard lock(mutex_);
    std::weak_ptr<Order>& present = orders_[target];
    if (const auto same = present.lock()) {
      same->waiting.push_back(std::move(respond));
      return;
    }
    present = order;
    order->target = target;
    order->query = std::move(query);
    order->waiting.push_back(std::move(respond));
  }
  Begin(order, kLooks);
}

void Pictures::Begin(const std::shared_ptr<Order>& order, int looks_left) {
  Parameters fields(order->query);
  std::optional<Picture> picture = ReadPicture(control_.GetField(), &fields);
  if (!picture) {
    Answer(order, Refuse(400, *fields.problem()));
    return;
  }
  if (!RunIn(lanes_.pictures, [this, order, picture = *std::move(picture), looks_left] {
        Draw(order, picture, looks_left);
      })) {
    Answer(order, Busy());
  }
}

void Pictures::Draw(const std::shared_ptr<Order>& order, const Picture& picture, int looks_left) {
  Close(order);
  Response response = DrawPicture(picture);
  ShareLongBody(&response);  // by all who wait for it
  if (!RunIn(lanes_.requests, [this, order, picture, response, looks_left] {
        Finish(order, picture, response, looks_left);
      })) {
    Answer(order, Busy());
  }
}

void Pictures::Finish(const std::shared_ptr<Order>& order, const Picture& picture,
                      const Response& response, int looks_left) {
  // Levels that were read under one law must not be shown under another.
  if (control_.GetField().config.pheromones == picture.view.config.pheromones) {
    Answer(order, response);
  } else if (looks_left > 1) {
    Begin(order, looks_left - 1);
  } else {
    Answer(order, Refuse(503, {"the configuration is changing", "", "try again in a moment"}));
  }
}

// Later requests do not join it.
void Pictures::Close(const std::shared_ptr<Order>& order) {
  const std::lock_guard lock(mutex_);
  const auto present = orders_.find(order->target);
  if (present != orders_.end() && present->second.lock() == order) {
    orders_.erase(present);
  }
}

void Pictures::Answer(const std::shared_ptr<Order>& order, const Response& response) {
  Close(order);
  for (const Respond& respond : order->waiting) {
    respond(response);
  }
}

}  // namespace pheromone::web
