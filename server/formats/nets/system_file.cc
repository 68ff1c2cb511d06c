#include "server/formats/nets/system_file.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <map>
#include <optional>
#include <unordered_set>
#include <utility>
#include <vector>

#include "server/base/file.h"
#include "server/base/message.h"
#include "server/core/petri/compose.h"
#include "server/formats/nets/keys.h"
#include "server/formats/nets/own_part.h"

namespace pheromone::nets {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMaxSystemBytes = size_t{16} << 20;
// The TOML library takes a tree apart recursively; a line of this length cannot exhaust the stack.
constexpr size_t kMaxSystemLine = size_t{16} << 10;
constexpr size_t kMaxNesting = 16;
constexpr size_t kMaxInstances = 10'000;  // of all files together

// One file for another, and whether that has happened.
struct Replacement {
  fs::path by;
  bool used = false;
};
using Replacements = std::map<fs::path, Replacement>;

fs::path Canonical(const fs::path& path) {
  std::error_code ignored;
  fs::path canonical = fs::weakly_canonical(path, ignored);
  return canonical.empty() ? path.lexically_normal() : canonical;
}

size_t LongLineOf(std::string_view text) {
  size_t line = 1;
  for (size_t begin = 0; begin < text.size(); ++line) {
    const size_t end = std::min(text.find('\n', begin), text.size());
    if (end - begin > kMaxSystemLine) {
      return line;
    }
    begin = end + 1;
  }
  return 0;
}

std::string IdInWhole(const petri::Instance& instance, const petri::Place& place) {
  const auto bound = instance.with.find(place.id);
  return bound != instance.with.end() ? bound->second
         : !place.box.empty()         ? place.box
                                      : petri::PrefixedId(instance.as, place.id);
}

std::string FirstPlaces(const petri::Net& net) {
  constexpr size_t kMaxShown = 20;
  std::string shown;
  for (size_t i = 0; i < std::min(net.places.size(), kMaxShown); ++i) {
    shown += (i == 0 ? "" : ", ") + net.places[i].id;
  }
  return net.places.size() > kMaxShown ? shown + ", ..." : shown;
}

class SystemLoader {
 public:
  Result<petri::Net> Load(const fs::path& path, const Parameters& chosen, const std::string& as) {
    PHEROMONE_TRY(const std::string text, ReadFile(path.string(), kMaxSystemBytes));
    reading_.push_back(Canonical(path));
    Result<petri::Net> net = Parse(path.string(), text, chosen, path.parent_path(), as);
    reading_.pop_back();
    return net;
  }

  Result<petri::Net> Parse(std::string_view name, std::string_view text, const Parameters& chosen,
                           const fs::path& folder, const std::string& as);

 private:
  // An instance that a file asks for, and where.
  struct Asked {
    petri::Instance instance;
    Keys keys;
  };

  void AddInstances(const Keys& keys, const fs::path& folder, std::vector<Asked>* asked);
  std::optional<petri::Net> LoadInstance(const Keys& keys, const fs::path& folder,
                                         const std::string& as);
  fs::path Replaced(const fs::path& path);
  static Replacements ReadReplacements(const Keys& keys, const fs::path& folder);
  static void ReadBindings(const Keys& keys, petri::Instance* instance);
  static void CheckBindings(const std::vector<Located>& foreign, const std::vector<Asked>& asked);
  static Result<petri::Net> Join(const std::string& name, std::vector<Asked> asked);

