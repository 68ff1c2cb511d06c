"""A client of pheromoned's HTTP interface and its live stream, for scripts and notebooks.

    import pheromone

    server = pheromone.Server("http://127.0.0.1:8377", token="...")
    server.paint("path", [(1, 1), (4, 1)], radius_m=0.1)
    print(server.sense("path", x_m=2, y_m=1.05, heading_deg=0))
    level = server.map_as_array("path").at(2, 1)

    camera = pheromone.Tracker("127.0.0.1:4960")      # [[tracker]] of the configuration
    camera.pose("radio-a", 7, x_m=2.35, y_m=0.9, heading_deg=90)

    for message in server.watch("/clients", "/events"):
        print(message.topic, message.value)

One file, for Python 3.8 or newer. It needs nothing but the standard library; arrays are NumPy's if
NumPy is installed. Lengths are metres, times seconds, headings degrees counter-clockwise from +x,
and pheromone is in units, unless a name says otherwise.

With https:// a certificate that the system does not trust needs Server(..., cafile="lab.pem").
Reading needs no token. Changes need the server's token, or its Unix socket:
Server("pheromoned.sock"). A refusal raises Refused, which says what the server found, where, and
what it expected; a server that cannot be reached raises OSError. A Server may be shared by threads:
each request has a connection of its own.
"""

import base64
import collections
import hashlib
import http.client
import io
import json
import math
import os
import socket
import ssl
import struct
import urllib.parse

try:
    import numpy
except ImportError:
    numpy = None

__all__ = ["Server", "Tracker", "Map", "Sensed", "Message", "Refused", "ProtocolError"]

DEFAULT_ADDRESS = "http://127.0.0.1:8377"
SUBPROTOCOL = "foxglove.websocket.v1"
MAX_MESSAGE_BYTES = 64 << 20  # of the stream; longer ones are an error

Sensed = collections.namedtuple("Sensed", "left right")
Sensed.__doc__ = "What the two antennas of a robot sense, in units."

Message = collections.namedtuple("Message", "topic time_ns value")
Message.__doc__ = """A message of the stream. `value` is what its JSON says, and bytes on channels
with another encoding; `time_ns` is nanoseconds since 1970."""


class Refused(Exception):
    """The server's refusal: the HTTP `status`, `what` it found, `where`, and what was `expected`."""

    def __init__(self, status, what, where="", expected=""):
        text = (where + ": " if where else "") + what
        super().__init__(text + (", expected " + expected if expected else ""))
        self.status = status
        self.what = what
        self.where = where
        self.expected = expected


class ProtocolError(Exception):
    """What answers is not pheromoned, or the stream is damaged."""


class Map:
    """The levels of one pheromone.

    values        levels in units, the top row first, as pictures have it; NaN where an obstacle is.
                  A NumPy array of doubles, or a list of lists without NumPy
    pheromone     its name; `maximum`: the most that a node can hold
    origin_m      (x, y) of the lower left corner of the lower left cell
    cell_m        the side of a cell
    field_time_s  the time of these levels on the server's clock of evaporation
    """

    def __init__(self, values, facts):
        self.values = values
        self.pheromone = facts["pheromone"]
        self.maximum = facts["maximum"]
        self.origin_m = tuple(facts["origin_m"])
        self.cell_m = facts["cell_m"]
        self.field_time_s = facts["field_time_s"]
        self.rows = len(values)
        self.columns = len(values[0])

    @property
    def extent(self):
        """(left, right, bottom, top) in metres, for matplotlib: imshow(map.values,
        extent=map.extent)."""
        x, y = self.origin_m
        return (x, x + self.columns * self.cell_m, y, y + self.rows * self.cell_m)

    def at(self, x_m, y_m):
        """The level at a place. Raises IndexError off the map."""
        column = math.floor((x_m - self.origin_m[0]) / self.cell_m)
        row = math.floor((y_m - self.origin_m[1]) / self.cell_m)
        if not (0 <= column < self.columns and 0 <= row < self.rows):
            raise IndexError("({}, {}) is off the map".format(x_m, y_m))
        return self.values[self.rows - 1 - row][column]

    def place(self, row, column):
        """(x, y) in metres of the centre of the cell values[row][column]."""
        return (self.origin_m[0] + (column + 0.5) * self.cell_m,
                self.origin_m[1] + (self.rows - row - 0.5) * self.cell_m)


