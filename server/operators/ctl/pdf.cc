#include "server/operators/ctl/pdf.h"

#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "server/base/descriptor.h"
#include "server/base/file.h"

namespace pheromone::ctl {
namespace {

// The status that it ends with, or why it cannot be started.
Result<int> Run(const char* const* arguments, int input, int output) {
  posix_spawn_file_actions_t streams;
  posix_spawn_file_actions_init(&streams);
  posix_spawn_file_actions_adddup2(&streams, input, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&streams, output, STDOUT_FILENO);
  pid_t child = 0;
  const int error = posix_spawnp(&child, arguments[0], &streams, nullptr,
                                 const_cast<char* const*>(arguments), environ);
  posix_spawn_file_actions_destroy(&streams);
  if (error != 0) {
    return Error{std::generic_category().message(error)};
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

}  // namespace

Result<std::string> SvgToPdf(std::string_view svg) {
  // Files in memory: with pipes, both programs could wait for each other.
  const Descriptor input(memfd_create("svg", MFD_CLOEXEC));
  const Descriptor output(memfd_create("pdf", MFD_CLOEXEC));
  if (!input.valid() || !output.valid() || !WriteAll(input.get(), svg) ||
      lseek(input.get(), 0, SEEK_SET) != 0) {
    return SystemError("a file in memory");
  }
  const char* const arguments[] = {"rsvg-convert", "--format=pdf", nullptr};
  const Result<int> ended = Run(arguments, input.get(), output.get());
  if (!ended.ok()) {
    return Error{"rsvg-convert: " + ended.error() +
                 "; this program makes a PDF of an SVG: sudo apt install librsvg2-bin"};
  }
  if (ended.value() != 0) {
    return Error{"rsvg-convert failed"};
  }
  return ReadFile("/proc/self/fd/" + std::to_string(output.get()));
}

}  // namespace pheromone::ctl
