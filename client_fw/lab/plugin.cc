#include "client_fw/lab/plugin.h"

#include <dlfcn.h>
#include <fmt/format.h>

namespace pheromone::lab {
namespace {

constexpr int kVersion = 1;
constexpr int kMaxVersion = 99;  // that is looked for, to be named

std::string SymbolOf(int version) {
  return "pheromone_behaviour_v" + std::to_string(version);
}

struct CloseLibrary {
  void operator()(void* library) const { dlclose(library); }
};
using Library = std::unique_ptr<void, CloseLibrary>;

class PluginBehaviour : public Behaviour {
 public:
  using Function = decltype(&pheromone_behaviour_v1);

  PluginBehaviour(std::string path, Library library, Function function,
                  const PluginParameters& parameters)
      : path_(std::move(path)),
        library_(std::move(library)),
        function_(function),
        parameters_(parameters) {
    for (const auto& [name, value] : parameters_) {
      shown_.push_back({name.c_str(), value});
    }
  }

  Status Act(const PheromoneView& view, const PheromoneActions& actions, size_t first,
             size_t count) override {
    PheromoneView shown = view;
    shown.parameters = shown_.data();
    shown.parameter_count = shown_.size();
    const int result = function_(&shown, &actions, first, count);
    if (result != 0) {
      return Error{
          fmt::format("{}: {} returned {} for the robots {} to {} (indices {} to {}), "
                      "step {}, expected 0",
                      path_, SymbolOf(kVersion), result, first + 1, first + count, first,
                      first + count - 1, view.step)};
    }
    return Ok();
  }

 private:
  const std::string path_;
  const Library library_;
  const Function function_;
  const PluginParameters parameters_;
  std::vector<PheromoneParameter> shown_;
};

std::string OtherVersion(void* library) {
  for (int version = 0; version <= kMaxVersion; ++version) {
    if (dlsym(library, SymbolOf(version).c_str()) != nullptr) {
      return SymbolOf(version);
    }
  }
  return "no behaviour";
}

}  // namespace

Result<std::shared_ptr<Behaviour>> LoadPlugin(const std::string& path,
                                              const PluginParameters& parameters) {
  Library library(dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL));
  if (library == nullptr) {
    const char* why = dlerror();
    return Error{why != nullptr ? std::string(why) : path + " cannot be loaded"};
  }
  void* found = dlsym(library.get(), SymbolOf(kVersion).c_str());
  if (found == nullptr) {
    return Error{fmt::format("{}: found {}, expected {}, as in this program's behaviour_abi.h",
                             path, OtherVersion(library.get()), SymbolOf(kVersion))};
  }
  const auto function = reinterpret_cast<PluginBehaviour::Function>(found);
  return std::shared_ptr<Behaviour>(
      std::make_shared<PluginBehaviour>(path, std::move(library), function, parameters));
}

}  // namespace pheromone::lab
