"""What the checks say, and how they fail."""

from __future__ import annotations

import time

PATIENCE_S = 60.0
"""Until the daemon is given up; only ever waited for if something is wrong."""

STARTED = time.monotonic()


def log(text: str) -> None:
    print(f"{time.monotonic() - STARTED:6.2f} s  {text}", flush=True)


def check_equal(got: object, expected: object, what: str) -> None:
    assert got == expected, f"{what}: got {got}, expected {expected}"
