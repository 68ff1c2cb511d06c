// A picture with what was found in it, for checking: an SVG with the picture inside, the outlines
// of tags, the robots' headings and names, and the map's lines where the floor would have them.
//
//   WriteFile("check.svg", AnnotatedSvg(picture, settings, view).value());
//
// Pure; any thread.
#pragma once

#include <string>

#include "client_fw/tracker/picture.h"
#include "client_fw/tracker/settings.h"
#include "client_fw/tracker/tracking.h"
#include "server/base/result.h"

namespace pheromone::tracker {

/// Fails only if the picture cannot be encoded.
Result<std::string> AnnotatedSvg(const Picture& picture, const Settings& settings,
                                 const View& view);

}  // namespace pheromone::tracker
