#include "server/formats/maps/svg/svg_transform.h"

#include <array>
#include <cmath>
#include <numbers>

#include "server/base/message.h"
#include "server/formats/maps/svg/svg_scanner.h"

namespace pheromone::maps {
namespace {

constexpr size_t kMaxArguments = 6;
using Arguments = std::array<double, kMaxArguments>;  // those not given are 0

Affine Rotation(double degrees) {
  const double angle = degrees * (std::numbers::pi / 180);
  return {std::cos(angle), std::sin(angle), -std::sin(angle), std::cos(angle), 0, 0};
}

Affine Translation(double x, double y) {
  return {1, 0, 0, 1, x, y};
}

double TangentOf(double degrees) {
  return std::tan(degrees * (std::numbers::pi / 180));
}

struct Function {
  std::string_view name;
  std::array<size_t, 2> counts;  // how many arguments it takes
  Affine (*make)(const Arguments& given, size_t count);
};

constexpr std::array<Function, 6> kFunctions = {{
    {"matrix",
     {6, 6},
     [](const Arguments& m, size_t) { return Affine{m[0], m[1], m[2], m[3], m[4], m[5]}; }},
    {"translate", {1, 2}, [](const Arguments& v, size_t) { return Translation(v[0], v[1]); }},
    {"scale",
     {1, 2},
     [](const Arguments& s, size_t count) {
       return Affine{s[0], 0, 0, count == 1 ? s[0] : s[1], 0, 0};
     }},
    {"rotate",
     {1, 3},
     [](const Arguments& r, size_t) {
       return Translation(r[1], r[2]) * Rotation(r[0]) * Translation(-r[1], -r[2]);
     }},
    {"skewX",
     {1, 1},
     [](const Arguments& s, size_t) { return Affine{1, 0, TangentOf(s[0]), 1, 0, 0}; }},
    {"skewY",
     {1, 1},
     [](const Arguments& s, size_t) { return Affine{1, TangentOf(s[0]), 0, 1, 0, 0}; }},
}};

const Function* Find(std::string_view name) {
  for (const Function& function : kFunctions) {
    if (function.name == name) {
      return &function;
    }
  }
  return nullptr;
}

}  // namespace

Affine operator*(const Affine& outer, const Affine& inner) {
  const Vector origin = outer({inner.e, inner.f});
  return {outer.a * inner.a + outer.c * inner.b,
          outer.b * inner.a + outer.d * inner.b,
          outer.a * inner.c + outer.c * inner.d,
          outer.b * inner.c + outer.d * inner.d,
          origin.x,
          origin.y};
}

bool ParseSvgTransform(std::string_view text, size_t offset, PolylineSink* sink,
                       Affine* transform) {
  SvgScanner scanner(text, offset, sink);
  *transform = {};
  for (scanner.SkipSpace(); !scanner.AtEnd(); scanner.Separator()) {
    const size_t begin = scanner.offset();
    const std::string_view name = scanner.Word();
    const Function* function = Find(name);
    if (function == nullptr) {
      return sink->Fail(begin, Quoted(name.empty() ? text.substr(begin - offset, 1) : name),
                        "matrix, translate, scale, rotate, skewX or skewY");
    }
    scanner.SkipSpace();
    if (!scanner.Skip('(')) {
      return scanner.Fail("\"(\"");
    }
    scanner.SkipSpace();
    Arguments arguments{};
    size_t count = 0;
    for (bool more = true; more; ++count) {
      if (count == kMaxArguments) {
        return scanner.Fail("\")\"");
      }
      if (!scanner.Number(&arguments[count]) || !scanner.More(&more)) {
        return false;
      }
    }
    if (!scanner.Skip(')')) {
      return scanner.Fail("\")\"");
    }
    const auto [least, most] = function->counts;
    if (count != least && count != most) {
      return sink->Fail(begin, std::string(name) + " of " + std::to_string(count) + " numbers",
                        std::to_string(least) +
                            (most == least ? "" : " or " + std::to_string(most)) + " of them");
    }
    *transform = *transform * function->make(arguments, count);
  }
  return true;
}

}  // namespace pheromone::maps
