"""What a server answers over HTTP, and why it refuses."""

from __future__ import annotations

import json
from typing import Any, NoReturn


class Refused(Exception):
    """The server's refusal: the HTTP `status`, `what` it found, `where`, and what was `expected`."""

    def __init__(self, status: int, what: str, where: str = "", expected: str = "") -> None:
        text = (where + ": " if where else "") + what
        super().__init__(text + (", expected " + expected if expected else ""))
        self.status = status
        self.what = what
        self.where = where
        self.expected = expected


class ProtocolError(Exception):
    """What answers is not pheromoned, or the stream or recording is damaged."""


def from_json(content: bytes) -> Any:
    try:
        return json.loads(content)
    except ValueError as problem:
        raise ProtocolError(f"no valid JSON: {problem}") from problem


def raise_refusal(status: int, content: bytes) -> NoReturn:
    try:
        error = json.loads(content)["error"]
        refusal = Refused(status, error["what"], error["where"], error["expected"])
    except (ValueError, KeyError, TypeError):
        raise ProtocolError(f"HTTP status {status} without a reason") from None
    raise refusal
