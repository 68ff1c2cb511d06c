# Writes commit.cc, if it is not what it is to be: run in each build, by lab_commit.
execute_process(
  COMMAND git -C ${SOURCE} describe --always --dirty --abbrev=12 --exclude=*
  OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
if(failed)
  set(commit ${VERSION})
endif()
file(CONFIGURE OUTPUT ${TO} @ONLY CONTENT [[
#include "client_fw/lab/commit.h"

namespace pheromone::lab {

std::string_view SourceCommit() {
  return "@commit@";
}

}  // namespace pheromone::lab
]])
