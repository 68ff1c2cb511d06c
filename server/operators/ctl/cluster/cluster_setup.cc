#include "server/operators/ctl/cluster/cluster_setup.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <system_error>
#include <vector>

#include "server/base/descriptor.h"
#include "server/base/hex.h"
#include "server/base/random.h"
#include "server/base/result.h"
#include "server/operators/ctl/cluster/cluster_plan.h"
#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {
namespace {

namespace fs = std::filesystem;

constexpr size_t kSecretBytes = 32;
constexpr size_t kTokenBytes = 4;

std::string RandomDigits(size_t count) {
  std::vector<uint8_t> bytes(count);
  FillRandom(bytes);
  return HexText(bytes);
}

// Never through a link, and never with rights that an older file had.
Status WritePlanned(const fs::path& path, const PlannedFile& file) {
  if (unlink(path.c_str()) != 0 && errno != ENOENT) {
    return SystemError(path.string() + ": cannot be replaced");
  }
  Descriptor out(open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC,
                      file.is_secret ? S_IRUSR | S_IWUSR : S_IRUSR | S_IWUSR | S_IRGRP | S_IROTH));
  if (!out.valid() || !WriteAll(out.get(), file.text) || !out.Close()) {
    return SystemError(path.string() + ": cannot be written");
  }
  return Ok();
}

Status WriteMachines(const ClusterPlan& plan, const fs::path& folder) {
  const std::string secret = RandomDigits(kSecretBytes);
  const std::string token = RandomDigits(kTokenBytes);
  for (const ClusterMachine& machine : plan.machines) {
    const fs::path own = folder / machine.name;
    std::error_code error;
    fs::create_directories(own, error);
    if (error) {
      return Error{own.string() + ": cannot be created: " + error.message()};
    }
    for (const PlannedFile& file : FilesOf(plan, machine, {secret, token})) {
      PHEROMONE_TRY_STATUS(WritePlanned(own / file.name, file));
    }
  }
  return Ok();
}

}  // namespace

int SetUpCluster(const ClusterSetup& setup) {
  const Result<ClusterPlan> plan = PlanCluster(setup.name, setup.machines, setup.witnesses);
  if (!plan.ok()) {
    return Fail(kUsage, plan.error());
  }
  const fs::path folder = setup.output.empty() ? "cluster-" + setup.name : setup.output;
  for (const ClusterMachine& machine : plan.value().machines) {
    const fs::path own = folder / machine.name;
    std::error_code error;
    if (!setup.overwrite && fs::exists(fs::symlink_status(own, error))) {
      return Fail(kFailed, own.string() +
                               ": is there already; expected a new folder, or --force, which makes "
                               "all files and the secret anew");
    }
  }
  if (const Status written = WriteMachines(plan.value(), folder); !written.ok()) {
    return Fail(kFailed, written.error());
  }
  for (const ClusterMachine& machine : plan.value().machines) {
    fmt::print("{}  {}, {}\n", (folder / machine.name).string(), machine.address,
               machine.is_witness ? "a witness: etcd" : "etcd and pheromoned");
  }
  fmt::print(
      "Copy each folder to its machine, such as by scp -r, and do there what its README.txt says. "
      "Each has the secret of the cluster: show it to nobody.\n");
  return 0;
}

}  // namespace pheromone::ctl
