#!/usr/bin/env python3
"""Every #include goes downward, as the tables in CONTRIBUTING.md say, and none is missing.

    include_test.py [--root DIR]   check the project; exit status 1 if something is wrong
    include_test.py --self-test    check that the check can fail

Read from CONTRIBUTING.md: the table "room | what lives there | may include" and the table "word |
stands for". Only what stands in `backticks` in the first and the last column counts; the rest is for
people. A token of the last column is one of
  folder or file     `server/core`, with all that is in it; `server/net/certificate.h`
  header             `<stdint.h>`
  word               `asio`, a row of the second table; `std` is the standard library
  `anything`         no restriction
A room may always include itself. The row of `*_test.cc` and `testing/` says what tests may include
besides what their room may; only tests include from a folder testing/. A permission that no file
uses is an error, and so are rooms that include each other in a circle.

An include is missing if a file names a type that one header of ours defines, or something of the
standard library, and neither the file nor a header that it includes has it. Unity builds and
precompiled headers hide that.
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
    """The rows of the table whose header row begins with `first_heading`: first and last cell."""
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
    if rows is None or len(rows) < 2:
        raise TableError(f'no table beginning with "{first_heading}" was found')
    return [(row[0], row[-1]) for row in rows[1:]]  # without the ruler


def tokens(cell):
    return re.findall(r"`([^`]+)`", cell)


def is_test(path):
    return path.endswith("_test.cc") or "/testing/" in path


class Rules:
    """The two tables."""

    def __init__(self, markdown):
        self.words = {}  # word -> patterns of headers
        self.layers = {}  # folder -> what it may include
        self.test_extras = set()
        for name, meaning in table_rows(markdown, "word"):
            self.words[tokens(name)[0]] = [t for t in tokens(meaning) if t.startswith("<")]
        for name, allowed in table_rows(markdown, "room"):
            allowed = set(tokens(allowed))
            for layer in tokens(name):
                if "*" in layer or layer.endswith("/"):
                    self.test_extras |= allowed
                    continue
                if layer in self.layers:
                    raise TableError(f"layer {layer} stands in the table twice")
                self.layers[layer] = allowed
        self._check()

    def _check(self):
        for layer, allowed in self.layers.items():
            for token in allowed:
                self._check_token(layer, token)
        for token in self.test_extras:
            self._check_token("tests", token)
        self.used = set()  # (layer, token)

    def _check_token(self, layer, token):
        known = (token == ANYTHING or token.startswith("<") or token in self.words
                 or self.layer_of(token) is not None
                 or any(l.startswith(token + "/") for l in self.layers))
        if not known:
            raise TableError(f"{layer}: `{token}` is no room, no header and no word of the table")

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
        if target.startswith("<"):
            word = self.word_of(target)
            if self._permits(layer, path, lambda t: t in (target, word)):
                return None
            if word is None:
                return "no word of the table stands for this header"
            return f"{layer} may not include {word}"
        included = target.strip('"')
        if included.split("/")[0] not in TOP_FOLDERS:
            return "an include in quotes is relative to the project's root"
        other = self.layer_of(included)
        if other is None:
            return "it belongs to no room of the table"
        if "/testing/" in included and not is_test(path) and ANYTHING not in self.layers[layer]:
            return "only tests include from a folder testing/"
        if other == layer:
            return None
        # Benchmarks are no part of the room that they measure.
        if self._permits(layer, path, lambda t: included == t or included.startswith(t + "/")
                         and ("/bench/" not in included or "/bench" in t)):
            return None
        return f"{layer} may not include {other}"

    def _permits(self, layer, path, fits):
        for token in self.layers[layer]:
            if token == ANYTHING or fits(token):
                self.used.add((layer, token))
                return True
        return is_test(path) and any(fits(token) for token in self.test_extras)

    def unused(self):
        return sorted((layer, token) for layer, allowed in self.layers.items()
                      for token in allowed if (layer, token) not in self.used)


def includes_of(text):
    """(line number, what is included) of a source text."""
    for number, line in enumerate(text.splitlines(), start=1):
        directive = INCLUDE.match(line)
        if directive:
            yield number, directive.group(1).strip()


def check_text(rules, path, text):
    """The errors of one source file, as "path:line: message"."""
    if rules.layer_of(path) is None:
        return [f"{path}:1: this folder belongs to no room of the table in CONTRIBUTING.md"]
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


def circle(edges):
    """Rooms that include each other in a circle, "a -> b -> a", or None. `edges`: room -> rooms."""
    done = set()

    def visit(room, above):
        if room in above:
            return " -> ".join(above[above.index(room):] + [room])
        if room not in done:
            for below in sorted(edges.get(room, ())):
                found = visit(below, above + [room])
                if found:
                    return found
            done.add(room)
        return None

    for room in sorted(edges):
        found = visit(room, [])
        if found:
            return found
    return None


# What is missed most. A header that defines more than one name stands with each.
STD_NAMES = {
    "<algorithm>": "sort stable_sort find_if any_of all_of none_of clamp max_element min_element "
                   "lower_bound upper_bound remove_if transform",
    "<array>": "array", "<atomic>": "atomic", "<deque>": "deque", "<filesystem>": "filesystem",
    "<functional>": "function", "<map>": "map multimap", "<memory>": "unique_ptr shared_ptr make_unique "
    "make_shared weak_ptr", "<mutex>": "mutex lock_guard unique_lock scoped_lock",
    "<optional>": "optional nullopt", "<random>": "mt19937 mt19937_64 uniform_int_distribution",
    "<set>": "set multiset", "<span>": "span", "<sstream>": "ostringstream istringstream stringstream",
    "<fstream>": "ifstream ofstream", "<string>": "string to_string", "<string_view>": "string_view",
    "<thread>": "thread", "<tuple>": "tuple tie", "<unordered_map>": "unordered_map",
    "<variant>": "variant visit get_if holds_alternative", "<vector>": "vector",
}
STD_HEADER_OF = {name: header for header, names in STD_NAMES.items() for name in names.split()}
STD_USE = re.compile(r"\bstd::(\w+)")
DEFINITION = re.compile(r"^(?:template\s*<[^;{]*>\s*)?(?:class|struct|enum(?:\s+class)?|union)\s+"
                        r"(?:\[\[\w+\]\]\s*)?([A-Z]\w+)(?:\s+final)?\s*(?::[^:;{][^;{]*)?\{|"
                        r"^using\s+([A-Z]\w+)\s*=", re.MULTILINE)
DECLARED = re.compile(r"\b(?:class|struct|enum|union|typename|using|concept)\s+(?:class\s+)?(?:\w+::)*([A-Z]\w+)")
CALLABLE = re.compile(r"\b([A-Z]\w+)\s*[(;=,{)]")
NAMESPACE = re.compile(r"^namespace\s+([\w:]+)", re.MULTILINE)
NAME = re.compile(r"(?<![\w:])((?:\w+::)*)([A-Z]\w+)\b(?=\s*[\w&*<>{]|::)")
NOT_CODE = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'', re.DOTALL)


class Sources:
    """The texts of the project, without comments and strings, and what each file has included."""

    def __init__(self, texts):
        self.direct = {}
        for path, text in texts.items():
            targets = {m.group(1) for _, rest in includes_of(text) if (m := TARGET.match(rest))}
            self.direct[path] = {t.strip('"') for t in targets}
        self.code = {path: NOT_CODE.sub(" ", re.sub(r"^\s*#\s*include.*$", "", text, flags=re.M))
                     for path, text in texts.items()}
        self.defined = {path: {a or b for a, b in DEFINITION.findall(code)}
                        for path, code in self.code.items()}
        self.named = {path: set(DECLARED.findall(code)) | set(CALLABLE.findall(code))
                      for path, code in self.code.items()}
        self.namespaces = {path: set(NAMESPACE.findall(code)) for path, code in self.code.items()}
        headers_of = {}
        for path, names in self.defined.items():
            for name in names:
                headers_of.setdefault(name, set()).add(path)
        # Names that one header defines, and no other file.
        self.header_of = {name: next(iter(paths)) for name, paths in headers_of.items()
                          if len(paths) == 1 and next(iter(paths)).endswith(".h")}

    def reached(self, path):
        """The file itself and all that it includes, directly or not."""
        seen, todo = set(), [path]
        while todo:
            at = todo.pop()
            if at not in seen:
                seen.add(at)
                todo += self.direct.get(at, ())
        return seen

    def visible(self, qualifier, header, path):
        """Whether what `header` defines is what `path` names so."""
        theirs, ours = self.namespaces[header], self.namespaces[path]
        if qualifier:
            return any(name.split("::")[-1] == qualifier.split("::")[-2] for name in theirs)
        return not theirs or any(our == name or our.startswith(name + "::")
                                 for our in ours for name in theirs)

    def missing(self, path):
        """What should be included in `path`, as (name, header)."""
        reached = self.reached(path)
        code = self.code[path]
        found = set()
        for name in set(STD_USE.findall(code)):
            header = STD_HEADER_OF.get(name)
            if header and header not in reached:
                found.add((f"std::{name}", header))
        known = set().union(*(self.named.get(p, set()) for p in reached if p != path))
        known |= set(DECLARED.findall(code))
        for qualifier, name in set(NAME.findall(code)):
            header = self.header_of.get(name)
            if not header or header in reached or name in known:
                continue
            if self.visible(qualifier, header, path):
                found.add((name, f'"{header}"'))
        return sorted(found)


def check_project(root):
    rules = Rules((root / "CONTRIBUTING.md").read_text(encoding="utf-8"))
    wrong = []
    texts = {p.relative_to(root).as_posix(): p.read_text(encoding="utf-8") for top in TOP_FOLDERS
             for p in sorted((root / top).rglob("*")) if p.suffix in SUFFIXES and p.is_file()}
    sources = Sources(texts)
    edges = {}
    for path, text in texts.items():
        wrong += check_text(rules, path, text)
        wrong += [f"{path}:1: {name} is used, but {header} is not included"
                  for name, header in sources.missing(path)]
        if not is_test(path) and "/bench/" not in path:
            edges.setdefault(room_of(path), set()).update(
                room_of(t) for t in sources.direct[path] if not t.startswith("<"))
    for room in edges:
        edges[room].discard(room)
    if circular := circle(edges):
        wrong.append(f"rooms include each other in a circle: {circular}")
    wrong += [f"CONTRIBUTING.md: nothing in {layer} includes `{token}`: take the permission out"
              for layer, token in rules.unused()]
    for line in wrong:
        print(line)
    print(f"{len(texts)} files, {len(wrong)} wrong" if texts else "no sources found")
    return 1 if wrong or not texts else 0


def room_of(path):
    """server/core/field/x/y.h -> server/core/field; server/base/file.h -> server/base."""
    parts = path.split("/")[:-1]
    deep = parts[:2] in (["server", "core"], ["server", "store"], ["server", "formats"],
                         ["server", "robots"], ["server", "operators"], ["client_fw", "core"])
    return "/".join(parts[:3 if deep else 2])


# Separate tables, so that the self-test does not depend on the project's present layers.
SAMPLE = """
| room | what lives there | may include |
|---|---|---|
| `protocol` | the wire | `<stdint.h>` only |
| `server/core/field` | the map | `std` |
| `server/core/field/bench` | its benchmarks | `server/core/field`, `std`, `clock` |
| `server/core/engine` | `service/` too | `server/core/field`, `protocol`, `std` |
| `server/operators/web` | HTTP | `server/core/engine/control.h`, `asio`, `clock` |
| `server/daemon` | the program | `server/core`, `std` |
| `proto_tests` | whole programs | `anything` |
| `*_test.cc`, `testing/` | tests | `std`, `gtest`, `protocol/testing` |

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
    ("server/core/field/bench/plot.cc", '"server/core/field/map.h"', None),
    ("server/core/field/bench/plot.cc", "<chrono>", None),
    ("server/core/field/map.cc", '"server/core/field/bench/plot.h"', "may not include server/core/field/bench"),
    ("server/core/engine/engine.cc", '"server/core/field/bench/plot.h"', "may not include server/core/field/b"),
    ("server/core/engine/engine.cc", '"server/core/field/map.h"', None),
    ("server/core/engine/engine.cc", '"server/fieldwork/map.h"', "no room"),
    ("server/core/engine/service/service.cc", '"server/core/engine/engine.h"', None),
    ("server/daemon/main.cc", '"server/core/engine/engine.h"', None),
    ("server/daemon/main.cc", '"server/operators/web/server.h"', "may not include server/operators/web"),
    ("server/core/engine/engine.cc", '"proto_tests/peer.h"', "may not include proto_tests"),
    ("server/operators/web/api/api.cc", '"server/core/engine/control.h"', None),
    ("server/operators/web/api/api.cc", '"server/core/engine/engine.h"', "may not include server/core/engine"),
    ("server/operators/web/api/api.cc", "<boost/asio.hpp>", None),
    ("server/stray.cc", "<vector>", "belongs to no room"),
    ("proto_tests/peer.cc", "<mystery.h>", None),
    ("proto_tests/peer.cc", '"protocol/testing/vectors.h"', None),
)

