"""Tables: structured arrays of NumPy; without NumPy, lists of named tuples with the same fields.

    found = server.robots_as_array()
    found["x_m"].mean()                    # with NumPy
    [robot.x_m for robot in found]         # without
"""

from __future__ import annotations

import collections
from collections.abc import Sequence
from typing import Any

numpy: Any = None
try:
    import numpy
except ImportError:
    pass

_DTYPES = {"i": "i8", "d": "f8", "?": "?"}


def table(fields: str, kinds: str, rows: Sequence[tuple[Any, ...]]) -> Any:
    """A row for each tuple. A letter of `kinds` for each field: d a double, i an integer, U a text,
    ? a truth value."""
    names = fields.split()
    if numpy is None:
        row = collections.namedtuple("row", names)  # type: ignore[misc]
        return [row(*it) for it in rows]
    widths = [max((len(it[i]) for it in rows), default=1) if kind == "U" else 0
              for i, kind in enumerate(kinds)]
    return numpy.array(list(rows), dtype=[
        (name, f"U{max(width, 1)}" if kind == "U" else _DTYPES[kind])
        for name, kind, width in zip(names, kinds, widths)])
