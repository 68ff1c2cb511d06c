// A PNML file as a tree of XML, and errors that say on which line of it something is wrong.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <pugixml.hpp>

namespace pheromone::nets {

class PnmlSource {
 public:
  PnmlSource(std::string_view name, std::string_view text);

  /// Parses UTF-8, or ISO-8859-1 if the file says so. Entities of a DTD are not expanded.
  bool Parse();

  const pugi::xml_document& document() const { return document_; }
  const std::string& error() const { return error_; }

  /// Sets the error "NAME:LINE: found FOUND, expected EXPECTED"; returns false.
  bool Fail(const pugi::xml_node& at, const std::string& found, std::string_view expected);

 private:
  bool FailAt(size_t offset, const std::string& found, std::string_view expected);

  std::string name_;
  std::string text_;
  pugi::xml_document document_;
  std::string error_;
};

}  // namespace pheromone::nets