BAD_TABLES = (
    ("no room, no header", SAMPLE.replace("`protocol`, `std`", "`protocl`, `std`")),
    ("twice", SAMPLE.replace("| `server/operators/web`", "| `protocol`")),
    ("no table", SAMPLE.replace("| room |", "| shelf |")),
)

# The texts of a small project: what is missing in the last file.
MISSING = (
    ({"a/map.h": "class Map {\n};", "a/use.cc": "Map Make();"}, [("Map", '"a/map.h"')]),
    ({"a/map.h": "class Map {\n};", "a/use.cc": '#include "a/map.h"\nMap Make();'}, []),
    ({"a/map.h": "class Map {\n};", "b/all.h": '#include "a/map.h"',
      "a/use.cc": '#include "b/all.h"\nMap Make();'}, []),
    ({"a/map.h": "class Map {\n};", "a/use.cc": "class Map;\nMap* Make();"}, []),
    ({"a/map.h": "class Map {\n};", "a/use.cc": '// Map is\nconst char* k = "Map x";'}, []),
    ({"a/map.h": "class Map {\n};", "b/map.h": "struct Map {\n};", "a/use.cc": "Map Make();"}, []),
    ({"a/use.cc": "std::vector<int> v;"}, [("std::vector", "<vector>")]),
    ({"a/map.h": "#include <vector>", "a/use.cc": '#include "a/map.h"\nstd::vector<int> v;'}, []),
)
CIRCLES = (({"a": {"b"}, "b": {"c"}, "c": set()}, None),
           ({"a": {"b"}, "b": {"c"}, "c": {"a"}}, "a -> b -> c -> a"))


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
    if ("server/operators/web", "clock") not in rules.unused():
        failures.append("a permission that nothing uses was not found")
    for texts, expected in MISSING:
        missing = Sources(texts).missing(list(texts)[-1])
        if missing != expected:
            failures.append(f"missing in {texts}: expected {expected}, got {missing}")
    for edges, expected in CIRCLES:
        if circle(edges) != expected:
            failures.append(f"circle in {edges}: expected {expected}, got {circle(edges)}")
    for failure in failures:
        print(failure)
    cases = len(SAMPLES) + len(BAD_TABLES) + 1 + len(MISSING) + len(CIRCLES)
    print(f"self-test: {cases} cases, {len(failures)} failed")
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
