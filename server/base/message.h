// How to say where in a file something is wrong.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "server/base/result.h"

namespace pheromone {

/// "NAME: byte N: WHAT", counting from 0, for formats without lines.
Error AtByte(std::string_view name, size_t offset, std::string_view what);

/// "NAME:LINE: WHAT" or "NAME:LINE:COLUMN: WHAT", counting from 1; column 0 = not known.
Error AtLine(std::string_view name, size_t line, size_t column, std::string_view what);

/// What was found in a file, for a message: in quotes, cut off after `longest` bytes, and printable
/// whatever it was.
std::string Quoted(std::string_view found, size_t longest = 32);

/// Removes the byte order mark that some editors put before UTF-8. Error: it is that of UTF-16 or
/// UTF-32; whoever reads the file adds where.
Status SkipByteOrderMark(std::string_view* text);

}  // namespace pheromone
