#!/usr/bin/env python3
"""Every #include goes downward, as the tables in CONTRIBUTING.md say.

    include_direction_test.py [--root DIR]   check the project; exit status 1 if something is wrong
    include_direction_test.py --self-test    check that the check can fail

Read from CONTRIBUTING.md: the table "layer | may include" and the table "word | stands for". Only
what stands in `backticks` counts; the rest is for people. A token is one of
  folder or file     `server/core/field`, `server/core/engine/control.h`
  header             `<stdint.h>`
  word               `asio`, a row of the second table; `std` is the standard library
  `anything`         no restriction
A layer may always include itself. The row of `*_test.cc` and `testing/` says what tests may include
besides what their layer may; only tests include from a folder testing/.
"""

import argparse
import fnmatch
import pathlib
import re
import sys

TOP_FOLDERS = ("protocol", "client_fw", "server", "proto_tests")
SUFFIXES = (".h", ".hpp", ".cc", ".cpp", ".c")
ANYTHING = "anything"
STD = "std"
STD_CXX = """algorithm any array atomic barrier bit bitset cassert ccomplex cctype cerrno cfenv
    cfloat charconv chrono cinttypes climits clocale cmath codecvt compare complex concepts
    condition_variable coroutine csetjmp csignal cstdarg cstddef cstdint cstdio cstdlib cstring
    ctime cuchar cwchar cwctype deque exception execution filesystem format forward_list fstream
    functional future initializer_list iomanip ios iosfwd iostream istream iterator latch limits
    list locale map memory memory_resource mutex new numbers numeric optional ostream queue random
    ranges ratio regex scoped_allocator semaphore set shared_mutex source_location span sstream
    stack stdexcept stop_token streambuf string string_view strstream syncstream system_error
    thread tuple type_traits typeindex typeinfo unordered_map unordered_set utility valarray
    variant vector version"""
STD_C = """assert ctype errno fenv float inttypes limits locale math setjmp signal stdalign
    stdarg stdatomic stdbool stddef stdint stdio stdlib string time uchar wchar wctype"""
STANDARD_HEADERS = {f"<{n}>" for n in STD_CXX.split()} | {f"<{n}.h>" for n in STD_C.split()}

INCLUDE = re.compile(r"\s*#\s*include\b\s*(.*)")
TARGET = re.compile(r'(<[^>]+>|"[^"]+")')


class TableError(Exception):
    """CONTRIBUTING.md itself is wrong."""


def table_rows(markdown, first_heading):
    """The rows of the table whose header row begins with `first_heading`, as lists of cells."""
    rows = None
    for line in markdown.splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if not line.strip().startswith("|"):
            if rows is not None:
                break
        elif rows is not None:
            rows.append(cells)
        elif cells[0] == first_heading:
            rows = []
    if rows is None or len(rows) < 2 or any(len(row) != 2 for row in rows):
        raise TableError(f'no table of two columns beginning with "{first_heading}" was found')
    return rows[1:]  # without the ruler


def tokens(cell):
    return re.findall(r"`([^`]+)`", cell)


def is_test(path):
    return path.endswith("_test.cc") or "/testing/" in path


