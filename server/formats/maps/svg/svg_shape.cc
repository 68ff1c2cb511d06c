#include "server/formats/maps/svg/svg_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <pugixml.hpp>

#include "server/base/message.h"
#include "server/formats/maps/svg/svg_path.h"
#include "server/formats/maps/svg/svg_scanner.h"

namespace pheromone::maps {
namespace {

struct Unit {
  std::string_view name;
  double user_units;
};
// CSS: 96 pixels an inch, which are user units.
constexpr std::array<Unit, 8> kUnits = {{{"", 1},
                                         {"px", 1},
                                         {"mm", 96 / 25.4},
                                         {"cm", 96 / 2.54},
                                         {"Q", 96 / 101.6},
                                         {"in", 96},
                                         {"pt", 96.0 / 72},
                                         {"pc", 96.0 / 6}}};

class ShapeReader {
 public:
  ShapeReader(const pugi::xml_node& element, const SvgSource& source, PolylineSink* sink,
              SvgPen* pen)
      : element_(element),
        source_(source),
        sink_(*sink),
        pen_(*pen),
        offset_(source.OffsetOf(element)) {}

  bool Path() {
    const auto data = source_.Find(element_, "d");
    return !data || DrawSvgPath(data->text, data->offset, &sink_, &pen_);
  }

  bool Line() {
    Vector from;
    Vector to;
    if (!Length("x1", &from.x) || !Length("y1", &from.y) || !Length("x2", &to.x) ||
        !Length("y2", &to.y)) {
      return false;
    }
    pen_.MoveTo(from);
    return pen_.LineTo(to, offset_);
  }

  bool Polyline() {
    const auto points = source_.Find(element_, "points");
    if (!points) {
      return true;
    }
    SvgScanner scanner(points->text, points->offset, &sink_);
    scanner.SkipSpace();
    bool more = !scanner.AtEnd();
    for (bool first = true; more; first = false) {
      const size_t offset = scanner.offset();
      Vector point;
      if (!scanner.Number(&point.x) || !scanner.Separator() || !scanner.Number(&point.y)) {
        return false;
      }
      if (first) {
        pen_.MoveTo(point);
      } else if (!pen_.LineTo(point, offset)) {
        return false;
      }
      if (!scanner.More(&more)) {
        return false;
      }
    }
    return scanner.AtEnd() || scanner.Fail("a number");
  }

  bool Polygon() {
    if (!Polyline()) {
      return false;
    }
    pen_.Close();
    return true;
  }

  bool Circle() {
    Vector centre;
    double radius = 0;
    return Length("cx", &centre.x) && Length("cy", &centre.y) && Size("r", &radius) &&
           DrawEllipse(centre, {radius, radius});
  }

  bool Ellipse() {
    Vector centre;
    Vector radii;
    return Length("cx", &centre.x) && Length("cy", &centre.y) && Radii(&radii) &&
           DrawEllipse(centre, radii);
  }

  bool Rect() {
    Vector corner;
    Vector size;
    Vector radii;
    if (!Length("x", &corner.x) || !Length("y", &corner.y) || !Size("width", &size.x) ||
        !Size("height", &size.y) || !Radii(&radii)) {
      return false;
    }
    if (size.x == 0 || size.y == 0) {
      return true;
    }
    radii = {std::min(radii.x, size.x / 2), std::min(radii.y, size.y / 2)};
    const bool round = radii.x > 0 && radii.y > 0;
    return DrawRect(corner, {corner.x + size.x, corner.y + size.y}, round ? radii : Vector{});
  }

 private:
  // An attribute that is missing leaves its length as it is.
  bool Length(const char* name, double* length) {
    const auto attribute = source_.Find(element_, name);
    return !attribute || ParseSvgLength(*attribute, &sink_, length);
  }

  bool Size(const char* name, double* length) {
    if (!Length(name, length)) {
      return false;
    }
    if (*length < 0) {
      const auto attribute = source_.Find(element_, name);
      return sink_.Fail(attribute->offset, Quoted(attribute->text),
                        "a length that is not negative");
    }
    return true;
  }

