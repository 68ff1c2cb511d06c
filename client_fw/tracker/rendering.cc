#include "client_fw/tracker/rendering.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace pheromone::tracker {
namespace {

constexpr int kSide = 2;  // samples along a pixel's side
constexpr int kSamples = kSide * kSide;
constexpr int kBlock = 16;  // pixels along its side
constexpr size_t kNoiseValues = (size_t{1} << 20) + 7;
constexpr float kCableLevel = 90;
constexpr float kBodyLevel = 45;
constexpr float kWhite = 215;
constexpr float kBlack = 30;
constexpr float kElsewhere = -1;

float Square(float value) {
  return value * value;
}

// A floor's texture: a level for each centimetre, from 0 to 1, the same at each call.
float TextureAt(float x_m, float y_m) {
  auto hash = static_cast<uint32_t>(static_cast<int32_t>(std::floor(x_m * 100))) * 0x9E3779B1u ^
              static_cast<uint32_t>(static_cast<int32_t>(std::floor(y_m * 100))) * 0x85EBCA77u;
  hash ^= hash >> 15;
  hash *= 0x2C1B3C6Du;
  hash ^= hash >> 13;
  return static_cast<float>(hash & 0xFFFF) / 65535.0F;
}

// How far from the axis a ray is that the lens bends to `bent`: by halving, since it grows with it.
double StraightRadius(const Lens& lens, double bent) {
  double low = 0;
  double high = 4 * bent + 1e-9;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    const double square = middle * middle;
    (middle + lens.k1 * square * middle + lens.k2 * square * square * middle < bent ? low : high) =
        middle;
  }
  return low;
}

}  // namespace

Renderer::Renderer(const RenderedCamera& camera, std::span<const RenderedTag> floor,
                   std::span<const RenderedCable> cables, const Blemishes& blemishes)
    : camera_(camera), blemishes_(blemishes), random_(blemishes.seed) {
  std::normal_distribution<float> normal(0, static_cast<float>(std::max(blemishes.noise, 1e-3)));
  noise_.resize(kNoiseValues);
  std::generate(noise_.begin(), noise_.end(), [&] { return normal(random_); });
  TraceRays();
  PaintFloor(floor);
  PaintCables(cables);
}

void Renderer::TraceRays() {
  const Lens& lens = camera_.lens;
  const Point& centre = lens.centre_px;
  const double furthest = std::hypot(std::max(centre.x(), camera_.width - centre.x()),
                                     std::max(centre.y(), camera_.height - centre.y())) /
                          lens.focal_px;
  constexpr size_t kSteps = 4096;
  std::vector<double> straight(kSteps + 2);
  for (size_t i = 0; i < straight.size(); ++i) {
    straight[i] = StraightRadius(lens, furthest * static_cast<double>(i) / kSteps);
  }
  rays_.reserve(static_cast<size_t>(camera_.width * camera_.height * kSamples));
  for (int pixel = 0; pixel < camera_.width * camera_.height; ++pixel) {
    for (int sample = 0; sample < kSamples; ++sample) {
      const double u = pixel % camera_.width + (sample % kSide + 0.5) / kSide;
      const double v = pixel / camera_.width + (sample / kSide + 0.5) / kSide;
      const double bent_x = (u - centre.x()) / lens.focal_px;
      const double bent_y = (v - centre.y()) / lens.focal_px;
      const double bent = std::max(std::hypot(bent_x, bent_y), 1e-12);
      const double at = bent / furthest * kSteps;
      const auto step = static_cast<size_t>(at);
      const double part = at - static_cast<double>(step);
      const double radius = straight[step] * (1 - part) + straight[step + 1] * part;
      const double right = bent_x * radius / bent;
      const double down = bent_y * radius / bent;
      const double ahead = std::sin(camera_.tilt_rad) - std::cos(camera_.tilt_rad) * down;
      const double below = std::cos(camera_.tilt_rad) + std::sin(camera_.tilt_rad) * down;
      const double east = std::cos(camera_.turn_rad) * right - std::sin(camera_.turn_rad) * ahead;
      const double north = std::sin(camera_.turn_rad) * right + std::cos(camera_.turn_rad) * ahead;
      rays_.push_back({static_cast<float>(east / below), static_cast<float>(north / below)});
    }
  }
  const int columns = (camera_.width + kBlock - 1) / kBlock;
  const int rows = (camera_.height + kBlock - 1) / kBlock;
  constexpr float kMax = std::numeric_limits<float>::max();
  blocks_.assign(static_cast<size_t>(columns * rows), {{kMax, kMax}, {-kMax, -kMax}});
  for (size_t i = 0; i < rays_.size(); ++i) {
    const int pixel = static_cast<int>(i) / kSamples;
    const int column = pixel % camera_.width / kBlock;
    const int row = pixel / camera_.width / kBlock;
    Block& block = blocks_[static_cast<size_t>(row * columns + column)];
    block.least = {std::min(block.least.east, rays_[i].east),
                   std::min(block.least.north, rays_[i].north)};
    block.most = {std::max(block.most.east, rays_[i].east),
                  std::max(block.most.north, rays_[i].north)};
  }
}

