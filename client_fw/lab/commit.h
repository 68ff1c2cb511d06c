// Of which sources this program is built, for rows of results.
#pragma once

#include <string_view>

namespace pheromone::lab {

/// The commit, with "-dirty" after it if files were changed; the version where there is no Git.
std::string_view SourceCommit();

}  // namespace pheromone::lab
