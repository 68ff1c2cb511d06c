#!/usr/bin/env python3
"""What deploy/run and deploy/test say before they install packages: with an apt-get that only tells.

    lib_test.py
"""

import pathlib
import subprocess
import tempfile
import unittest

LIB = pathlib.Path(__file__).resolve().parent / "lib.sh"

# "there" is installed. What apt-get is asked to do is written to a file.
DPKG_QUERY = """#!/bin/sh
case "$*" in *there) printf installed ;; *) exit 1 ;; esac
"""
APT_GET = """#!/bin/sh
echo "$*" >>"$ASKED"
case "$*" in
  *--simulate*)
    echo 'Inst libnew (1.0 Debian:12/stable [amd64])'
    echo 'Inst libold [252.1] (252.39-1~deb12u2 Debian:12/stable [amd64])'
    echo 'Conf libold (252.39-1~deb12u2 Debian:12/stable [amd64])' ;;
  *" install "*) echo 'apt-get installs' ;;
esac
"""


class InstallPackagesTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.asked = self.folder / "asked"
        for name, text in (("dpkg-query", DPKG_QUERY), ("apt-get", APT_GET),
                           ("sudo", '#!/bin/sh\nexec "$@"\n')):
            (self.folder / name).write_text(text)
            (self.folder / name).chmod(0o755)

    def install(self, *packages):
        (self.folder / "list").write_text("".join(f"{it}   # why\n" for it in packages))
        result = subprocess.run(
            ["bash", "-c", f'source {LIB}; PATH="{self.folder}:$PATH" install_packages "$1"',
             "test", self.folder / "list"],
            text=True, capture_output=True, check=False,
            env={"PATH": "/usr/bin:/bin", "ASKED": str(self.asked)})
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        return result.stdout

    def test_what_is_upgraded_is_told_before_anything_is_installed(self):
        self.assertEqual(self.install("there", "new-dev"), """\
To be installed, with what they depend on: new-dev
They need newer versions of these installed packages, which are upgraded:
  libold 252.1 -> 252.39-1~deb12u2
apt-get installs
""")
        asked = self.asked.read_text().splitlines()
        self.assertEqual([line.split()[-3:] for line in asked[1:]],
                         [["install", "--no-install-recommends", "new-dev"]] * 2)
        self.assertIn("--simulate", asked[1])
        self.assertNotIn("--simulate", asked[2])

    def test_nothing_is_touched_if_all_is_there(self):
        self.assertEqual(self.install("there"), "")
        self.assertFalse(self.asked.exists())


if __name__ == "__main__":
    unittest.main()
