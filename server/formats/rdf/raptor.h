// Raptor's objects, freed at the end of their scope, and its messages as errors.
//
//   RaptorWorld world;
//   RaptorParser parser(raptor_new_parser(world.get(), "turtle"));
//
// One thread at a time.
#pragma once

#include <raptor2.h>

#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace pheromone::ctl {

template <auto free>
struct RaptorFree {
  template <typename T>
  void operator()(T* it) const {
    free(it);
  }
};
using RaptorParser = std::unique_ptr<raptor_parser, RaptorFree<raptor_free_parser>>;
using RaptorSerializer = std::unique_ptr<raptor_serializer, RaptorFree<raptor_free_serializer>>;
using RaptorUri = std::unique_ptr<raptor_uri, RaptorFree<raptor_free_uri>>;

inline const unsigned char* RaptorText(const std::string& text) {
  return reinterpret_cast<const unsigned char*>(text.c_str());
}

/// What everything else belongs to: it keeps the first error.
class RaptorWorld {
 public:
  struct Fault {
    int line = 0;  ///< 0: unknown
    std::string text;
  };

  RaptorWorld() : world_(raptor_new_world()) {
    raptor_world_set_log_handler(get(), this, [](void* self, raptor_log_message* message) {
      static_cast<RaptorWorld*>(self)->Take(*message);
    });
    raptor_world_open(get());
  }
  RaptorWorld(const RaptorWorld&) = delete;
  RaptorWorld& operator=(const RaptorWorld&) = delete;

  raptor_world* get() const { return world_.get(); }
  const std::optional<Fault>& fault() const { return fault_; }

  RaptorUri Uri(const std::string& text) const {
    return RaptorUri(raptor_new_uri(get(), RaptorText(text)));
  }

 private:
  void Take(const raptor_log_message& message) {
    if (message.level < RAPTOR_LOG_LEVEL_ERROR || fault_) {
      return;
    }
    const bool has_line = message.locator != nullptr && message.locator->line > 0;
    fault_ = Fault{has_line ? message.locator->line : 0, message.text};
  }

  std::unique_ptr<raptor_world, RaptorFree<raptor_free_world>> world_;
  std::optional<Fault> fault_;
};

}  // namespace pheromone::ctl
