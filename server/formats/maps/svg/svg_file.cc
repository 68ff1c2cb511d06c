#include "server/formats/maps/svg/svg_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <utility>

#include <pugixml.hpp>

#include "server/base/format.h"
#include "server/base/message.h"
#include "server/base/text.h"
#include "server/formats/maps/polyline_sink.h"
#include "server/formats/maps/svg/svg_scanner.h"
#include "server/formats/maps/svg/svg_shape.h"
#include "server/formats/maps/svg/svg_transform.h"

namespace pheromone::maps {
namespace {

constexpr size_t kMaxDepth = 64;
constexpr std::ptrdiff_t kMaxTags = 1'000'000;
constexpr double kMetresToUm = 1e6;

constexpr std::string_view kSpace = " \t\n\r\f";

// The value of a property in a `style` attribute; empty if it is not there.
std::string_view StyleProperty(std::string_view style, std::string_view name) {
  std::string_view value;
  while (!style.empty()) {
    const size_t end = std::min(style.find(';'), style.size());
    const std::string_view declaration = style.substr(0, end);
    const size_t colon = declaration.find(':');
    if (colon != std::string_view::npos && Trim(declaration.substr(0, colon), kSpace) == name) {
      value = Trim(declaration.substr(colon + 1), kSpace);
    }
    style.remove_prefix(std::min(end + 1, style.size()));
  }
  return value;
}

class DrawingReader {
 public:
  DrawingReader(const SvgOptions& options, const SvgSource& source, PolylineSink* sink)
      : options_(options), source_(source), sink_(*sink) {}

  bool Read(const pugi::xml_document& document) {
    const pugi::xml_node root = document.document_element();
    const std::string_view name = root.name();
    const size_t colon = name.rfind(':');
    prefix_ = colon == std::string_view::npos ? "" : name.substr(0, colon + 1);
    if (LocalName(root) != "svg") {
      return sink_.Fail(source_.OffsetOf(root), Quoted(name), "the root element <svg>");
    }
    Affine to_um;
    if (!ReadViewport(root, &to_um)) {
      return false;
    }
    if (options_.id.empty()) {
      return DrawChildren(root, to_um, 1);
    }
    return DrawSelected(document, root, to_um);
  }

 private:
  // The name without the root's prefix; empty if it is not an element of SVG.
  std::string_view LocalName(const pugi::xml_node& node) const {
    std::string_view name = node.name();
    if (node.type() != pugi::node_element || !name.starts_with(prefix_)) {
      return {};
    }
    name.remove_prefix(prefix_.size());
    return name.find(':') == std::string_view::npos ? name : std::string_view();
  }

  bool ReadViewport(const pugi::xml_node& root, Affine* to_um) {
    double min_x = 0;
    double bottom = 0;
    if (const auto box = source_.Find(root, "viewBox")) {
      SvgScanner scanner(box->text, box->offset, &sink_);
      std::array<double, 4> numbers{};
      scanner.SkipSpace();
      for (size_t i = 0; i < numbers.size(); ++i) {
        if ((i > 0 && !scanner.Separator()) || !scanner.Number(&numbers[i])) {
          return false;
        }
      }
      scanner.SkipSpace();
      if (!scanner.AtEnd() || !(numbers[2] > 0) || !(numbers[3] > 0)) {
        return sink_.Fail(box->offset, Quoted(box->text),
                          "a viewBox of min-x, min-y and a positive width and height");
      }
      min_x = numbers[0];
      bottom = numbers[1] + numbers[3];
    } else if (const auto height = source_.Find(root, "height")) {
      if (!ParseSvgLength(*height, &sink_, &bottom)) {
        return false;
      }
    } else {
      return sink_.Fail(source_.OffsetOf(root), "no viewBox and no height",
                        "one of them, to know where the drawing's lower edge is");
    }
    if (const auto transform = source_.Find(root, "transform")) {
      return sink_.Fail(transform->offset, "a transform of the root", "one of a <g> inside of it");
    }
    const double um = options_.metres_per_unit * kMetresToUm;
    *to_um = {um, 0, 0, -um, -um * min_x, um * bottom};
    return true;
  }

  bool DrawChildren(const pugi::xml_node& parent, const Affine& to_um, size_t depth) {
    for (const pugi::xml_node& child : parent.children()) {
      if (!IsHidden(child) && !Draw(child, to_um, depth)) {
        return false;
      }
    }
    return true;
  }

  // An element, `depth` elements below the document; `outer` is its parent's map.
  bool Draw(const pugi::xml_node& node, const Affine& outer, size_t depth) {
    const std::string_view name = LocalName(node);
    if (name == "use" || name == "switch" || name == "svg") {
      return sink_.Fail(source_.OffsetOf(node), '<' + std::string(name) + '>',
                        "the shapes themselves, in place (in Inkscape: Unlink Clone, Ungroup)");
    }
    const bool group = name == "g" || name == "a";
    if (!group && !IsSvgShape(name)) {
      return true;
    }
    if (depth > kMaxDepth) {
      return FailTooDeep(node);
    }
    Affine to_um;
    if (!ReadTransform(node, outer, &to_um)) {
      return false;
    }
    if (group) {
      return DrawChildren(node, to_um, depth + 1);
    }
    SvgPen pen(to_um, static_cast<double>(options_.tolerance_um), &sink_);
    return DrawSvgShape(name, node, source_, &sink_, &pen);
  }