class _UnixConnection(http.client.HTTPConnection):
    def __init__(self, path, timeout):
        super().__init__("localhost", timeout=timeout)
        self._path = path

    def connect(self):
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.settimeout(self.timeout)
        self.sock.connect(self._path)


class Server:
    """A running pheromoned.

    address       "http://HOST:PORT", "https://HOST:PORT", or the path of the server's Unix socket
    token         authorizes changes; token_file: a file with it, as `web.token_file` of the
                  configuration. Not needed for a Unix socket
    timeout_s     of one request
    cafile        a file in PEM with the authority that signed the server's certificate, or with the
                  certificate itself; by default the authorities that the system trusts
    """

    def __init__(self, address=DEFAULT_ADDRESS, token=None, token_file=None, timeout_s=30,
                 cafile=None):
        if token_file is not None:
            with open(token_file, encoding="ascii") as file:
                token = file.read().strip()
        self._token = token
        self._timeout = timeout_s
        url = urllib.parse.urlsplit(address)
        self._unix = None if url.scheme in ("http", "https") else address
        self._tls = ssl.create_default_context(cafile=cafile) if url.scheme == "https" else None
        self._host = url.hostname
        self._port = url.port

    # Reading

    def status(self, with_hash=False):
        """The state of the server as a whole, as `pheromonectl status --json`."""
        return self.get("status", hash=1 if with_hash else None)

    def clients(self):
        """The robots: a list of dictionaries with link, id, pose, goal and more."""
        return self.get("clients")["clients"]

    def links(self):
        return self.get("links")["links"]

    def laws(self):
        """The map, the antennas and the pheromones."""
        return self.get("laws")

    def tags(self, with_contents=False):
        """All virtual RFID tags."""
        found, first = [], 1
        while first is not None:
            page = self.get("tags", first=first, contents=1 if with_contents else None)
            found += page["tags"]
            first = page["next"]
        return found

    def nets(self):
        return self.get("nets")["nets"]

    def sense(self, pheromone, x_m, y_m, heading_deg=0):
        """What the antennas of a robot would sense there."""
        answer = self.get("sense", pheromone=pheromone, x_m=x_m, y_m=y_m, heading_deg=heading_deg)
        return Sensed(answer["left"]["intensity"], answer["right"]["intensity"])

    def map_as_array(self, pheromone, area_m=None, nodes_per_cell=None):
        """The levels of a pheromone as a Map. `area_m` = (x, y, x, y), two opposite corners; by
        default the whole map, in at most 1000 cells a side unless `nodes_per_cell` is given."""
        query = {"pheromone": pheromone, "area_m": _commas(area_m), "nodes_per_cell": nodes_per_cell}
        if numpy is not None:
            answer, body = self._call("GET", _target("field", dict(query, format="npy")))
            values = numpy.load(io.BytesIO(body), allow_pickle=False)
            return Map(values, json.loads(answer.getheader("X-Raster")))
        answer = self.get("field", **query)
        nan = float("nan")
        return Map([[nan if it is None else it for it in row] for row in answer["values"]], answer)

    def picture(self, pheromone, area_m=None, nodes_per_cell=None, pixels_per_cell=None):
        """The same as a PNG file, in bytes."""
        return self._call("GET", _target("field", {
            "pheromone": pheromone, "format": "png", "area_m": _commas(area_m),
            "nodes_per_cell": nodes_per_cell, "pixels_per_cell": pixels_per_cell}))[1]

    def obstacles(self):
        """Where obstacles are: True and False, the top row first; an array if there is NumPy."""
        if numpy is not None:
            body = self._call("GET", _target("obstacles", {"format": "npy"}))[1]
            return numpy.load(io.BytesIO(body), allow_pickle=False) != 0
        return [[it != 0 for it in row] for row in self.get("obstacles")["values"]]

    def events(self, since=0):
        """(events, next): what the server has noticed, at most the last thousand events, and what
        to give as `since` the next time to get only newer ones."""
        answer = self.get("events", since=since)
        return answer["events"], answer["next"]

    def captures(self):
        """The recordings that the server has: a list with name, bytes and modified_s of each."""
        return self.get("captures")["captures"]

    def download_capture(self, name, path):
        """Saves a recording; continues where an earlier attempt ended. Returns its size."""
        part = str(path) + ".part"
        target = _target("captures/" + urllib.parse.quote(name, safe=""), {})
        have = os.path.getsize(part) if os.path.exists(part) else 0
        connection = self._connection()
        try:
            connection.request("GET", target,
                               headers={"Range": "bytes={}-".format(have)} if have else {})
            answer = connection.getresponse()
            if answer.status == 416 and have:  # complete, or replaced by a shorter one
                answer.read()
                os.remove(part)
                return self.download_capture(name, path)
            if answer.status not in (200, 206):
                _raise_refusal(answer.status, answer.read())
            with open(part, "ab" if answer.status == 206 else "wb") as file:
                for piece in iter(lambda: answer.read(1 << 16), b""):
                    file.write(piece)
            if answer.length:  # of bytes that did not come
                raise ProtocolError("{}: the connection ended {} bytes too early".format(
                    name, answer.length))
        finally:
            connection.close()
        os.replace(part, path)
        return os.path.getsize(path)

    # Changing

    def deposit(self, pheromone, x_m, y_m, quanta=1):
        """Adds pheromone to the node nearest to a place, as a robot does."""
        self.post("deposit", pheromone=pheromone, x_m=x_m, y_m=y_m, quanta=quanta)

    def paint(self, pheromone, points_m=None, radius_m=None, area_m=None, units=None, add=False):
        """Sets, or adds to, the level of all nodes along a line or in an area; the maximum unless
        `units` are given. Returns the number of nodes."""
        return self.post("paint", pheromone=pheromone, units=units, add=add or None,
                         **_shape(points_m, radius_m, area_m))["nodes"]

    def erase(self, pheromone, points_m=None, radius_m=None, area_m=None, everything=False):
        """The same, to 0; `everything`: the whole map."""
        shape = {"all": True} if everything else _shape(points_m, radius_m, area_m)
        return self.post("erase", pheromone=pheromone, **shape)["nodes"]

    def change_law(self, pheromone, tau_s):
        """Changes how fast a pheromone evaporates, until the server rereads its configuration or
        restarts; 0: not at all."""
        self.post("laws", pheromone=pheromone, tau_s=tau_s)

    def command(self, link, id, command, *arguments):
        """Sends a robot a command, such as command("radio-a", 7, "speed", 250). The outcome is in
        clients()."""
        self.post("command", link=link, id=id, command=command, arguments=list(arguments))

    def go_to(self, link, id, x_m, y_m, tolerance_m=None):
        """Sends a robot to a point of the map, around the obstacles."""
        self.post("goto", link=link, id=id, x_m=x_m, y_m=y_m, tolerance_m=tolerance_m)

    def cancel_goal(self, link, id):
        self.post("goto", link=link, id=id, cancel=True)

    def halt(self):
        """Halts all robots. Returns the names of the links."""
        return self.post("halt")["links"]

    def start_capture(self):
        return self.post("capture", action="start")

    def stop_capture(self):
        return self.post("capture", action="stop")

    def snapshot(self):
        return self.post("snapshot")["snapshot"]

    # The stream

    def watch(self, *topics, timeout_s=None):
        """An iterator over messages of these topics of the stream; of all that are JSON if none is
        named. A topic that does not exist yet is awaited. Ends when the server stops; raises
        socket.timeout if nothing comes for `timeout_s`.

            for message in server.watch("/clients", "/link/radio-a"):
                print(message.topic, message.value)
        """
        with _Stream(self, timeout_s) as stream:
            yield from stream.messages(topics)

    # What all of these use

    def get(self, resource, **query):
        """GET /api/v1/RESOURCE?QUERY, whose answer is JSON; parameters that are None are omitted."""
        return _from_json(self._call("GET", _target(resource, query))[1])

    def post(self, resource, **body):
        """POST /api/v1/RESOURCE with a JSON object; members that are None are omitted."""
        content = json.dumps({key: value for key, value in body.items() if value is not None})
        return _from_json(self._call("POST", "/api/v1/" + resource, content)[1])

    def _connection(self):
        if self._unix is not None:
            return _UnixConnection(self._unix, self._timeout)
        if self._tls is not None:
            return http.client.HTTPSConnection(self._host, self._port, timeout=self._timeout,
                                               context=self._tls)
        return http.client.HTTPConnection(self._host, self._port, timeout=self._timeout)

    def _call(self, method, target, body=None):
        headers = {"Authorization": "Bearer " + self._token} if self._token and body else {}
        connection = self._connection()
        try:
            connection.request(method, target, body, headers)
            answer = connection.getresponse()
            content = answer.read()
        except http.client.HTTPException as problem:
            raise ProtocolError("no valid HTTP answer: {!r}".format(problem)) from problem
        finally:
            connection.close()
        if answer.status != 200:
            _raise_refusal(answer.status, content)
        return answer, content


