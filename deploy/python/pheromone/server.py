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

Lengths are metres, times seconds, headings degrees counter-clockwise from +x, and pheromone is in
units, unless a name says otherwise. Arrays are NumPy's if NumPy is installed.

With https:// a certificate that the system does not trust needs Server(..., cafile="lab.pem").
Reading needs no token. Changes need the server's token, or its Unix socket:
Server("pheromoned.sock"). A refusal raises Refused, which says what the server found, where, and
what it expected; a server that cannot be reached raises OSError. A Server may be shared by threads:
each request has a connection of its own.
"""

from __future__ import annotations

import http.client
import io
import json
import math
import os
import socket
import ssl
import urllib.parse
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple, Union

from . import arrays
from ._answers import ProtocolError, Refused, from_json, raise_refusal
from ._stream import Message, Stream
from .maps import Map

__all__ = ["Server", "Tracker", "Map", "Sensed", "Message", "Refused", "ProtocolError"]

DEFAULT_ADDRESS = "http://127.0.0.1:8377"

Point = tuple[float, float]
Area = tuple[float, float, float, float]
Pose = tuple[str, int, float, float, float]
Json = dict[str, Any]
PheromoneName = Union[str, int]


class Sensed(NamedTuple):
    """What the two antennas of a robot sense, in units."""

    left: float
    right: float


class _UnixConnection(http.client.HTTPConnection):
    def __init__(self, path: str, timeout: float) -> None:
        super().__init__("localhost", timeout=timeout)
        self._path = path

    def connect(self) -> None:
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

    def __init__(self, address: str = DEFAULT_ADDRESS, token: str | None = None,
                 token_file: str | os.PathLike[str] | None = None, timeout_s: float = 30,
                 cafile: str | None = None) -> None:
        if token_file is not None:
            with open(token_file, encoding="ascii") as file:
                token = file.read().strip()
        self._token = token
        self._timeout = timeout_s
        url = urllib.parse.urlsplit(address)
        self._unix = None if url.scheme in ("http", "https") else address
        self._tls = ssl.create_default_context(cafile=cafile) if url.scheme == "https" else None
        self._host = url.hostname or "localhost"
        self._port = url.port

    # Reading

    def status(self, with_hash: bool = False) -> Json:
        """The state of the server as a whole, as `pheromonectl status --json`."""
        return self.get("status", hash=1 if with_hash else None)

    def clients(self) -> list[Json]:
        """The robots: a list of dictionaries with link, id, pose, goal and more."""
        return list(self.get("clients")["clients"])

    def robots_as_array(self) -> Any:
        """Where robots are: link, id, x_m, y_m, heading_deg (NaN if that is not known) and state."""
        return arrays.table("link id x_m y_m heading_deg state", "UidddU", [
            (it["link"], it["id"], *_numbers(it["pose"] or {}, "x_m", "y_m", "heading_deg"),
             it["state"]["is"]) for it in self.clients()])

    def links(self) -> list[Json]:
        return list(self.get("links")["links"])

    def laws(self) -> Json:
        """The map, the antennas and the pheromones."""
        return self.get("laws")

    def tags(self, with_contents: bool = False) -> list[Json]:
        """All virtual RFID tags."""
        found: list[Json] = []
        first: int | None = 1
        while first is not None:
            page = self.get("tags", first=first, contents=1 if with_contents else None)
            found += page["tags"]
            first = page["next"]
        return found

    def tags_as_array(self) -> Any:
        """Tags: number, name, x_m, y_m, range_m (NaN if it is not configured), slots, used and
        generation."""
        return arrays.table("number name x_m y_m range_m slots used generation", "iUdddiii", [
            (it["number"], it["name"], *_numbers(it, "x_m", "y_m", "range_m"), it["slots"],
             it["used"], it["generation"]) for it in self.tags()])

    def nets(self) -> list[Json]:
        """Petri nets that the server executes."""
        return list(self.get("nets")["nets"])

    def nets_as_array(self) -> Any:
        """Nets: name, robots, firings, and the concentrations a and b of their trails."""
        return arrays.table("name robots firings a b", "Uiidd", [
            (it["name"], it["robots"], it["firings"], it["A"]["concentration"],
             it["B"]["concentration"]) for it in self.nets()])

    def sense(self, pheromone: PheromoneName, x_m: float, y_m: float,
              heading_deg: float = 0) -> Sensed:
        """What the antennas of a robot would sense there."""
        answer = self.get("sense", pheromone=pheromone, x_m=x_m, y_m=y_m, heading_deg=heading_deg)
        return Sensed(answer["left"]["intensity"], answer["right"]["intensity"])

    def map_as_array(self, pheromone: PheromoneName, area_m: Area | None = None,
                     nodes_per_cell: int | None = None) -> Map:
        """The levels of a pheromone as a Map. `area_m` = (x, y, x, y), two opposite corners; by
        default the whole map, in at most 1000 cells a side unless `nodes_per_cell` is given."""
        query = {"pheromone": pheromone, "area_m": _commas(area_m), "nodes_per_cell": nodes_per_cell}
        if arrays.numpy is not None:
            header, body = self._call("GET", _target("field", dict(query, format="npy")))
            values = arrays.numpy.load(io.BytesIO(body), allow_pickle=False)
            return Map(values, json.loads(header["X-Raster"]))
        answer = self.get("field", **query)
        nan = float("nan")
        return Map([[nan if it is None else it for it in row] for row in answer["values"]], answer)

    def picture(self, pheromone: PheromoneName, area_m: Area | None = None,
                nodes_per_cell: int | None = None, pixels_per_cell: int | None = None) -> bytes:
        """The same as a PNG file, in bytes."""
        return self._call("GET", _target("field", {
            "pheromone": pheromone, "format": "png", "area_m": _commas(area_m),
            "nodes_per_cell": nodes_per_cell, "pixels_per_cell": pixels_per_cell}))[1]

    def obstacles(self) -> Any:
        """Where obstacles are: True and False, the top row first; an array if there is NumPy."""
        if arrays.numpy is not None:
            body = self._call("GET", _target("obstacles", {"format": "npy"}))[1]
            return arrays.numpy.load(io.BytesIO(body), allow_pickle=False) != 0
        return [[it != 0 for it in row] for row in self.get("obstacles")["values"]]

    def events(self, since: int = 0) -> tuple[list[Json], int]:
        """(events, next): what the server has noticed, at most the last thousand events, and what
        to give as `since` the next time to get only newer ones."""
        answer = self.get("events", since=since)
        return answer["events"], answer["next"]

    def captures(self) -> list[Json]:
        """The recordings that the server has: a list with name, bytes and modified_s of each."""
        return list(self.get("captures")["captures"])

    def download_capture(self, name: str, path: str | os.PathLike[str]) -> int:
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
                raise_refusal(answer.status, answer.read())
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

    def deposit(self, pheromone: PheromoneName, x_m: float, y_m: float, quanta: int = 1) -> None:
        """Adds pheromone to the node nearest to a place, as a robot does."""
        self.post("deposit", pheromone=pheromone, x_m=x_m, y_m=y_m, quanta=quanta)

    def paint(self, pheromone: PheromoneName, points_m: Iterable[Point] | None = None,
              radius_m: float | None = None, area_m: Area | None = None,
              units: float | None = None, add: bool = False) -> int:
        """Sets, or adds to, the level of all nodes along a line or in an area; the maximum unless
        `units` are given. Returns the number of nodes."""
        return int(self.post("paint", pheromone=pheromone, units=units, add=add or None,
                             **_shape(points_m, radius_m, area_m))["nodes"])

    def erase(self, pheromone: PheromoneName, points_m: Iterable[Point] | None = None,
              radius_m: float | None = None, area_m: Area | None = None,
              everything: bool = False) -> int:
        """The same, to 0; `everything`: the whole map."""
        shape = {"all": True} if everything else _shape(points_m, radius_m, area_m)
        return int(self.post("erase", pheromone=pheromone, **shape)["nodes"])

    def change_law(self, pheromone: PheromoneName, tau_s: float) -> None:
        """Changes how fast a pheromone evaporates, until the server rereads its configuration or
        restarts; 0: not at all."""
        self.post("laws", pheromone=pheromone, tau_s=tau_s)

    def command(self, link: str, id: int, command: str, *arguments: int) -> None:
        """Sends a robot a command, such as command("radio-a", 7, "speed", 250). The outcome is in
        clients()."""
        self.post("command", link=link, id=id, command=command, arguments=list(arguments))

    def go_to(self, link: str, id: int, x_m: float, y_m: float,
              tolerance_m: float | None = None) -> None:
        """Sends a robot to a point of the map, around the obstacles."""
        self.post("goto", link=link, id=id, x_m=x_m, y_m=y_m, tolerance_m=tolerance_m)

    def cancel_goal(self, link: str, id: int) -> None:
        self.post("goto", link=link, id=id, cancel=True)

    def halt(self) -> list[str]:
        """Halts all robots. Returns the names of the links."""
        return list(self.post("halt")["links"])

    def start_capture(self) -> Json:
        return self.post("capture", action="start")

    def stop_capture(self) -> Json:
        return self.post("capture", action="stop")

    def snapshot(self) -> str:
        return str(self.post("snapshot")["snapshot"])

    # The stream

    def watch(self, *topics: str, timeout_s: float | None = None) -> Iterator[Message]:
        """An iterator over messages of these topics of the stream; of all that are JSON if none is
        named. A topic that does not exist yet is awaited. Ends when the server stops; raises
        socket.timeout if nothing comes for `timeout_s`.

            for message in server.watch("/clients", "/link/radio-a"):
                print(message.topic, message.value)
        """
        with self.stream(timeout_s) as stream:
            yield from stream.messages(topics)

    # What all of these use

    def get(self, resource: str, **query: Any) -> Json:
        """GET /api/v1/RESOURCE?QUERY, whose answer is JSON; parameters that are None are omitted."""
        answer: Json = from_json(self._call("GET", _target(resource, query))[1])
        return answer

    def post(self, resource: str, **body: Any) -> Json:
        """POST /api/v1/RESOURCE with a JSON object; members that are None are omitted."""
        content = json.dumps({key: value for key, value in body.items() if value is not None})
        answer: Json = from_json(self._call("POST", "/api/v1/" + resource, content)[1])
        return answer

    def stream(self, timeout_s: float | None = None) -> Stream:
        """What `watch` reads from."""
        return Stream(self._connection(), self._token, timeout_s)

    def _connection(self) -> http.client.HTTPConnection:
        if self._unix is not None:
            return _UnixConnection(self._unix, self._timeout)
        if self._tls is not None:
            return http.client.HTTPSConnection(self._host, self._port, timeout=self._timeout,
                                               context=self._tls)
        return http.client.HTTPConnection(self._host, self._port, timeout=self._timeout)

    def _call(self, method: str, target: str,
              body: str | None = None) -> tuple[http.client.HTTPMessage, bytes]:
        headers = {"Authorization": "Bearer " + self._token} if self._token and body else {}
        connection = self._connection()
        try:
            connection.request(method, target, body, headers)
            answer = connection.getresponse()
            content = answer.read()
        except OSError:
            raise  # RemoteDisconnected, a connection that was closed, is both
        except http.client.HTTPException as problem:
            raise ProtocolError("no valid HTTP answer: {!r}".format(problem)) from problem
        finally:
            connection.close()
        if answer.status != 200:
            raise_refusal(answer.status, content)
        return answer.headers, content


class Tracker:
    """Reports the poses of robots that a camera or a satellite receiver has found to a UDP port of
    the server, the `listen` of a [[tracker]]. They replace the poses that the robots report, for the
    tracker's `valid_s`: report more often than that. There is no answer; bad lines are in the
    server's log."""

    def __init__(self, address: str) -> None:
        host, _, port = address.rpartition(":")
        host = host.strip("[]")
        kind = socket.getaddrinfo(host, int(port), type=socket.SOCK_DGRAM)[0]
        self._socket = socket.socket(kind[0], socket.SOCK_DGRAM)
        self._to = kind[4]

    def pose(self, link: str, id: int, x_m: float, y_m: float, heading_deg: float) -> None:
        """Metres on the map."""
        self.poses([(link, id, x_m, y_m, heading_deg)])

    def poses(self, poses: Iterable[Pose]) -> None:
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

    def gps(self, link: str, id: int, latitude_deg: float, longitude_deg: float,
            course_deg: float, height_m: float | None = None) -> None:
        """WGS-84; the course is clockwise from north. The map needs a `datum`."""
        height = "" if height_m is None else " {:.3f}".format(height_m)
        self._send("gps {} {:d} {:.8f} {:.8f} {:.4f}{}\n".format(
            link, id, latitude_deg, longitude_deg, math.remainder(course_deg, 360), height))

    def close(self) -> None:
        self._socket.close()

    def __enter__(self) -> Tracker:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _send(self, text: str) -> None:
        self._socket.sendto(text.encode("ascii"), self._to)


def _target(resource: str, query: Mapping[str, Any]) -> str:
    pairs = [(key, value) for key, value in query.items() if value is not None]
    return "/api/v1/" + resource + ("?" + urllib.parse.urlencode(pairs, safe=",") if pairs else "")


def _commas(numbers: Iterable[float] | None) -> str | None:
    return None if numbers is None else ",".join(str(it) for it in numbers)


def _shape(points_m: Iterable[Point] | None, radius_m: float | None,
           area_m: Area | None) -> Json:
    if (points_m is None) == (area_m is None):
        raise ValueError("give either points_m or area_m")
    if area_m is not None:
        return {"area_m": [float(it) for it in area_m]}
    assert points_m is not None
    return {"points_m": [[float(x), float(y)] for x, y in points_m], "radius_m": radius_m}


def _numbers(of: Mapping[str, Any], *keys: str) -> tuple[float, ...]:
    """NaN where there is none."""
    return tuple(math.nan if of.get(key) is None else float(of[key]) for key in keys)
