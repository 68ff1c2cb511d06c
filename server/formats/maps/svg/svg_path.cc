#include "server/formats/maps/svg/svg_path.h"

#include <array>
#include <utility>

#include "server/formats/maps/svg/svg_scanner.h"

namespace pheromone::maps {
namespace {

constexpr std::string_view kCommands = "a command, one of MLHVCSQTAZ or mlhvcsqtaz";

size_t ArgumentsOf(char upper) {
  switch (upper) {
    case 'H':
    case 'V':
      return 1;
    case 'M':
    case 'L':
    case 'T':
      return 2;
    case 'S':
    case 'Q':
      return 4;
    case 'C':
      return 6;
    case 'A':
      return 7;
    default:
      return 0;
  }
}

class PathReader {
 public:
  PathReader(std::string_view data, size_t offset, PolylineSink* sink, SvgPen* pen)
      : scanner_(data, offset, sink), pen_(*pen) {}

  bool Read() {
    scanner_.SkipSpace();
    if (!scanner_.AtEnd() && scanner_.Peek() != 'M' && scanner_.Peek() != 'm') {
      return scanner_.Fail("M or m, with which path data begins");
    }
    for (; !scanner_.AtEnd(); scanner_.SkipSpace()) {
      const char letter = scanner_.Peek();
      const bool relative = letter >= 'a' && letter <= 'z';
      const char command = relative ? static_cast<char>(letter - 'a' + 'A') : letter;
      if (command != 'Z' && ArgumentsOf(command) == 0) {
        return scanner_.Fail(kCommands);
      }
      scanner_.Next();
      if (command == 'Z') {
        pen_.Close();
        last_ = command;
      } else if (!ReadSegments(command, relative)) {
        return false;
      }
    }
    pen_.End();
    return true;
  }

 private:
  using Arguments = std::array<double, 7>;

  // A command and its repetitions; those of a move are straight sides.
  bool ReadSegments(char command, bool relative) {
    scanner_.SkipSpace();
    for (bool more = true; more; command = command == 'M' ? 'L' : command) {
      offset_ = scanner_.offset();
      Arguments arguments{};
      for (size_t i = 0; i < ArgumentsOf(command); ++i) {
        const bool flag = command == 'A' && (i == 3 || i == 4);
        if ((i > 0 && !scanner_.Separator()) ||
            !(flag ? scanner_.Flag(&arguments[i]) : scanner_.Number(&arguments[i]))) {
          return false;
        }
      }
      const Vector base = relative ? pen_.current() : Vector{};
      if (!Draw(command, arguments, base) || !scanner_.More(&more)) {
        return false;
      }
      last_ = command;
    }
    return true;
  }

  bool Draw(char command, const Arguments& n, Vector base) {
    const Vector here = pen_.current();
    const auto point = [&](size_t i) { return Vector{base.x + n[i], base.y + n[i + 1]}; };
    switch (command) {
      case 'M':
        pen_.MoveTo(point(0));
        return true;
      case 'L':
        return pen_.LineTo(point(0), offset_);
      case 'H':
        return pen_.LineTo({base.x + n[0], here.y}, offset_);
      case 'V':
        return pen_.LineTo({here.x, base.y + n[0]}, offset_);
      case 'C':
        return Cubic(point(0), point(2), point(4));
      case 'S':
        return Cubic(last_ == 'C' || last_ == 'S' ? Reflected() : here, point(0), point(2));
      case 'Q':
        return Quadratic(point(0), point(2));
      case 'T':
        return Quadratic(last_ == 'Q' || last_ == 'T' ? Reflected() : here, point(0));
      default:
        return pen_.ArcTo({n[0], n[1]}, n[2], n[3] != 0, n[4] != 0, point(5), offset_);
    }
  }

  bool Cubic(Vector control1, Vector control2, Vector to) {
    control_ = control2;
    return pen_.CubicTo(control1, control2, to, offset_);
  }

  bool Quadratic(Vector control, Vector to) {
    control_ = control;
    return pen_.QuadraticTo(control, to, offset_);
  }

  // The last control point, seen from the other side of the present point.
  Vector Reflected() const {
    const Vector here = pen_.current();
    return {2 * here.x - control_.x, 2 * here.y - control_.y};
  }

  SvgScanner scanner_;
  SvgPen& pen_;
  size_t offset_ = 0;  // of the present segment's arguments
  char last_ = 'M';
  Vector control_;
};

}  // namespace

bool DrawSvgPath(std::string_view data, size_t offset, PolylineSink* sink, SvgPen* pen) {
  return PathReader(data, offset, sink, pen).Read();
}

Result<std::vector<Polyline>> ParseSvgPath(std::string_view data, std::string_view name,
                                           const Affine& to_um, int64_t tolerance_um) {
  PolylineSink sink(data, name);
  SvgPen pen(to_um, static_cast<double>(tolerance_um), &sink);
  if (!sink.failed()) {
    DrawSvgPath(data, 0, &sink, &pen);
  }
  return std::move(sink).Take();
}

}  // namespace pheromone::maps
