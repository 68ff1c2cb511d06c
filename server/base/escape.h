// Text of others made safe to print. A name with an escape sequence in it would otherwise move the
// cursor, rename the terminal or hide what follows, and one with a bidirectional control would read
// as another name.
//
//   EscapeControls("lab\x1b[2J")      // R"(lab\u001b[2J)"
//
// Pure; any thread.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace pheromone {

/// `text` with each control character as \uXXXX: C0, DEL, C1, and the controls of bidirectional
/// text (U+061C, U+200E, U+200F, U+202A to U+202E, U+2066 to U+2069). What is not UTF-8 becomes
/// \ufffd, one for each maximal part of a sequence (Unicode 15, section 3.9), as browsers show it.
/// In a string of JSON that is the same text, so that JSON stays valid. `kept` lists the C0
/// controls that stay.
std::string EscapeControls(std::string_view text, std::string_view kept = "\n");

/// How many bytes at the end of `text` are the start of a character whose rest may follow: 0 to 3.
size_t UnfinishedAtEnd(std::string_view text);

}  // namespace pheromone
