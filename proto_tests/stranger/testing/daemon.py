"""Starts pheromoned and ends it."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

from ..client import NoAnswer
from .report import PATIENCE_S
from .setups import Setup


class Daemon:
    """pheromoned in a directory of its own; ends with the `with` block, whatever happens."""

    def __init__(self, program: Path, directory: Path, setup: Setup) -> None:
        self.directory = directory
        config = directory / "pheromoned.toml"
        config.write_text(setup.toml(), encoding="utf-8")
        self._log = directory / "pheromoned.log"
        with self._log.open("wb") as output:
            self.process = subprocess.Popen(
                (str(program), "--config", str(config)),
                cwd=directory,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
            )

    def path(self, link: str) -> Path:
        return self.directory / f"{link}.pty"

    def check_alive(self, when: str) -> None:
        status = self.process.poll()
        assert status is None, f"the daemon ended with status {status} {when}\n{self.output()}"

    def output(self) -> str:
        text = self._log.read_text(encoding="utf-8", errors="replace")
        return "the daemon wrote:\n" + "\n".join(text.splitlines()[-30:])

    def wait_for(self, link: str) -> Path:
        """Waits until the link's terminal is there."""
        path = self.path(link)
        deadline = time.monotonic() + PATIENCE_S
        while not path.exists():
            self.check_alive(f"before {path.name} was there")
            assert time.monotonic() < deadline, f"no {path.name}\n{self.output()}"
            time.sleep(0.01)
        assert path.is_symlink(), f"{path.name} is no symbolic link"
        return path

    def stop(self, setup: Setup) -> None:
        """SIGTERM: exit status 0, and the terminals' names are gone."""
        self.check_alive("before it was told to")
        self.process.send_signal(signal.SIGTERM)
        try:
            status = self.process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"SIGTERM does not end the daemon\n{self.output()}") from None
        assert status == 0, f"exit status {status} after SIGTERM\n{self.output()}"
        for link in setup.links:
            assert not self.path(link).is_symlink(), f"{link}.pty is still there after the end"

    def __enter__(self) -> Daemon:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        if isinstance(error, NoAnswer | OSError | AssertionError):
            print(self.output(), file=sys.stderr)