class Tracker:
    """Reports the poses of robots that a camera or a satellite receiver has found to a UDP port of
    the server, the `listen` of a [[tracker]]. They replace the poses that the robots report, for the
    tracker's `valid_s`: report more often than that. There is no answer; bad lines are in the
    server's log."""

    def __init__(self, address):
        host, _, port = address.rpartition(":")
        host = host.strip("[]")
        kind = socket.getaddrinfo(host, int(port), type=socket.SOCK_DGRAM)[0]
        self._socket = socket.socket(kind[0], socket.SOCK_DGRAM)
        self._to = kind[4]

    def pose(self, link, id, x_m, y_m, heading_deg):
        """Metres on the map."""
        self.poses([(link, id, x_m, y_m, heading_deg)])

    def poses(self, poses):
        """Several of (link, id, x_m, y_m, heading_deg), such as all robots of a camera's picture."""
        lines = ["pose {} {:d} {:.6f} {:.6f} {:.4f}\n".format(
            link, id, x, y, math.remainder(heading, 360)) for link, id, x, y, heading in poses]
        datagram = ""
        for line in lines:
            if len(datagram) + len(line) > 1400:  # fits an Ethernet frame
                self._send(datagram)
                datagram = ""
            datagram += line
        if datagram:
            self._send(datagram)

    def gps(self, link, id, latitude_deg, longitude_deg, course_deg, height_m=None):
        """WGS-84; the course is clockwise from north. The map needs a `datum`."""
        height = "" if height_m is None else " {:.3f}".format(height_m)
        self._send("gps {} {:d} {:.8f} {:.8f} {:.4f}{}\n".format(
            link, id, latitude_deg, longitude_deg, math.remainder(course_deg, 360), height))

    def close(self):
        self._socket.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _send(self, text):
        self._socket.sendto(text.encode("ascii"), self._to)


