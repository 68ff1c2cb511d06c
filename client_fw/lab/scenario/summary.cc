#include "client_fw/lab/scenario/summary.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "server/base/descriptor.h"
#include "server/base/file.h"
#include "server/base/format.h"
#include "server/base/text.h"

namespace pheromone::lab {
namespace {

void Add(std::string_view name, std::string_view value, SummaryRow* row) {
  row->header += (row->header.empty() ? "" : ",") + CsvCell(name);
  row->row += (row->row.empty() ? "" : ",") + CsvCell(value);
}

bool HasLine(std::string_view text, std::string_view line) {
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = text.find('\n', begin);
    if (text.substr(begin, end - begin) == line) {
      return true;
    }
    begin = end + 1;
  }
  return false;
}

}  // namespace

SummaryRow SummaryOf(const LabScenario& scenario, const LabResult& result,
                     std::string_view commit) {
  SummaryRow row;
  Add("scenario", scenario.name, &row);
  Add("commit", commit, &row);
  Add("seed", std::to_string(scenario.world.seed), &row);
  for (const auto& [key, value] : scenario.parameters) {
    Add(key, value, &row);
  }
  for (const auto& [name, value] : MeasuresOf(result)) {
    Add(name, value ? ShortestText(*value) : "", &row);
  }
  Add("hash", HexText(result.hash), &row);
  return row;
}

Status AppendRow(const std::string& path, const SummaryRow& row) {
  const Descriptor file(open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666));
  if (!file.valid() || flock(file.get(), LOCK_EX) != 0) {
    return SystemError(path);
  }
  PHEROMONE_TRY(std::string text, ReadFile(path));
  text.resize(text.rfind('\n') + 1);  // npos + 1 is 0
  std::string more = row.row + '\n';
  if (text.empty()) {
    more = row.header + '\n' + more;
  } else if (text.substr(0, text.find('\n')) != row.header) {
    return Error{path +
                 ": found rows with other columns, expected those of this scenario; write "
                 "its runs to a file of their own"};
  } else if (HasLine(text, row.row)) {
    return Ok();
  }
  const auto at = static_cast<off_t>(text.size());
  if (ftruncate(file.get(), at) != 0 || lseek(file.get(), at, SEEK_SET) != at ||
      !WriteAll(file.get(), more) || fsync(file.get()) != 0) {
    return SystemError(path);
  }
  return Ok();
}

}  // namespace pheromone::lab
