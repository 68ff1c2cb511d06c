#!/usr/bin/env python3
"""The stream with the client library of the viewers themselves, from npm:
stream_npm_test.py BIN_DIR FOLDER     FOLDER: where npm installs it"""

import pathlib
import shutil
import subprocess
import sys
import tempfile

from operated_daemon import TOKEN, OperatedDaemon, write_config
from test_config import map_of, pheromone, pty, table

HERE = pathlib.Path(__file__).parent / "stream"
CONFIG = (map_of() + pheromone(1, "trail", tau_s=30.0) + pty("a")
          + table("web", listen="127.0.0.1:0", token_file="token"))


def install(folder):
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("package.json", "package-lock.json", "viewer.mjs"):
        shutil.copy(HERE / name, folder / name)
    subprocess.run(["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"], cwd=folder,
                   check=True, stdout=subprocess.DEVNULL)


def main():
    bin_dir, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    install(folder)
    with tempfile.TemporaryDirectory() as place:
        place = pathlib.Path(place)
        write_config(place, CONFIG)
        daemon = OperatedDaemon(bin_dir, place)
        try:
            subprocess.run(["node", "viewer.mjs", f"ws://127.0.0.1:{daemon.web_port()}/", TOKEN],
                           cwd=folder, check=True, timeout=daemon.patience_s)
        finally:
            daemon.stop()


if __name__ == "__main__":
    main()
