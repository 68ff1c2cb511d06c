"""The robot's side of the protocol as a program.

    python3 -m pheromone radio-a.pty hello
    python3 -m pheromone radio-a.pty ping DEADBEEF
    python3 -m pheromone radio-a.pty deposit 1 1000 600 1
    python3 -m pheromone radio-a.pty sense 1 1000 500 0
    python3 -m pheromone udp:10.0.0.1:4951,udp:10.0.0.2:4951 sense 1 1000 500 0
    python3 -m pheromone radio-a.pty trace --wide 1 40000 500 16384
    python3 -m pheromone --id 7 --keys robot.keys radio-a.pty hello
"""

from __future__ import annotations

import argparse
import pathlib
import struct
import sys
import termios
import time

from .robot import Client, ErrorAnswer, Intensities, InUse, NoAnswer, next_boot
from .servers import open_line
from .wire import UNIT


def integer(text: str) -> int:
    return int(text, 0)


def arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="pheromone",
        description="Talks the pheromone protocol to a server on a terminal, by TCP or by UDP.",
        usage="%(prog)s [--id N] [--nonce N] [--keys FILE] [--timeout SECONDS] PATH REQUEST ...",
        epilog="Options stand before PATH, but for --wide. "
        "Coordinates are pose units, headings binary angles (65536 to a turn).",
    )
    parser.add_argument(
        "path",
        nargs="?",
        help="the terminal, radio-a.pty for instance, or HOST:PORT for TCP, or udp:HOST:PORT; with "
        "commas between the servers of a cluster",
    )
    parser.add_argument("--id", type=integer, default=1, help="CLIENT_ID, 1 to 254 (default 1)")
    parser.add_argument("--nonce", type=integer, default=1, help="boot counter (default 1)")
    parser.add_argument("--keys", metavar="FILE", type=pathlib.Path,
                        help="the link signs its frames; a line ID KEY has this robot's key, and the "
                        "nonce is counted up in FILE.ID.boots")
    parser.add_argument("--timeout", type=float, default=0.5, help="seconds to wait for an answer")
    requests = parser.add_subparsers(dest="request", metavar="REQUEST")
    requests.add_parser("hello", help="say HELLO and show what the server tells")
    ping = requests.add_parser("ping", help="ask for an echo")
    ping.add_argument("payload", nargs="?", default="", help="up to 16 bytes, hexadecimal")
    for name, fields, what in (
        ("sense", "type x y heading", "what is sensed at a pose"),
        ("trace", "type x y heading", "the same, then leave 1 quantum"),
        ("deposit", "type x y quanta=1", "leave pheromone"),
        ("event", "code argument=0", "report an event"),
    ):
        request = requests.add_parser(name, help=what)
        for field, _, default in (field.partition("=") for field in fields.split()):
            if default:
                request.add_argument(field, type=integer, nargs="?", default=int(default))
            else:
                request.add_argument(field, type=integer)
        if "heading" in fields:
            request.add_argument("--wide", action="store_true", help="coordinates of 32 bits")
    return parser


def key_of(client_id: int, file: pathlib.Path) -> bytes:
    """From lines ID KEY [COMMENT], the key hexadecimal; # begins a comment."""
    for line in file.read_text().splitlines():
        words = line.partition("#")[0].split()
        if len(words) > 1 and words[0] == str(client_id):
            return bytes.fromhex(words[1])
    raise ValueError(f"{file}: no key of robot {client_id}")


def carry_out(options: argparse.Namespace, robot: Client) -> str:
    """Makes the request and gives the answer as text."""
    if options.keys is not None:
        options.nonce = next_boot(f"{options.keys}.{options.id}.boots")
        robot.hello(options.nonce)
    if options.request == "ping":
        started = time.monotonic()
        echo = robot.ping(bytes.fromhex(options.payload))
        return f"echo {echo.hex(' ').upper() or '-'} after {time.monotonic() - started:.4f} s"
    if options.request == "sense":
        return shown(robot.sense(options.type, options.x, options.y, options.heading, options.wide))
    # What changes something needs a HELLO. The nonce stays the same, so the server remembers the
    # last seq of the run before, and this one goes on from there.
    told = robot.hello(options.nonce)
    if options.request == "hello":
        lines = [f"{name} {value}" for name, value in told._asdict().items()]
        return "\n".join((*lines, "types " + " ".join(map(str, told.types))))
    if options.request == "trace":
        return shown(robot.trace(options.type, options.x, options.y, options.heading, options.wide))
    if options.request == "deposit":
        robot.deposit(options.type, options.x, options.y, options.quanta)
        return "deposited"
    robot.event(options.code, options.argument)
    return "acknowledged"


def shown(sensed: Intensities) -> str:
    left, right = sensed
    return f"left {left} right {right} (units: {left / UNIT:g} {right / UNIT:g})"


def main() -> int:
    parser = arguments()
    options = parser.parse_args()
    if options.path is None or options.request is None:
        parser.error("PATH and a request are needed")
    try:
        with open_line(options.path) as line:
            key = None if options.keys is None else key_of(options.id, options.keys)
            print(carry_out(options, Client(line, options.id, options.timeout, key=key)))
    except (ErrorAnswer, InUse, NoAnswer, OSError, OverflowError, ValueError, struct.error,
            termios.error) as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
