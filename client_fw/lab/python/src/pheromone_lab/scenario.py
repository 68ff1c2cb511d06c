"""Scenarios that are made in Python, as the TOML that pheromone-swarm lab reads."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _entry(key: str, value: Any) -> str:
    name = key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _text(key)
    return f"{name} = {value_to_toml(value)}"


def value_to_toml(value: Any) -> str:
    """Numbers and arrays of NumPy are numbers and lists."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (bool, int, float)):
        text = repr(value)
        return text.lower() if isinstance(value, bool) else text
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, Mapping):
        return "{" + ", ".join(_entry(key, it) for key, it in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        # A line may have 16 KiB, so what is long has many.
        return "[" + (", " if len(value) <= 8 else ",\n  ").join(map(value_to_toml, value)) + "]"
    raise TypeError(f"a scenario cannot have a {type(value).__name__}: {value!r}")


def to_toml(scenario: Mapping[str, Any]) -> str:
    """The text of a scenario's file: {"map": {...}, "robots": [{...}, {...}]} as [map] and [[robots]].

    Write it to a file, and pheromone-swarm lab run has the same world. It has at most 1 MiB, some 25 000 robots
    with starts of their own; count and area_m have no such limit.
    """
    lines = []
    for name, content in scenario.items():
        tables = content if isinstance(content, (list, tuple)) else [content]
        heading = f"[[{name}]]" if tables is content else f"[{name}]"
        for table in tables:
            if not isinstance(table, Mapping):
                raise TypeError(f"{name}: expected a dict, or a list of them, not {table!r}")
            lines += [heading, *(_entry(key, it) for key, it in table.items()), ""]
    return "\n".join(lines)
