// The shapes of an SVG drawing: <path>, and the basic shapes (SVG 1.1, chapter 9) by their
// equivalent paths. Internal to server/formats/maps.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

#include "server/formats/maps/polyline_sink.h"
#include "server/formats/maps/svg/svg_pen.h"

namespace pugi {
class xml_node;
}

namespace pheromone::maps {

/// An attribute's value and its position in the sink's text.
struct SvgAttribute {
  std::string_view text;
  size_t offset = 0;
};

/// Finds attributes of elements, and the positions of both. The document was parsed in place from
/// `buffer`, a copy of the sink's text.
struct SvgSource {
  const char* buffer = nullptr;

  std::optional<SvgAttribute> Find(const pugi::xml_node& element, const char* name) const;
  size_t OffsetOf(const pugi::xml_node& element) const;
};

/// A length from an attribute, in user units. False if an error was reported to the sink.
bool ParseSvgLength(const SvgAttribute& attribute, PolylineSink* sink, double* length);

bool IsSvgShape(std::string_view element);

/// Draws one of the shapes. False if an error was reported to the sink.
bool DrawSvgShape(std::string_view name, const pugi::xml_node& element, const SvgSource& source,
                  PolylineSink* sink, SvgPen* pen);

}  // namespace pheromone::maps