  bool DrawSelected(const pugi::xml_document& document, const pugi::xml_node& root,
                    const Affine& to_um) {
    const pugi::xml_node selected = document.find_node(
        [this](const pugi::xml_node& node) { return options_.id == node.attribute("id").value(); });
    if (!selected) {
      return sink_.Fail(source_.OffsetOf(root), "no element with the id " + Quoted(options_.id),
                        "one that has it");
    }
    if (selected == root) {
      return DrawChildren(root, to_um, 1);
    }
    const std::string_view name = LocalName(selected);
    if (name != "g" && name != "a" && !IsSvgShape(name)) {
      return sink_.Fail(source_.OffsetOf(selected),
                        '<' + std::string(selected.name()) + "> with the id " + Quoted(options_.id),
                        "a group or a shape");
    }
    std::vector<pugi::xml_node> around;
    for (pugi::xml_node node = selected.parent(); node != root; node = node.parent()) {
      around.push_back(node);
      if (around.size() >= kMaxDepth) {
        return FailTooDeep(selected);
      }
    }
    std::reverse(around.begin(), around.end());  // from the root inwards
    Affine outer = to_um;
    for (const pugi::xml_node& node : around) {
      if (!ReadTransform(node, outer, &outer)) {
        return false;
      }
    }
    return Draw(selected, outer, around.size() + 1);
  }

  bool ReadTransform(const pugi::xml_node& node, const Affine& outer, Affine* to_um) {
    const auto style = source_.Find(node, "style");
    if (style && !StyleProperty(style->text, "transform").empty()) {
      return sink_.Fail(style->offset, "a transform in a style", "an attribute transform=\"...\"");
    }
    Affine own;
    const auto attribute = source_.Find(node, "transform");
    if (attribute && !ParseSvgTransform(attribute->text, attribute->offset, &sink_, &own)) {
      return false;
    }
    *to_um = outer * own;
    return true;
  }

  // A style takes precedence over an attribute (SVG 1.1, section 6.4).
  bool IsHidden(const pugi::xml_node& node) const {
    const std::string_view styled = StyleProperty(node.attribute("style").value(), "display");
    return (styled.empty() ? std::string_view(node.attribute("display").value()) : styled) ==
           "none";
  }

  bool FailTooDeep(const pugi::xml_node& node) {
    return sink_.Fail(source_.OffsetOf(node), "elements nested too deep",
                      "at most " + std::to_string(kMaxDepth));
  }

  const SvgOptions& options_;
  const SvgSource& source_;
  PolylineSink& sink_;
  std::string_view prefix_;  // of SVG's elements, with its colon
};

bool Read(const SvgOptions& options, PolylineSink* sink) {
  const std::string_view text = sink->text();
  // The library's tree needs 64 bytes per tag.
  if (std::count(text.begin(), text.end(), '<') > kMaxTags) {
    return sink->Fail(0, "more than " + std::to_string(kMaxTags) + " tags", "a smaller drawing");
  }
  std::string buffer(text);
  pugi::xml_document document;
  // Without parse_eol and parse_wconv_attribute, which would change the positions of values.
  const pugi::xml_parse_result parsed = document.load_buffer_inplace(
      buffer.data(), buffer.size(), pugi::parse_cdata | pugi::parse_escapes, pugi::encoding_utf8);
  if (!parsed) {
    const size_t at =
        std::min(text.size(), static_cast<size_t>(std::max<std::ptrdiff_t>(0, parsed.offset)));
    return sink->Fail(at, sink->Found(at), std::string("XML (") + parsed.description() + ")");
  }
  const SvgSource source{buffer.data()};
  return DrawingReader(options, source, sink).Read(document);
}

}  // namespace

Result<std::vector<Polyline>> ParseSvgLines(std::string_view text, std::string_view name,
                                            const SvgOptions& options) {
  if (!std::isfinite(options.metres_per_unit) || !(options.metres_per_unit > 0)) {
    return Error{std::string(name) + ": found " + FormatNumber(options.metres_per_unit) +
                 " metres a user unit, expected a positive number"};
  }
  if (options.tolerance_um < 1) {
    return Error{std::string(name) + ": found a tolerance of " +
                 std::to_string(options.tolerance_um) + " um, expected at least 1"};
  }
  PolylineSink sink(text, name);
  if (!sink.failed()) {
    try {
      Read(options, &sink);
    } catch (const std::exception& error) {  // such as no memory
      sink.Fail(0, error.what(), "a drawing that can be read");
    }
  }
  return std::move(sink).Take();
}

}  // namespace pheromone::maps