Renderer::Tag Renderer::MakeTag(const RenderedTag& tag) {
  return {tag, ModulesOf(tag.id), static_cast<float>(std::cos(tag.heading_rad)),
          static_cast<float>(std::sin(tag.heading_rad))};
}

// The level of a tag at a point of the map; kElsewhere beside it.
float Renderer::LevelOf(const Tag& tag, float x, float y) {
  const float dx = x - static_cast<float>(tag.tag.x_m);
  const float dy = y - static_cast<float>(tag.tag.y_m);
  const float module = static_cast<float>(tag.tag.edge_m) / kEdgeModules;
  const float right = (tag.sine * dx - tag.cosine * dy) / module + kTagModules / 2.0F;
  const float down = -(tag.cosine * dx + tag.sine * dy) / module + kTagModules / 2.0F;
  if (right < 0 || down < 0 || right >= kTagModules || down >= kTagModules) {
    return kElsewhere;
  }
  return tag.modules[static_cast<size_t>(down)][static_cast<size_t>(right)] ? kWhite : kBlack;
}

void Renderer::PaintFloor(std::span<const RenderedTag> floor) {
  std::vector<Tag> tags;
  for (const RenderedTag& it : floor) {
    tags.push_back(MakeTag(it));
  }
  const auto height = static_cast<float>(camera_.z_m);
  floor_.assign(rays_.size() / kSamples, 0);
  for (size_t i = 0; i < rays_.size(); ++i) {
    const float x = static_cast<float>(camera_.x_m) + height * rays_[i].east;
    const float y = static_cast<float>(camera_.y_m) + height * rays_[i].north;
    float level = 120 + 50 * TextureAt(x, y);
    for (const Tag& tag : tags) {
      const float printed = LevelOf(tag, x, y);
      level = printed == kElsewhere ? level : printed;
    }
    floor_[i / kSamples] += level / kSamples;
  }
}

void Renderer::PaintCables(std::span<const RenderedCable> cables) {
  covered_.assign(floor_.size(), 0);
  for (const RenderedCable& cable : cables) {
    const auto height = static_cast<float>(camera_.z_m - cable.height_m);
    const auto x1 = static_cast<float>(cable.x1_m);
    const auto y1 = static_cast<float>(cable.y1_m);
    const float along_x = static_cast<float>(cable.x2_m) - x1;
    const float along_y = static_cast<float>(cable.y2_m) - y1;
    const float length = Square(along_x) + Square(along_y);
    for (size_t i = 0; i < rays_.size(); ++i) {
      const float dx = static_cast<float>(camera_.x_m) + height * rays_[i].east - x1;
      const float dy = static_cast<float>(camera_.y_m) + height * rays_[i].north - y1;
      const float part = std::clamp((dx * along_x + dy * along_y) / length, 0.0F, 1.0F);
      const float away = Square(dx - part * along_x) + Square(dy - part * along_y);
      if (away < Square(static_cast<float>(cable.width_m) / 2)) {
        covered_[i / kSamples] = std::min(covered_[i / kSamples] + 1.0F / kSamples, 1.0F);
      }
    }
  }
}