class Rules:
    """The two tables."""

    def __init__(self, markdown):
        self.words = {}  # word -> patterns of headers
        self.layers = {}  # folder -> what it may include
        self.planned = set()
        self.test_extras = set()
        for name, meaning in table_rows(markdown, "word"):
            self.words[tokens(name)[0]] = [t for t in tokens(meaning) if t.startswith("<")]
        for name, allowed in table_rows(markdown, "layer"):
            allowed = set(tokens(allowed))
            for layer in tokens(name):
                if "*" in layer or layer.endswith("/"):
                    self.test_extras |= allowed
                    continue
                if layer in self.layers:
                    raise TableError(f"layer {layer} stands in the table twice")
                self.layers[layer] = allowed
                if "planned" in name:
                    self.planned.add(layer)
        self._check()

    def _check(self):
        for layer, allowed in self.layers.items():
            for token in allowed:
                self._check_token(layer, token)
        for token in self.test_extras:
            self._check_token("tests", token)
        done = set()
        for layer in self.layers:
            self._check_acyclic(layer, [], done)

    def _check_token(self, layer, token):
        known = token == ANYTHING or token.startswith("<") or token in self.words
        if not known and self.layer_of(token) is None:
            raise TableError(f"{layer}: `{token}` is no layer, no header and no word of the table")

    def _check_acyclic(self, layer, above, done):
        if layer in above:
            circle = " -> ".join(above[above.index(layer):] + [layer])
            raise TableError(f"the layers include each other in a circle: {circle}")
        if layer in done:
            return
        for token in sorted(self.layers[layer]):
            below = None if token in self.words else self.layer_of(token)
            if below not in (None, layer):
                self._check_acyclic(below, above + [layer], done)
        done.add(layer)

    def layer_of(self, path):
        """The layer with the longest name that contains `path`."""
        around = [l for l in self.layers if path == l or path.startswith(l + "/")]
        return max(around, key=len, default=None)

    def word_of(self, header):
        for word, patterns in self.words.items():
            if any(fnmatch.fnmatchcase(header, pattern) for pattern in patterns):
                return word
        return STD if header in STANDARD_HEADERS else None

    def objection(self, path, target):
        """Why the file `path` may not include `target` (<x> or "x"), or None."""
        layer = self.layer_of(path)
        allowed = self.layers[layer] | (self.test_extras if is_test(path) else set())
        if target.startswith("<"):
            return self._header_objection(layer, allowed, target)
        included = target.strip('"')
        if included.split("/")[0] not in TOP_FOLDERS:
            return "an include in quotes is relative to the project's root"
        other = self.layer_of(included)
        if other is None:
            return "it belongs to no layer of the table"
        if "/testing/" in included and not is_test(path) and ANYTHING not in allowed:
            return "only tests include from a folder testing/"
        # The name of a folder does not permit a layer inside it.
        inside = any(other == self.layer_of(t) and (included == t or included.startswith(t + "/"))
                     for t in allowed)
        if other == layer or inside or ANYTHING in allowed:
            return None
        return f"{layer} may not include {other}"

    def _header_objection(self, layer, allowed, header):
        if header in allowed or ANYTHING in allowed:
            return None
        word = self.word_of(header)
        if word is None:
            return "no word of the table stands for this header"
        return None if word in allowed else f"{layer} may not include {word}"


def includes_of(text):
    """(line number, what is included) of a source text."""
    for number, line in enumerate(text.splitlines(), start=1):
        directive = INCLUDE.match(line)
        if directive:
            yield number, directive.group(1).strip()


def check_text(rules, path, text):
    """The errors of one source file, as "path:line: message"."""
    if rules.layer_of(path) is None:
        return [f"{path}:1: this folder belongs to no layer of the table in CONTRIBUTING.md"]
    wrong = []
    for number, rest in includes_of(text):
        target = TARGET.match(rest)
        if target is None:
            wrong.append(f"{path}:{number}: #include {rest}: not a plain file name")
            continue
        reason = rules.objection(path, target.group(1))
        if reason:
            wrong.append(f"{path}:{number}: #include {target.group(1)}: {reason}")
    return wrong


def check_project(root):
    rules = Rules((root / "CONTRIBUTING.md").read_text(encoding="utf-8"))
    wrong = []
    files = sorted(p for top in TOP_FOLDERS for p in (root / top).rglob("*")
                   if p.suffix in SUFFIXES and p.is_file())
    for file in files:
        path = file.relative_to(root).as_posix()
        wrong += check_text(rules, path, file.read_text(encoding="utf-8"))
        if rules.layer_of(path) in rules.planned:
            wrong.append(f"{path}:1: this folder exists; CONTRIBUTING.md still calls it planned")
    for line in wrong:
        print(line)
    print(f"{len(files)} files, {len(wrong)} wrong" if files else "no sources found")
    return 1 if wrong or not files else 0


# Separate tables, so that the self-test does not depend on the project's present layers.
SAMPLE = """
| layer | may include |
|---|---|
| `protocol` | `<stdint.h>` only |
| `server/core/field` | `std` |
| `server/core/field/bench` | `server/core/field`, `std`, `clock` |
| `server/core/engine` | `server/core/field`, `protocol`, `std` |
| `server/operators/web` (planned) | `server/core/engine/control.h`, `asio`, `clock` |
| `proto_tests` | `anything` |
| tests: `*_test.cc`, `testing/` | `std`, `gtest`, `protocol/testing` |

| word | stands for |
|---|---|
| `std` | the standard library |
| `clock` | `<chrono>` |
| `asio` | `<boost/asio.hpp>` `<boost/asio/*>` |
| `gtest` | `<gtest/*>` |
"""

