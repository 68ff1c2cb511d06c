#include "server/store/journal/testing/crash_folder.h"

#include <algorithm>
#include <utility>

namespace pheromone::journal::testing {
namespace {

constexpr size_t kSectorBytes = 512;

Error Off() {
  return Error{"journal: the power is off"};
}

}  // namespace

class CrashFile final : public AppendFile {
 public:
  CrashFile(CrashFolder* folder, std::shared_ptr<CrashFolder::Inode> file)
      : folder_(*folder), file_(std::move(file)) {}

  Status Append(std::string_view bytes) override {
    bool cut = false;
    if (!folder_.Begin(&cut)) {
      return Off();
    }
    if (cut) {
      file_->bytes.append(bytes.substr(0, folder_.random_() % (bytes.size() + 1)));
      return Off();
    }
    if (folder_.failing_appends_ > 0) {
      --folder_.failing_appends_;
      file_->bytes.append(bytes.substr(0, bytes.size() / 2));
      return Error{"journal: cannot be written: Input/output error"};
    }
    const uint64_t others =
        folder_.bytes() - std::max<uint64_t>(file_->bytes.size(), file_->reserved);
    if (others + file_->bytes.size() + bytes.size() > folder_.limit_bytes_) {
      return Error{"journal: cannot be written: No space left on device"};
    }
    file_->bytes.append(bytes);
    return Ok();
  }

  Status Sync() override {
    bool cut = false;
    if (!folder_.Begin(&cut) || cut) {
      return Off();
    }
    if (folder_.failing_syncs_ > 0) {
      --folder_.failing_syncs_;
      file_->lost.emplace_back(file_->synced.size(), file_->bytes.size());
      return Error{"journal: cannot be synced: Input/output error"};
    }
    if (!folder_.ignore_file_syncs) {
      file_->synced = file_->bytes;
      for (const auto& [begin, end] : file_->lost) {
        std::fill(file_->synced.begin() + static_cast<std::ptrdiff_t>(begin),
                  file_->synced.begin() + static_cast<std::ptrdiff_t>(end), '\0');
      }
    }
    return Ok();
  }

  Reserved Reserve(uint64_t bytes) override {
    const uint64_t others =
        folder_.bytes() - std::max<uint64_t>(file_->bytes.size(), file_->reserved);
    if (folder_.is_off_ || others + bytes > folder_.limit_bytes_) {
      return Reserved::kNoSpace;
    }
    file_->reserved = std::max(file_->reserved, bytes);
    return Reserved::kYes;
  }

  void ReleaseReserve() override { file_->reserved = 0; }

 private:
  CrashFolder& folder_;
  std::shared_ptr<CrashFolder::Inode> file_;
};

class CrashSlots final : public SlotFile {
 public:
  CrashSlots(CrashFolder* folder, std::shared_ptr<CrashFolder::Inode> file)
      : folder_(*folder), file_(std::move(file)) {}

  Status Write(uint64_t at, std::string_view bytes) override {
    bool cut = false;
    if (!folder_.Begin(&cut)) {
      return Off();
    }
    file_->bytes.replace(at, bytes.size(), bytes);
    file_->rewritten.emplace_back(at, at + bytes.size());
    if (cut) {
      return Off();
    }
    if (folder_.failing_syncs_ > 0) {
      --folder_.failing_syncs_;
      return Error{"journal: cannot be synced: Input/output error"};
    }
    if (!folder_.ignore_file_syncs) {
      file_->synced = file_->bytes;
      file_->rewritten.clear();
    }
    return Ok();
  }