  // rx and ry; each equals the other one if it is missing or "auto".
  bool Radii(Vector* radii) {
    const auto given = [this](const char* name) {
      const auto attribute = source_.Find(element_, name);
      return attribute && attribute->text != "auto";
    };
    const bool x = given("rx");
    const bool y = given("ry");
    if ((x && !Size("rx", &radii->x)) || (y && !Size("ry", &radii->y))) {
      return false;
    }
    if (x != y) {
      (x ? radii->y : radii->x) = x ? radii->x : radii->y;
    }
    return true;
  }

  bool DrawEllipse(Vector centre, Vector radii) {
    if (radii.x == 0 || radii.y == 0) {
      return true;
    }
    const Vector right{centre.x + radii.x, centre.y};
    const Vector left{centre.x - radii.x, centre.y};
    pen_.MoveTo(right);
    if (!pen_.ArcTo(radii, 0, false, true, left, offset_) ||
        !pen_.ArcTo(radii, 0, false, true, right, offset_)) {
      return false;
    }
    pen_.Close();
    return true;
  }

  bool DrawRect(Vector low, Vector high, Vector r) {
    const auto corner = [&](Vector to) {
      return pen_.ArcTo(r, 0, /*large=*/false, /*sweep=*/true, to, offset_);
    };
    const auto side = [&](Vector to) { return pen_.LineTo(to, offset_); };
    pen_.MoveTo({low.x + r.x, low.y});
    if (!side({high.x - r.x, low.y}) || !corner({high.x, low.y + r.y}) ||
        !side({high.x, high.y - r.y}) || !corner({high.x - r.x, high.y}) ||
        !side({low.x + r.x, high.y}) || !corner({low.x, high.y - r.y}) ||
        !side({low.x, low.y + r.y}) || !corner({low.x + r.x, low.y})) {
      return false;
    }
    pen_.Close();
    return true;
  }

  const pugi::xml_node& element_;
  const SvgSource& source_;
  PolylineSink& sink_;
  SvgPen& pen_;
  size_t offset_;
};

struct Shape {
  std::string_view name;
  bool (ShapeReader::*draw)();
};
constexpr std::array<Shape, 7> kShapes = {{{"path", &ShapeReader::Path},
                                           {"line", &ShapeReader::Line},
                                           {"polyline", &ShapeReader::Polyline},
                                           {"polygon", &ShapeReader::Polygon},
                                           {"rect", &ShapeReader::Rect},
                                           {"circle", &ShapeReader::Circle},
                                           {"ellipse", &ShapeReader::Ellipse}}};

}  // namespace

std::optional<SvgAttribute> SvgSource::Find(const pugi::xml_node& element, const char* name) const {
  const pugi::xml_attribute attribute = element.attribute(name);
  if (!attribute) {
    return std::nullopt;
  }
  // Parsed in place, the value has the same position as in the text, except for shortening by
  // entities before it in the same value.
  return SvgAttribute{attribute.value(), static_cast<size_t>(attribute.value() - buffer)};
}

size_t SvgSource::OffsetOf(const pugi::xml_node& element) const {
  return static_cast<size_t>(std::max<ptrdiff_t>(0, element.offset_debug()));
}

bool ParseSvgLength(const SvgAttribute& attribute, PolylineSink* sink, double* length) {
  SvgScanner scanner(attribute.text, attribute.offset, sink);
  scanner.SkipSpace();
  if (!scanner.Number(length)) {
    return false;
  }
  const size_t at = scanner.offset();
  const std::string_view word = scanner.Word();
  const auto* unit = std::find_if(kUnits.begin(), kUnits.end(),
                                  [word](const Unit& known) { return known.name == word; });
  scanner.SkipSpace();
  if (unit == kUnits.end() || !scanner.AtEnd()) {
    return sink->Fail(at, Quoted(attribute.text.substr(at - attribute.offset)),
                      "a length in user units, px, mm, cm, Q, in, pt or pc");
  }
  *length *= unit->user_units;
  return true;
}

bool IsSvgShape(std::string_view element) {
  return std::any_of(kShapes.begin(), kShapes.end(),
                     [element](const Shape& shape) { return shape.name == element; });
}

bool DrawSvgShape(std::string_view name, const pugi::xml_node& element, const SvgSource& source,
                  PolylineSink* sink, SvgPen* pen) {
  ShapeReader reader(element, source, sink, pen);
  for (const Shape& shape : kShapes) {
    if (shape.name == name) {
      if (!(reader.*shape.draw)()) {
        return false;
      }
      pen->End();
      return true;
    }
  }
  return true;
}

}  // namespace pheromone::maps
