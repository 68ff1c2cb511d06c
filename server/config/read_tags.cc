// [[tag]] and [tags]: the virtual RFID tags.
#include <algorithm>
#include <set>

#include "server/config/points.h"
#include "server/config/sections.h"
#include "server/core/engine/nets_part.h"

namespace pheromone::config {
namespace {

constexpr int64_t kDefaultRangeUm = 1'000'000;

// As far as an answer to SCAN can tell a distance.
int64_t MaxRangeUm(const engine::EngineConfig& engine) {
  return std::min<int64_t>(tags::kMaxRangeUm, int64_t{32'767} * engine.pose_unit_10um * 10);
}

void ReadTag(const TableReader& table, const engine::EngineConfig& engine,
             std::set<std::string>* names, tags::Settings* settings) {
  table.AllowOnly({"name", "x_m", "y_m", "range_m", "slots"});
  const field::MapGeometry& map = engine.field.map;
  auto name = ReadName(table);
  const auto x_um = table.Scaled("x_m", kMetresToUm, map.origin.x, map.origin.x + map.width_um);
  const auto y_um = table.Scaled("y_m", kMetresToUm, map.origin.y, map.origin.y + map.height_um);
  const auto range_um =
      table.Scaled("range_m", kMetresToUm, 1, MaxRangeUm(engine), kDefaultRangeUm);
  const auto slots = table.Integer("slots", 1, tags::kMaxSlots, tags::kDefaultSlots);
  if (!name || !x_um || !y_um || !range_um || !slots) {
    return;
  }
  if (!names->insert(*name).second) {
    table.Report("name", "found " + table.Find("name")->Describe() +
                             " again, expected a value not used by another tag");
    return;
  }
  settings->tags.push_back(
      {std::move(*name), *x_um, *y_um, *range_um, static_cast<uint8_t>(*slots)});
}

void ReadPrivileged(const TableReader& table, tags::Settings* settings) {
  constexpr std::string_view kExpected = "unique IDs of 1 to 255 bytes, such as [\"operator\"]";
  table.AllowOnly({"privileged"});
  const Value* const list = table.Find("privileged");
  if (list == nullptr) {
    return;
  }
  if (list->kind != Value::Kind::kArray) {
    table.Expected("privileged", *list, kExpected);
    return;
  }
  settings->privileged.clear();
  for (const Value& it : list->items) {
    if (it.kind != Value::Kind::kString || it.text.empty() ||
        it.text.size() > tags::SymbolTables::kMaxTextBytes) {
      table.Expected("privileged", it, kExpected);
      return;
    }
    settings->privileged.push_back(it.text);
  }
}

// What nets write on tags is never dropped.
void AddNets(const Value& root, tags::Settings* settings) {
  const Value* const nets = root.Find("net");
  for (const Value& net : nets != nullptr ? nets->items : std::vector<Value>()) {
    const Value* const name = net.Find("name");
    if (name != nullptr && name->kind == Value::Kind::kString) {
      settings->privileged.push_back(engine::NetsPart::AuthorOf(name->text));
    }
  }
}

}  // namespace

void ReadTags(const Value& root, Notes* notes, engine::EngineConfig* engine) {
  const std::vector<const Value*> tables = TablesOf(root, "tag", notes, tags::kMaxTags);
  const Value& common = TableOf(root, "tags", notes);
  tags::Settings& settings = engine->tags;
  settings.privileged = {"operator"};
  std::set<std::string> names;
  for (size_t i = 0; i < tables.size(); ++i) {
    ReadTag(TableReader(*tables[i], PathOf("tag", i), &notes->problems), *engine, &names,
            &settings);
  }
  ReadPrivileged(TableReader(common, "tags", &notes->problems), &settings);
  AddNets(root, &settings);
}

}  // namespace pheromone::config