 private:
  CrashFolder& folder_;
  std::shared_ptr<CrashFolder::Inode> file_;
};

bool CrashFolder::Begin(bool* cut) {
  ++operations_;
  *cut = !is_off_ && operations_ >= cut_at_;
  if (*cut) {
    is_off_ = true;
    return true;
  }
  return !is_off_;
}

void CrashFolder::Apply(const Change& change, Names* names) {
  if (!change.from.empty()) {
    names->erase(change.from);
  }
  if (!change.to.empty()) {
    (*names)[change.to] = change.file;
  }
}

Status CrashFolder::Make(const Change& change) {
  bool cut = false;
  if (!Begin(&cut)) {
    return Off();
  }
  Apply(change, &names_);
  changes_.push_back(change);
  return cut ? Status(Off()) : Ok();
}

void CrashFolder::Tear(Inode* file) {
  std::string after = file->synced;
  if (file->bytes.size() > after.size()) {
    const size_t from = after.size();
    const size_t length = from + random_() % (file->bytes.size() - from + 1);
    after = file->bytes.substr(0, length);
    std::copy(file->synced.begin(), file->synced.end(), after.begin());
    const uint64_t mood = random_() % 3;  // all there, sectors missing, much missing
    for (size_t at = from; at < length; at = (at / kSectorBytes + 1) * kSectorBytes) {
      const size_t end = std::min(length, (at / kSectorBytes + 1) * kSectorBytes);
      if (mood != 0 && random_() % (mood == 1 ? 6 : 2) == 0) {
        const bool noise = random_() % 2 == 0;
        for (size_t i = at; i < end; ++i) {
          after[i] = noise ? static_cast<char>(random_()) : '\0';
        }
      }
    }
    for (const auto& [begin, end] : file->lost) {
      for (size_t i = begin; i < std::min(end, after.size()); ++i) {
        after[i] = '\0';
      }
    }
  }
  for (const auto& [begin, end] : file->rewritten) {
    const uint64_t mood = random_() % 3;  // not there, all there, noise
    for (size_t i = begin; mood != 0 && i < std::min(end, after.size()); ++i) {
      after[i] = mood == 1 ? file->bytes[i] : static_cast<char>(random_());
    }
  }
  *file = Inode{after, after, {}, 0, {}};
}

void CrashFolder::PowerOn() {
  Names names = synced_names_;
  for (const Change& change : changes_) {
    if (random_() % 2 == 0) {
      Apply(change, &names);
    }
  }
  names_ = names;
  for (auto& [name, file] : names_) {
    file = std::make_shared<Inode>(*file);  // whoever still has it open has another one
    Tear(file.get());
  }
  synced_names_ = names_;
  changes_.clear();
  is_off_ = false;
  cut_at_ = UINT64_MAX;
}

uint64_t CrashFolder::bytes() const {
  uint64_t sum = 0;
  for (const auto& [name, file] : names_) {
    sum += std::max<uint64_t>(file->bytes.size(), file->reserved);
  }
  return sum;
}

std::string& CrashFolder::Contents(const std::string& name) {
  return names_.at(name)->bytes;
}

Result<std::vector<std::string>> CrashFolder::List() const {
  if (is_off_) {
    return Off();
  }
  std::vector<std::string> names;
  for (const auto& [name, file] : names_) {
    names.push_back(name);
  }
  return names;
}

Result<uint64_t> CrashFolder::Size(const std::string& name) const {
  const auto found = names_.find(name);
  if (is_off_ || found == names_.end()) {
    return is_off_ ? Off() : Error{path_ + "/" + name + ": is not there"};
  }
  return uint64_t{found->second->bytes.size()};
}

Result<std::unique_ptr<SlotFile>> CrashFolder::OpenSlots(const std::string& name, uint64_t bytes) {
  if (!is_off_ && !Has(name)) {
    const auto file = std::make_shared<Inode>();
    PHEROMONE_TRY_STATUS(Make({"", name, file}));
  }
  if (is_off_) {
    return Off();
  }
  const std::shared_ptr<Inode>& file = names_.at(name);
  file->bytes.resize(bytes);
  file->synced.resize(bytes);  // zeros in either case
  return std::unique_ptr<SlotFile>(std::make_unique<CrashSlots>(this, file));
}

Result<std::string> CrashFolder::Read(const std::string& name, uint64_t offset, size_t most) const {
  const auto found = names_.find(name);
  if (is_off_ || found == names_.end()) {
    return is_off_ ? Off() : Error{path_ + "/" + name + ": is not there"};
  }
  const std::string& bytes = found->second->bytes;
  return offset < bytes.size() ? bytes.substr(offset, most) : std::string();
}

Result<std::unique_ptr<AppendFile>> CrashFolder::Create(const std::string& name) {
  if (!is_off_ && Has(name)) {
    return Error{path_ + "/" + name + ": cannot be created: File exists"};
  }
  const auto file = std::make_shared<Inode>();
  PHEROMONE_TRY_STATUS(Make({"", name, file}));
  return std::unique_ptr<AppendFile>(std::make_unique<CrashFile>(this, file));
}

Status CrashFolder::Rename(const std::string& from, const std::string& to) {
  if (!is_off_ && !Has(from)) {
    return Error{path_ + "/" + from + ": is not there"};
  }
  return Make({from, to, is_off_ ? nullptr : names_.at(from)});
}

Status CrashFolder::Remove(const std::string& name) {
  if (!is_off_ && !Has(name)) {
    return Error{path_ + "/" + name + ": is not there"};
  }
  return Make({name, "", nullptr});
}

Status CrashFolder::Sync() {
  bool cut = false;
  if (!Begin(&cut) || cut) {
    return Off();
  }
  if (failing_syncs_ > 0) {
    --failing_syncs_;
    return Error{path_ + ": cannot be synced: Input/output error"};
  }
  if (!ignore_folder_syncs) {
    synced_names_ = names_;
    changes_.clear();
  }
  return Ok();
}

}  // namespace pheromone::journal::testing