# file, what it includes, part of the objection (None: allowed)
SAMPLES = (
    ("protocol/frame.h", "<stdint.h>", None),
    ("protocol/frame.h", "<vector>", "protocol may not include std"),
    ("protocol/frame.h", '"server/core/field/map.h"', "protocol may not include server/core/field"),
    ("protocol/frame.h", "<mystery.h>", "no word"),
    ("protocol/frame_test.cc", "<vector>", None),
    ("protocol/frame_test.cc", "<gtest/gtest.h>", None),
    ("protocol/frame_test.cc", '"protocol/testing/vectors.h"', None),
    ("protocol/frame_test.cc", '"proto_tests/peer.h"', "may not include proto_tests"),
    ("protocol/testing/vectors.h", "<fstream>", None),
    ("protocol/frame.cc", '"protocol/testing/vectors.h"', "only tests"),
    ("protocol/frame.cc", "<gtest/gtest.h>", "may not include gtest"),
    ("server/core/field/map.h", "<array>  // why", None),
    ("server/core/field/map.h", "<chrono>", "may not include clock"),
    ("server/core/field/map.h", "<boost/asio/read.hpp>", "may not include asio"),
    ("server/core/field/map.cc", '"map.h"', "relative to the project's root"),
    ("server/core/field/map.cc", "<protocol/frame.h>", "no word"),
    ("server/core/field/map.cc", '"server/core/engine/engine.h"', "may not include server/core/engine"),
    ("server/core/field/map.cc", "SOME_MACRO", "not a plain file name"),
    ("server/core/field/map_test.cc", '"protocol/frame.h"', "may not include protocol"),
    ("server/core/field/map_test.cc", '"protocol/testing/vectors.h"', None),
    ("server/core/field/bench/tables.cc", '"server/core/field/map.h"', None),
    ("server/core/field/bench/tables.cc", "<chrono>", None),
    ("server/core/field/map.cc", '"server/core/field/bench/tables.h"', "may not include server/core/field/bench"),
    ("server/core/engine/engine.cc", '"server/core/field/bench/tables.h"', "may not include server/core/field/b"),
    ("server/core/engine/engine.cc", '"server/core/field/map.h"', None),
    ("server/core/engine/engine.cc", '"server/fieldwork/map.h"', "no layer"),
    ("server/core/engine/engine.cc", '"proto_tests/peer.h"', "may not include proto_tests"),
    ("server/operators/web/api/api.cc", '"server/core/engine/control.h"', None),
    ("server/operators/web/api/api.cc", '"server/core/engine/engine.h"', "may not include server/core/engine"),
    ("server/operators/web/api/api.cc", "<boost/asio.hpp>", None),
    ("server/stray.cc", "<vector>", "belongs to no layer"),
    ("proto_tests/peer.cc", "<mystery.h>", None),
    ("proto_tests/peer.cc", '"protocol/testing/vectors.h"', None),
)

BAD_TABLES = (
    ("no layer, no header", SAMPLE.replace("`protocol`, `std`", "`protocl`, `std`")),
    ("twice", SAMPLE.replace("| `server/operators/web`", "| `protocol`")),
    ("in a circle", SAMPLE.replace("| `server/core/field` | `std` |",
                                   "| `server/core/field` | `server/core/engine` |")),
    ("no table", SAMPLE.replace("| layer |", "| shelf |")),
)


def self_test():
    failures = []
    rules = Rules(SAMPLE)
    for path, included, expected in SAMPLES:
        wrong = check_text(rules, path, f"// a comment\n  # include {included}\n")
        right = not wrong if expected is None else len(wrong) == 1 and expected in wrong[0]
        if not right:
            failures.append(f"{path} including {included}: expected {expected!r}, got {wrong}")
    for expected, markdown in BAD_TABLES:
        try:
            Rules(markdown)
            failures.append(f"a table that is wrong ({expected}) was taken")
        except TableError as error:
            if expected not in str(error):
                failures.append(f"a wrong table: expected {expected!r}, got {error}")
    for failure in failures:
        print(failure)
    print(f"self-test: {len(SAMPLES) + len(BAD_TABLES)} cases, {len(failures)} failed")
    return 1 if failures else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--root", type=pathlib.Path,
                        default=pathlib.Path(__file__).resolve().parent.parent)
    parser.add_argument("--self-test", action="store_true")
    arguments = parser.parse_args()
    if arguments.self_test:
        return self_test()
    try:
        return check_project(arguments.root)
    except TableError as error:
        print(f"CONTRIBUTING.md: {error}")
        return 1


if __name__ == "__main__":
    sys.exit(main())
