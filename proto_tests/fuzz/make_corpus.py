#!/usr/bin/env python3
"""Makes seeds for the fuzzers from the protocol's vectors and the default configuration.

Usage: make_corpus.py DIR      writes DIR/decoder/, DIR/engine/, DIR/config/
"""

import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]


def frames():
    """(name, body or None, wire) of each frame vector."""
    for line in (ROOT / "protocol/vectors/frames.txt").read_text(encoding="ascii").splitlines():
        if line and not line.startswith("#"):
            name, body, wire, _ = (column.strip() for column in line.split("|"))
            yield name, None if body == "-" else bytes.fromhex(body), bytes.fromhex(wire)


def main(folder):
    for fuzzer in ("decoder", "engine", "config"):
        (folder / fuzzer).mkdir(parents=True, exist_ok=True)
    hello = bytes.fromhex("01 71 2A 00 01 00")
    for name, body, wire in frames():
        # decoder: the gap timeout, then a pause before each byte.
        timed = bytes([20]) + b"".join(bytes([1, byte]) for byte in wire)
        (folder / "decoder" / name).write_bytes(timed)
        # engine: pause, DATA length, ID, OPCODE, DATA; after a HELLO of the same robot.
        if body is not None and body[1] < 0x80 and len(body) <= 2 + 19:
            records = [bytes([1, len(it) - 2]) + it for it in (body[:1] + hello[1:], body, body)]
            (folder / "engine" / name).write_bytes(b"".join(records))
    default = (ROOT / "server/config/default.toml").read_bytes()
    (folder / "config" / "default").write_bytes(default)
    plain = [line.split(b"#")[0].strip() for line in default.splitlines()]
    (folder / "config" / "plain").write_bytes(b"\n".join(line for line in plain if line))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
