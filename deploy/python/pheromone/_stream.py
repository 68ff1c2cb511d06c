"""The live stream: a WebSocket (RFC 6455) that speaks the viewer's side of foxglove.websocket.v1."""

from __future__ import annotations

import base64
import hashlib
import http.client
import json
import os
import re
import socket
import struct
from collections.abc import Collection, Iterator
from typing import Any, NamedTuple

from ._answers import ProtocolError, from_json, raise_refusal

SUBPROTOCOL = "foxglove.websocket.v1"
MAX_MESSAGE_BYTES = 64 << 20  # of the stream; longer ones are an error


class Message(NamedTuple):
    """A message of the stream. `value` is what its JSON says, and bytes on channels with another
    encoding; `time_ns` is nanoseconds since 1970."""

    topic: str
    time_ns: int
    value: Any


class Stream:
    """Takes over a connection that is not open yet."""

    _TEXT, _BINARY, _CLOSE, _PING, _PONG = 1, 2, 8, 9, 10
    _ACCEPT = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"

    def __init__(self, connection: http.client.HTTPConnection, token: str | None,
                 timeout_s: float | None) -> None:
        self._token = token
        self._connection = connection
        self._connection.connect()
        self._socket: socket.socket = self._connection.sock
        self._input = self._socket.makefile("rb")
        try:
            self._shake_hands()
        except BaseException:
            self._close()
            raise
        self._socket.settimeout(timeout_s)

    def __enter__(self) -> Stream:
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self._send(self._CLOSE, b"\x03\xe8")
        except OSError:
            pass  # it is gone already
        self._close()

    def messages(self, wanted: Collection[str]) -> Iterator[Message]:
        topics: dict[int, str] = {}  # by subscription
        json_channels: set[int] = set()
        next_subscription = 1
        for is_text, payload in self._payloads():
            if is_text:
                message = from_json(payload)
                operation = message.get("op")
                if operation == "advertise":
                    new = [it for it in message["channels"]
                           if (it["topic"] in wanted if wanted else it["encoding"] == "json")]
                    subscriptions = []
                    for channel in new:
                        topics[next_subscription] = channel["topic"]
                        if channel["encoding"] == "json":
                            json_channels.add(next_subscription)
                        subscriptions.append({"id": next_subscription, "channelId": channel["id"]})
                        next_subscription += 1
                    if subscriptions:
                        self._send(self._TEXT, json.dumps({
                            "op": "subscribe", "subscriptions": subscriptions}).encode())
                elif operation == "status" and message.get("level") == 2:
                    raise ProtocolError("the server says: " + message.get("message", ""))
            elif len(payload) >= 13 and payload[0] == 1:
                subscription, time_ns = struct.unpack_from("<IQ", payload, 1)
                if subscription in topics:
                    content = payload[13:]
                    yield Message(topics[subscription], time_ns, from_json(content)
                                  if subscription in json_channels else content)

    def _shake_hands(self) -> None:
        key = base64.b64encode(os.urandom(16))
        host = self._connection.host
        host = "[" + host + "]" if ":" in host else host
        if self._connection.port != self._connection.default_port:
            host += ":{}".format(self._connection.port)
        lines = ["GET / HTTP/1.1", "Host: " + host, "Connection: Upgrade", "Upgrade: websocket",
                 "Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: " + key.decode(),
                 "Sec-WebSocket-Protocol: " + SUBPROTOCOL]
        if self._token:
            lines.append("Authorization: Bearer " + self._token)
        self._socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        status, headers = self._read_head()
        if status != 101:
            length = headers.get("Content-Length", "0")
            if not length.isdecimal() or len(length) > 18:
                raise ProtocolError(f"Content-Length {length!r}, expected a number of bytes")
            raise_refusal(status, self._input.read(min(int(length), MAX_MESSAGE_BYTES)))
        expected = base64.b64encode(hashlib.sha1(key + self._ACCEPT).digest()).decode()
        if headers.get("Sec-WebSocket-Accept") != expected:
            raise ProtocolError("what answers is no WebSocket server")

    def _read_head(self) -> tuple[int, http.client.HTTPMessage]:
        """The status and the headers of the answer to the handshake."""
        line = self._input.readline(1024)
        if not line:
            raise ConnectionError("the server closed the connection before it answered the "
                                  "WebSocket handshake")
        match = re.match(rb"HTTP/1\.([01]) (\d{3})\s", line)
        if not match or match.groups() == (b"0", b"101"):  # which HTTP/1.0 does not have
            raise ProtocolError(f"{line!r}, expected HTTP/1.1 and a status")
        try:
            return int(match[2]), http.client.parse_headers(self._input)
        except http.client.HTTPException as problem:
            raise ProtocolError(f"no valid HTTP headers: {problem}") from problem

    def _payloads(self) -> Iterator[tuple[bool, bytes]]:
        """Whether it is text, and the bytes, of each whole message until the server closes."""
        opcode: int | None = None
        message = b""
        while True:
            head = self._input.read(2)
            if len(head) < 2:
                return
            length = head[1] & 0x7F
            if length > 125:
                length, = struct.unpack(*((">H", self._read(2)) if length == 126
                                          else (">Q", self._read(8))))
            kind = head[0] & 0x0F
            if head[1] & 0x80 or head[0] & 0x70 or len(message) + length > MAX_MESSAGE_BYTES:
                raise ProtocolError("an invalid WebSocket frame: {}".format(head.hex()))
            payload = self._read(length)
            if kind == self._CLOSE:
                return
            if kind == self._PING:
                self._send(self._PONG, payload)
            if kind >= 8:
                continue
            if (kind == 0) == (opcode is None):
                raise ProtocolError("a WebSocket message that begins in another")
            opcode = kind or opcode
            message += payload
            if head[0] & 0x80:
                yield opcode == self._TEXT, message
                opcode, message = None, b""

    def _read(self, count: int) -> bytes:
        data = self._input.read(count)
        if len(data) < count:
            raise ProtocolError("the stream ended in the middle of a message")
        return data

    def _send(self, kind: int, payload: bytes) -> None:
        mask = os.urandom(4)
        size = len(payload)
        head = bytes([0x80 | kind]) + (bytes([0x80 | size]) if size < 126
                                       else struct.pack(">BH", 0x80 | 126, size) if size < 1 << 16
                                       else struct.pack(">BQ", 0x80 | 127, size))
        masked = bytes(byte ^ mask[i % 4] for i, byte in enumerate(payload))
        self._socket.sendall(head + mask + masked)

    def _close(self) -> None:
        self._input.close()
        self._connection.close()

    def interrupt(self) -> None:
        """From another thread: whoever waits for a message finds the end of the stream."""
        try:
            self._socket.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass  # it is gone already