void Renderer::PaintRobot(const RenderedTag& robot, std::vector<float>* levels) const {
  const Tag tag = MakeTag(robot);
  const auto height = static_cast<float>(camera_.z_m - robot.height_m);
  const float radius = 0.95F * static_cast<float>(robot.edge_m);  // its body's
  const float east = static_cast<float>(robot.x_m - camera_.x_m) / height;
  const float north = static_cast<float>(robot.y_m - camera_.y_m) / height;
  const float reach = radius / height;
  const int columns = (camera_.width + kBlock - 1) / kBlock;
  for (size_t i = 0; i < blocks_.size(); ++i) {
    const Block& block = blocks_[i];
    if (east + reach < block.least.east || east - reach > block.most.east ||
        north + reach < block.least.north || north - reach > block.most.north) {
      continue;
    }
    const int left = static_cast<int>(i) % columns * kBlock;
    const int top = static_cast<int>(i) / columns * kBlock;
    for (int row = top; row < std::min(top + kBlock, camera_.height); ++row) {
      for (int column = left; column < std::min(left + kBlock, camera_.width); ++column) {
        const auto pixel = static_cast<size_t>(row * camera_.width + column);
        float sum = 0;
        for (size_t k = 0; k < kSamples; ++k) {
          const Ray& ray = rays_[pixel * kSamples + k];
          const float x = static_cast<float>(camera_.x_m) + height * ray.east;
          const float y = static_cast<float>(camera_.y_m) + height * ray.north;
          const float printed = LevelOf(tag, x, y);
          const bool on_body = Square(ray.east - east) + Square(ray.north - north) < Square(reach);
          sum += printed != kElsewhere ? printed : on_body ? kBodyLevel : (*levels)[pixel];
        }
        (*levels)[pixel] = sum / kSamples;
      }
    }
  }
}

// By a bell along rows, then along columns.
void Renderer::Blur(std::vector<float>* levels) const {
  constexpr int kReach = 3;
  std::array<float, 2 * kReach + 1> weights{};
  float sum = 0;
  for (int i = -kReach; i <= kReach; ++i) {
    const double share = std::exp(-0.5 * i * i / (blemishes_.blur_px * blemishes_.blur_px));
    weights[static_cast<size_t>(i + kReach)] = static_cast<float>(share);
    sum += static_cast<float>(share);
  }
  const int count = static_cast<int>(levels->size());
  std::vector<float> from(levels->size());
  for (const int step : {1, camera_.width}) {
    from.swap(*levels);
    std::fill(levels->begin(), levels->end(), 0.0F);
    for (int i = -kReach; i <= kReach; ++i) {
      const float weight = weights[static_cast<size_t>(i + kReach)] / sum;
      const int shift = i * step;
      const int begin = std::max(0, -shift);
      const int end = std::min(count, count - shift);
      const float* const source = from.data() + shift;
      float* const to = levels->data();
      for (int pixel = begin; pixel < end; ++pixel) {
        to[pixel] += weight * source[pixel];
      }
    }
  }
}

Picture Renderer::Render(std::span<const RenderedTag> robots) {
  std::vector<float> levels = floor_;
  for (const RenderedTag& robot : robots) {
    PaintRobot(robot, &levels);
  }
  for (size_t i = 0; i < levels.size(); ++i) {
    levels[i] += covered_[i] * (kCableLevel - levels[i]);
  }
  if (blemishes_.blur_px > 0) {
    Blur(&levels);
  }
  Picture picture = MakePicture(camera_.width, camera_.height);
  size_t noise = random_() % noise_.size();
  for (size_t i = 0; i < levels.size(); ++i) {
    const auto column = static_cast<float>(i % static_cast<size_t>(camera_.width));
    const float light =
        1 - static_cast<float>(blemishes_.shade) * column / static_cast<float>(camera_.width);
    noise = noise + 1 == noise_.size() ? 0 : noise + 1;
    picture.levels[i] =
        static_cast<uint8_t>(std::clamp(levels[i] * light + noise_[noise], 0.0F, 255.0F));
  }
  return picture;
}

}  // namespace pheromone::tracker
