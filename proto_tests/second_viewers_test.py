#!/usr/bin/env python3
"""Viewers of a replay beside another one: none is cut off.

    second_viewers_test.py BIN_DIR [COUNT]        default: 1000

One viewer watches a recording all the time. COUNT others come, two at a time, and stay until they
have heard the time three times, which is in three ticks of the server; whoever is hung up on before
that is counted. Who comes before another one's place is free is told so, and comes again.
"""

import os
import pathlib
import socket
import sys
import tempfile
import threading
import time

from checks import check
from operated_daemon import PATIENCE_S, OperatedDaemon, write_config
from test_config import map_of, pheromone, pty, table

CONFIG = (map_of() + pheromone(1, "trail", tau_s=30.0) + pty("radio")
          + table("capture", folder="captures") + table("web", listen="127.0.0.1:0"))
HANDSHAKE = ("GET /replay/{} HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\n"
             "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
             "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
             "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n\r\n")
TIME = 2  # a binary message that begins with this byte
AT_A_TIME = 2  # of four, and the first one


class HungUp(Exception):
    """The server has ended the connection."""


class Full(Exception):
    """There are as many replays as there may be."""


class Viewer:
    def __init__(self, port, name):
        self.socket = socket.create_connection(("127.0.0.1", port), PATIENCE_S)
        self.socket.sendall(HANDSHAKE.format(name).encode())
        self.rest = b""
        while b"\r\n\r\n" not in self.rest:
            self.more()
        head, _, self.rest = self.rest.partition(b"\r\n\r\n")
        if head.startswith(b"HTTP/1.1 503 "):
            raise Full
        check(head.startswith(b"HTTP/1.1 101 "), f"refused: {head}")

    def more(self):
        data = self.socket.recv(65536)
        if not data:
            raise HungUp
        self.rest += data

    def take(self, size):
        while len(self.rest) < size:
            self.more()
        taken, self.rest = self.rest[:size], self.rest[size:]
        return taken

    def message(self):
        head = self.take(2)
        size = head[1]
        if size >= 126:
            size = int.from_bytes(self.take(2 if size == 126 else 8), "big")
        if head[0] & 15 == 8:  # close
            raise HungUp
        return self.take(size)

    def await_times(self, count):
        while count > 0:
            message = self.message()
            count -= message[:1] == bytes((TIME,)) and len(message) == 9


def visit(port, name, left, lock, outcomes):
    while True:
        with lock:
            if not left:
                return
            left.pop()
        outcome = "cut off"
        try:
            viewer = Viewer(port, name)
            viewer.await_times(3)
            viewer.socket.close()
            outcome = "well"
        except Full:
            time.sleep(0.01)
            outcome = "full"
        except (HungUp, ConnectionError):
            pass
        with lock:
            if outcome == "full":
                left.append(None)
            else:
                outcomes.append(outcome)


def main():
    bin_dir = pathlib.Path(sys.argv[1]).resolve()
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 1000
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        write_config(folder, CONFIG)
        daemon = OperatedDaemon(bin_dir, folder)
        try:
            check(daemon.call("POST", "/api/v1/capture", {"action": "start"})[0] == 200, "records")
            check(daemon.call("POST", "/api/v1/paint", {"pheromone": "trail", "all": True})[0] == 200,
                  "paints")
            check(daemon.call("POST", "/api/v1/capture", {"action": "stop"})[0] == 200, "ends")
            name = os.listdir(folder / "captures")[0]
            first = Viewer(daemon.web_port(), name)
            first.await_times(1)
            left, outcomes, lock = [None] * count, [], threading.Lock()
            visitors = [threading.Thread(target=visit,
                                         args=(daemon.web_port(), name, left, lock, outcomes))
                        for _ in range(AT_A_TIME)]
            for visitor in visitors:
                visitor.start()
            for visitor in visitors:
                visitor.join()
            first.await_times(1)
            print(f"{len(outcomes)} second viewers, {outcomes.count('cut off')} cut off")
            check(outcomes == ["well"] * count, "not all of them were well served")
            daemon.stop()
        finally:
            daemon.kill()
    print("ok")


if __name__ == "__main__":
    main()
