#!/usr/bin/env python3
"""The robots' keys in a file, as pheromonectl keys makes, lists, revokes and exports them.

    keys_test.py build/release/bin/pheromonectl
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

PHEROMONECTL = ""
PATIENCE_S = 60
EEPROM = 0x200  # where the firmware of AVR boards reads its key


def crc16(data):
    """CRC-16/ARC, bit by bit."""
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return crc


def intel_hex(text):
    """The bytes of each address. Asserts that the format is right."""
    memory = {}
    lines = text.splitlines()
    assert lines[-1] == ":00000001FF", lines
    for line in lines[:-1]:
        record = bytes.fromhex(line.removeprefix(":"))
        assert line.startswith(":") and sum(record) % 256 == 0, line
        assert record[0] == len(record) - 5 and record[3] == 0, line
        begin = int.from_bytes(record[1:3], "big")
        memory.update({begin + i: byte for i, byte in enumerate(record[4:-1])})
    return memory


class KeysTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.file = self.folder / "robots.keys"

    def ctl(self, *arguments, status=0):
        """Its output, or what it says if it fails."""
        result = subprocess.run([PHEROMONECTL, "keys", *map(str, arguments)], cwd=self.folder,
                                text=True, capture_output=True, timeout=PATIENCE_S, check=False)
        self.assertEqual(result.returncode, status, result)
        self.assertEqual(result.stdout if status else result.stderr, "")
        return result.stderr if status else result.stdout

    def keys(self):
        """By ID, as they stand in the file."""
        found = re.findall(r"(?m)^(\d+) ([0-9a-f]{32})(?: |$)", self.file.read_text())
        return {int(robot): bytes.fromhex(key) for robot, key in found}

    def mode(self, path):
        return os.stat(path).st_mode & 0o7777

    def test_new_keys_are_random_and_their_owners_only(self):
        said = self.ctl("new", 7, 8, 254, "--file", "robots.keys")
        self.assertEqual(said, "3 new in robots.keys; a running server takes it with: "
                               "pheromonectl reload\n")
        first = self.keys()
        self.assertEqual(set(first), {7, 8, 254})
        self.assertEqual(len(set(first.values())), 3)
        self.assertEqual(self.mode(self.file), 0o600)
        self.ctl("new", 9, "--file", "robots.keys")
        self.assertEqual({it: key for it, key in self.keys().items() if it != 9}, first)
        self.assertEqual(os.listdir(self.folder), ["robots.keys"])

    def test_no_key_is_replaced(self):
        self.ctl("new", 7, "--file", "robots.keys")
        before = self.file.read_text()
        self.assertEqual(self.ctl("new", 8, 7, "--file", "robots.keys", status=1),
                         "pheromonectl: robots.keys:2: robot 7 has a key, expected a robot "
                         "without: revoke it first for another\n")
        self.ctl("new", 9, 9, "--file", "robots.keys", status=1)
        self.assertEqual(self.file.read_text(), before)

    def test_the_list_has_ids_and_comments_and_no_keys(self):
        self.ctl("new", 12, 7, "--file", "robots.keys")
        self.file.write_text(self.file.read_text().replace("12 ", "# blue\n12 ") + "# end\n")
        text = self.file.read_text()
        line = re.search(r"(?m)^7 .*$", text)[0]
        self.file.write_text(text.replace(line, line + "  the red\x1b[2J one"))
        self.assertEqual(self.ctl("list", "--file", "robots.keys").split("\n"),
                         ["ID  COMMENT", "7   the red\\u001b[2J one", "12", ""])

    def test_revoking_takes_the_robots_line_only(self):
        self.file.write_text("# ours\n7 " + "0" * 31 + "7 red\n\n8 " + "0" * 31 + "8 # blue\n")
        self.file.chmod(0o600)
        self.assertEqual(self.ctl("revoke", 8, 9, "--file", "robots.keys", status=1),
                         "pheromonectl: robots.keys: robot 9 has no key, expected one of those of "
                         "pheromonectl keys list --file robots.keys\n")
        self.assertEqual(set(self.keys()), {7, 8})
        self.assertIn("1 revoked in robots.keys; ", self.ctl("revoke", 7, "--file", "robots.keys"))
        self.assertEqual(self.file.read_text(), "# ours\n\n8 " + "0" * 31 + "8 # blue\n")
        self.assertEqual(self.mode(self.file), 0o600)

    def test_a_key_is_exported_in_each_format(self):
        self.ctl("new", 7, 8, "--file", "robots.keys")
        key = self.keys()[8]
        self.assertEqual(self.ctl("export", 8, "--file", "robots.keys", "--robot", "r.key",
                                  "--eeprom", "r.hex", "--header", "key.h"), "")
        for name in ("r.key", "r.hex", "key.h"):
            self.assertEqual(self.mode(self.folder / name), 0o600, name)
        self.assertEqual((self.folder / "r.key").read_text(), key.hex() + "\n")
        check = (crc16(key) ^ 0xFFFF).to_bytes(2, "little")
        self.assertEqual(intel_hex((self.folder / "r.hex").read_text()),
                         {EEPROM + i: byte for i, byte in enumerate(key + check)})
        (self.folder / "a.cc").write_text(
            '#include "key.h"\n#include "key.h"\n#include <stdio.h>\nint main() {\n'
            '  for (const uint8_t byte : pheromone_key) printf("%02x", byte);\n}\n')
        subprocess.run(["g++", "-Wall", "-Wextra", "-Werror", "-o", "a", "a.cc"], cwd=self.folder,
                       check=True)
        self.assertEqual(subprocess.check_output([self.folder / "a"], text=True), key.hex())

    def test_what_cannot_be_exported_is_told(self):
        self.ctl("new", 7, "--file", "robots.keys")
        self.assertEqual(self.ctl("export", 7, "--file", "robots.keys", status=2),
                         "pheromonectl: expected at least one of --robot, --eeprom and --header\n")
        self.assertIn("robot 8 has no key",
                      self.ctl("export", 8, "--file", "robots.keys", "--robot", "k", status=1))
        self.assertIn("none/k.new0: cannot be created",
                      self.ctl("export", 7, "--file", "robots.keys", "--robot", "none/k", status=1))

    def test_a_key_does_not_replace_the_file_with_the_keys(self):
        self.ctl("new", 7, 8, "--file", "robots.keys")
        before = self.file.read_text()
        (self.folder / "link").symlink_to("robots.keys")
        for option in ("--robot", "--eeprom", "--header"):
            self.assertEqual(self.ctl("export", 7, "--file", "link", option, "robots.keys", status=2),
                             "pheromonectl: robots.keys: the output is the input link, expected "
                             "another name\n")
        self.assertEqual(self.file.read_text(), before)

    def test_a_file_that_others_may_read_is_refused(self):
        self.ctl("new", 7, "--file", "robots.keys")
        self.file.chmod(0o640)
        before = self.file.read_text()
        for command in (("new", 8), ("list",), ("revoke", 7), ("export", 7, "--robot", "k")):
            self.assertEqual(self.ctl(*command, "--file", "robots.keys", status=1),
                             "pheromonectl: robots.keys: others than its owner may read it or "
                             "change it, expected mode 0600: chmod 600 robots.keys\n")
        self.assertEqual(self.file.read_text(), before)

    def test_changes_at_the_same_time_are_all_kept(self):
        self.ctl("new", *range(101, 111), "--file", "robots.keys")

        def begun(command, robot):
            return subprocess.Popen([PHEROMONECTL, "keys", command, str(robot), "--file",
                                     self.file.name], cwd=self.folder, stdout=subprocess.DEVNULL)
        processes = [begun("new", robot) for robot in range(1, 31)]
        processes += [begun("revoke", robot) for robot in range(101, 111)]
        self.assertEqual({it.wait(PATIENCE_S) for it in processes}, {0})
        self.assertEqual(set(self.keys()), set(range(1, 31)))
        self.assertEqual(os.listdir(self.folder), ["robots.keys"])

    def test_without_a_file_a_server_is_asked(self):
        result = subprocess.run([PHEROMONECTL, "--socket", "none.sock", "keys", "revoke", "8"],
                                cwd=self.folder, text=True, capture_output=True, check=False)
        self.assertEqual((result.returncode, result.stdout), (3, ""))
        self.assertIn("none.sock", result.stderr)

    def test_ids_are_those_of_robots(self):
        for robot in ("0", "255", "x"):
            self.assertIn(f'found "{robot}", expected a whole number from 1 to 254',
                          self.ctl("new", robot, "--file", "robots.keys", status=2))
        self.ctl("new", "--file", "robots.keys", status=2)
        self.assertFalse(self.file.exists())


if __name__ == "__main__":
    PHEROMONECTL = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