class _Stream:
    """A WebSocket (RFC 6455) that speaks the viewer's side of foxglove.websocket.v1."""

    _TEXT, _BINARY, _CLOSE, _PING, _PONG = 1, 2, 8, 9, 10
    _ACCEPT = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"

    def __init__(self, server, timeout_s):
        self._server = server
        self._connection = server._connection()
        self._connection.connect()
        self._socket = self._connection.sock
        self._input = self._socket.makefile("rb")
        try:
            self._shake_hands()
        except BaseException:
            self._close()
            raise
        self._socket.settimeout(timeout_s)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        try:
            self._send(self._CLOSE, b"\x03\xe8")
        except OSError:
            pass  # it is gone already
        self._close()

    def messages(self, wanted):
        topics = {}  # by subscription
        json_channels = set()
        next_subscription = 1
        for is_text, payload in self._payloads():
            if is_text:
                message = _from_json(payload)
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
                    yield Message(topics[subscription], time_ns, _from_json(content)
                                  if subscription in json_channels else content)

    def _shake_hands(self):
        key = base64.b64encode(os.urandom(16))
        host = self._connection.host
        host = "[" + host + "]" if ":" in host else host
        if self._connection.port != self._connection.default_port:
            host += ":{}".format(self._connection.port)
        lines = ["GET / HTTP/1.1", "Host: " + host, "Connection: Upgrade", "Upgrade: websocket",
                 "Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: " + key.decode(),
                 "Sec-WebSocket-Protocol: " + SUBPROTOCOL]
        if self._server._token:
            lines.append("Authorization: Bearer " + self._server._token)
        self._socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        try:
            version, status = self._input.readline(1024).split()[:2]
        except ValueError:
            raise ProtocolError("no valid HTTP answer") from None
        headers = http.client.parse_headers(self._input)
        if not version.startswith(b"HTTP/1.1") or status != b"101":
            length = min(int(headers.get("Content-Length", 0)), MAX_MESSAGE_BYTES)
            _raise_refusal(int(status), self._input.read(length))
        expected = base64.b64encode(hashlib.sha1(key + self._ACCEPT).digest()).decode()
        if headers.get("Sec-WebSocket-Accept") != expected:
            raise ProtocolError("what answers is no WebSocket server")

    def _payloads(self):
        """Whether it is text, and the bytes, of each whole message until the server closes."""
        opcode, message = None, b""
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

    def _read(self, count):
        data = self._input.read(count)
        if len(data) < count:
            raise ProtocolError("the stream ended in the middle of a message")
        return data

    def _send(self, kind, payload):
        mask = os.urandom(4)
        size = len(payload)
        head = bytes([0x80 | kind]) + (bytes([0x80 | size]) if size < 126
                                       else struct.pack(">BH", 0x80 | 126, size) if size < 1 << 16
                                       else struct.pack(">BQ", 0x80 | 127, size))
        masked = bytes(byte ^ mask[i % 4] for i, byte in enumerate(payload))
        self._socket.sendall(head + mask + masked)

    def _close(self):
        self._input.close()
        self._connection.close()


def _target(resource, query):
    pairs = [(key, value) for key, value in query.items() if value is not None]
    return "/api/v1/" + resource + ("?" + urllib.parse.urlencode(pairs, safe=",") if pairs else "")


def _commas(numbers):
    return None if numbers is None else ",".join(str(it) for it in numbers)


def _shape(points_m, radius_m, area_m):
    if (points_m is None) == (area_m is None):
        raise ValueError("give either points_m or area_m")
    if points_m is None:
        return {"area_m": [float(it) for it in area_m]}
    return {"points_m": [[float(x), float(y)] for x, y in points_m], "radius_m": radius_m}


def _from_json(content):
    try:
        return json.loads(content)
    except ValueError as problem:
        raise ProtocolError("no valid JSON: {}".format(problem)) from problem


def _raise_refusal(status, content):
    try:
        error = json.loads(content)["error"]
        refusal = Refused(status, error["what"], error["where"], error["expected"])
    except (ValueError, KeyError, TypeError):
        raise ProtocolError("HTTP status {} without a reason".format(status)) from None
    raise refusal