  std::vector<fs::path> reading_{};
  std::vector<Replacements> replacements_{};  // the innermost last
  size_t instances_ = 0;
};

Result<petri::Net> SystemLoader::Parse(std::string_view name, std::string_view text,
                                       const Parameters& chosen, const fs::path& folder,
                                       const std::string& as) {
  FileProblems problems(name);
  if (const Status utf8 = SkipByteOrderMark(&text); !utf8.ok()) {
    problems.Add({1, 1}, "syntax", utf8.error());
    return Error{problems.Text()};
  }
  if (const size_t line = LongLineOf(text); line != 0) {
    problems.Add({static_cast<toml::source_index>(line), 1}, "syntax",
                 "the line is longer than " + std::to_string(kMaxSystemLine) + " bytes");
    return Error{problems.Text()};
  }
  toml::table table;
  try {
    table = toml::parse(text);
  } catch (const toml::parse_error& error) {
    problems.Add(error.source().begin, "syntax", error.description());
    return Error{problems.Text()};
  } catch (const std::exception& error) {
    problems.Add({1, 1}, "syntax", error.what());
    return Error{problems.Text()};
  }
  Scope scope{.as = as, .problems = &problems};
  const Keys file(table, "", scope);
  file.AllowOnly({"net", "parameters", "place", "transition", "claim", "instance"});
  scope.parameters = ReadParameters(file, chosen);
  const OwnPart own = ReadOwnPart(file);
  std::vector<Asked> asked{{{.net = own.net}, file}};  // the file's own part is the first
  for (const Located& name_used : own.foreign) {
    asked[0].instance.with[name_used.text] = name_used.text;
  }
  for (const Keys& instance : file.Tables("instance")) {
    AddInstances(instance, folder, &asked);
  }
  // Names are only right or wrong once all instances are known.
  if (problems.empty()) {
    CheckBindings(own.foreign, asked);
  }
  if (!problems.empty()) {
    return Error{problems.Text()};
  }
  if (asked.size() == 1) {
    return own.net;  // boxes keep their IDs, by which they are bound
  }
  Result<petri::Net> whole = Join(own.net.name, std::move(asked));
  return problems.empty() ? std::move(whole) : Result<petri::Net>(Error{problems.Text()});
}

void SystemLoader::AddInstances(const Keys& keys, const fs::path& folder,
                                std::vector<Asked>* asked) {
  keys.AllowOnly({"net", "as", "with", "parameters", "count", "replace"});
  std::vector<std::string> names{keys.Text("as")};
  if (keys.Has("count")) {
    if (names[0].empty()) {
      keys.Note("as", "missing, expected a name beside count");
    }
    const int64_t count = keys.Number("count", 0, kMaxInstances, std::nullopt);
    const std::string stem = names[0];
    names.clear();
    for (int64_t i = 1; i <= count; ++i) {
      names.push_back(stem + std::to_string(i));
    }
  }
  for (const std::string& name : names) {
    const bool taken = std::any_of(asked->begin(), asked->end(), [&](const Asked& other) {
      return !name.empty() && other.instance.as == name;
    });
    if (taken || (!name.empty() && !IsPlainId(name))) {
      keys.Note("as", "found \"" + name + "\", expected a name of letters, digits, _ . and -, " +
                          "once in this file");
      return;
    }
    if (++instances_ > kMaxInstances) {
      keys.Note("", "expected at most " + std::to_string(kMaxInstances) + " instances");
      return;
    }
    // An instance's table may say {as} of itself.
    const Scope inside{keys.scope().parameters, name, keys.scope().problems};
    const Keys own_keys = keys.For(inside);
    std::optional<petri::Net> net = LoadInstance(own_keys, folder, name);
    if (!net) {
      return;
    }
    petri::Instance instance{.net = std::move(*net), .as = name};
    ReadBindings(own_keys, &instance);
    asked->push_back({std::move(instance), keys});
  }
}

// Nothing, and problems noted, if it cannot be.
std::optional<petri::Net> SystemLoader::LoadInstance(const Keys& keys, const fs::path& folder,
                                                     const std::string& as) {
  const std::string file = keys.Required("net", "the name of a net's file");
  if (file.empty()) {
    return std::nullopt;
  }
  Parameters chosen;
  if (const auto table = keys.Table("parameters")) {
    for (const std::string& name : table->Names()) {
      chosen[name] = table->Number(name, 0, petri::kMaxTokens, std::nullopt);
    }
  }
  const fs::path path = Replaced((folder / file).lexically_normal());
  if (std::find(reading_.begin(), reading_.end(), Canonical(path)) != reading_.end()) {
    keys.Note("net", "found \"" + file +
                         "\", which is being read: expected a net that is not made "
                         "of itself");
    return std::nullopt;
  }
  if (reading_.size() >= kMaxNesting) {
    keys.Note("net", "found \"" + file + "\", expected nets within each other at most " +
                         std::to_string(kMaxNesting) + " deep");
    return std::nullopt;
  }
  std::error_code error;
  if (!fs::exists(path, error)) {
    keys.Note("net", "found \"" + file + "\", expected a file; there is no " + path.string());
    return std::nullopt;
  }
  replacements_.push_back(ReadReplacements(keys, folder));
  Result<petri::Net> net = Load(path, chosen, as);
  for (const auto& [from, replacement] : replacements_.back()) {
    if (net.ok() && !replacement.used) {
      keys.Note("replace", "found \"" + from.filename().string() + "\", expected a file that \"" +
                               file + "\" is made of");
    }
  }
  replacements_.pop_back();
  if (!net.ok()) {
    keys.scope().problems->AddLines(keys.at(), net.error());
    return std::nullopt;
  }
  return std::move(net).value();
}

fs::path SystemLoader::Replaced(const fs::path& path) {
  fs::path now = path;
  // NOLINTNEXTLINE(modernize-loop-convert): clang 14 cannot compile std::views::reverse
  for (auto level = replacements_.rbegin(); level != replacements_.rend(); ++level) {
    if (const auto found = level->find(Canonical(now)); found != level->end()) {
      found->second.used = true;
      now = found->second.by;
    }
  }
  return now;
}

Replacements SystemLoader::ReadReplacements(const Keys& keys, const fs::path& folder) {
  Replacements replacements;
  if (const auto table = keys.Table("replace")) {
    for (const auto& [from, by] : table->Entries()) {
      replacements[Canonical(folder / from.text)] = {(folder / by.text).lexically_normal()};
    }
  }
  return replacements;
}

void SystemLoader::ReadBindings(const Keys& keys, petri::Instance* instance) {
  const auto table = keys.Table("with");
  if (!table) {
    return;
  }
  for (const auto& [from, to] : table->Entries()) {
    if (petri::PlaceOf(instance->net, from.text) == instance->net.places.size()) {
      table->NoteAt(
          from.at, from.text,
          "expected a place of \"" + instance->net.name + "\": " + FirstPlaces(instance->net));
    }
    instance->with[from.text] = to.text;
  }
}

// Notes each name that neither the file nor an instance has as a place.
void SystemLoader::CheckBindings(const std::vector<Located>& foreign,
                                 const std::vector<Asked>& asked) {
  constexpr std::string_view kKnown = "expected a place of this file or of an instance";
  std::unordered_set<std::string> known;
  for (const Asked& one : asked) {
    for (const petri::Place& place : one.instance.net.places) {
      if (!one.instance.with.contains(place.id)) {
        known.insert(IdInWhole(one.instance, place));
      }
    }
  }
  for (const Located& name : foreign) {
    if (!known.contains(name.text)) {
      asked[0].keys.NoteAt(name.at, "transition",
                           "found \"" + name.text + "\", " + std::string(kKnown));
    }
  }
  for (size_t i = 1; i < asked.size(); ++i) {
    for (const auto& [from, to] : asked[i].instance.with) {
      if (!known.contains(to)) {
        asked[i].keys.Table("with")->Note(from, "found \"" + to + "\", " + std::string(kKnown));
      }
    }
  }
}

Result<petri::Net> SystemLoader::Join(const std::string& name, std::vector<Asked> asked) {
  const Keys& file = asked[0].keys;
  std::vector<petri::Instance> instances;
  size_t nodes = 0;
  std::unordered_set<std::string> own_claims;
  for (const petri::Claim& claim : asked[0].instance.net.claims) {
    own_claims.insert(claim.id);
  }
  for (Asked& one : asked) {
    if (&one != asked.data()) {
      std::erase_if(one.instance.net.claims, [&](const petri::Claim& claim) {
        return own_claims.contains(petri::PrefixedId(one.instance.as, claim.id));
      });
    }
    nodes += one.instance.net.places.size() + one.instance.net.transitions.size();
    instances.push_back(std::move(one.instance));
  }
  if (nodes > petri::kMaxNodes) {
    file.Note("instance", "found " + std::to_string(nodes) +
                              " places and transitions together, expected at most " +
                              std::to_string(petri::kMaxNodes));
    return Error{""};
  }
  Result<petri::Net> whole = petri::Compose(name, instances);
  if (whole.ok()) {
    return whole;
  }
  // The first instances with which it fails in this way tell where.
  size_t failing = instances.size();
  while (failing > 1) {
    instances.resize(failing - 1);
    const Result<petri::Net> part = petri::Compose(name, instances);
    if (part.ok() || part.error() != whole.error()) {
      break;
    }
    --failing;
  }
  asked[failing - 1].keys.Note("", whole.error());
  return whole;
}

}  // namespace

Result<petri::Net> LoadSystem(const fs::path& path, const Parameters& chosen) {
  return SystemLoader().Load(path, chosen, "");
}

Result<petri::Net> ParseSystem(std::string_view name, std::string_view text,
                               const Parameters& chosen, const fs::path& folder) {
  return SystemLoader().Parse(name, text, chosen, folder, "");
}

}  // namespace pheromone::nets
