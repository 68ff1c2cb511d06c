#include "server/core/field/frozen_field.h"

#include <algorithm>
#include <utility>

#include "server/base/bytes.h"

namespace pheromone::field {

std::unique_ptr<FrozenField> Field::Freeze(uint64_t most_kept_bytes) const {
  const bool is_large = std::any_of(works_.begin(), works_.end(), [](const Work& work) {
    return work.plan != nullptr && work.plan->size() > kNodesOfPortion;
  });
  if (frozen_ != nullptr || is_large) {
    return nullptr;
  }
  std::unique_ptr<FrozenField> frozen(new FrozenField(this, most_kept_bytes));
  frozen_ = frozen.get();
  return frozen;
}

// In the order of Field::Save (state.cc).
FrozenField::FrozenField(const Field* field, uint64_t most_kept_bytes) : field_(field) {
  kept_.budget.limit_bytes = most_kept_bytes;
  ByteWriter text;
  const auto add = [&](std::unique_ptr<FrozenCells> cells) {
    bytes_ += text.bytes().size() + (cells ? cells->bytes() : 0);
    parts_.push_back({text.Take(), std::move(cells)});
  };
  for (size_t type = 1; type < kTypes; ++type) {
    add(field->layers_.cells[type]->Freeze(&kept_));
    field->layers_.diffusing[type]->Save(&text);
    text.U64(field->stepped_ms_[type]);
  }
  field->history_.SaveParts([&](const auto& write) { write(&text); },
                            [&](const CellMap& cells) { add(cells.Freeze(&kept_)); });
  field->SaveRest(&text);
  add(nullptr);
}

void FrozenField::LetGo() {
  if (field_ == nullptr) {
    return;
  }
  field_->frozen_ = nullptr;
  field_ = nullptr;
  for (Part& part : parts_) {
    if (part.cells) {
      part.cells->LetGo();
    }
  }
  if (!done()) {
    kept_.failed = true;
  }
}

bool FrozenField::CopySome(std::string* to, int tiles) {
  const int most = tiles * FrozenCells::kWorkOfTile;
  if (done() || failed()) {
    return false;
  }
  const size_t before = to->size();
  for (int work = 0; work < most && to->size() - before < kTextAtOnce && !done();) {
    Part& part = parts_[part_];
    if (text_ < part.text.size()) {
      const size_t bytes = std::min(kTextAtOnce, part.text.size() - text_);
      to->append(part.text, text_, bytes);
      text_ += bytes;
    } else if (part.cells && !part.cells->done()) {
      work += part.cells->CopySome(most - work, to);
    } else {
      part = {};
      text_ = 0;
      ++part_;
    }
  }
  if (done()) {
    LetGo();
  }
  return true;
}

}  // namespace pheromone::field
