"""Reads protocol/vectors (section 14)."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

FOLDER = Path(__file__).resolve().parents[3] / "protocol" / "vectors"


TAG_ROW = ("tag", "dx", "dy", "generation")  # the lists of SCAN's answer


class Frame(NamedTuple):
    name: str
    body: bytes | None  # None where the wire holds no such thing
    wire: bytes
    verdict: str


class Stream(NamedTuple):
    name: str
    data: bytes
    delivered: list[bytes]


def rows(file: str) -> list[list[str]]:
    """The lines of a file, each as its columns."""
    lines = (FOLDER / file).read_text(encoding="utf-8").splitlines()
    found = [
        [column.strip() for column in line.split("|")]
        for line in lines
        if line and not line.startswith("#")
    ]
    assert found, f"{file} is empty"
    return found


def from_hex(text: str) -> bytes:
    return b"" if text == "-" else bytes.fromhex(text)


def value_of(message: str, key: str, text: str) -> bytes | int | list[int]:
    """A field of fields.txt."""
    if key in ("payload", "text"):
        return from_hex(text)
    if message == "SCAN_ANSWER" and key in TAG_ROW:
        return [int(one) for one in text.split(",") if one != "-"]
    if message == "ROUND" and key in ("left", "right", "turns"):
        return [int(one) for one in text.split(",") if one != "-"]
    return int(text)


def frames() -> dict[str, Frame]:
    """By name."""
    return {
        name: Frame(name, None if body == "-" else from_hex(body), from_hex(wire), verdict)
        for name, body, wire, verdict in rows("frames.txt")
    }


def streams() -> list[Stream]:
    return [
        Stream(name, from_hex(data), [from_hex(part) for part in parts.split(";") if part != "-"])
        for name, data, parts in rows("streams.txt")
    ]
