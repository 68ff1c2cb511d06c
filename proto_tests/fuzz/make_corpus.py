#!/usr/bin/env python3
"""Makes seeds for the fuzzers from the protocol's vectors and the default configuration, and
small pictures and arrays.

Usage: make_corpus.py DIR      writes DIR/decoder/, DIR/message/, DIR/engine/, DIR/codec/,
                               DIR/config/, DIR/journal/, DIR/keys/, DIR/maps/, DIR/tracker/,
                               DIR/capture/, DIR/radio/, DIR/pnml/, DIR/stream/, DIR/http/, DIR/session/,
                               DIR/etcd/, DIR/peer_wire/, DIR/signing/
"""

import base64
import json
import pathlib
import struct
import sys
import urllib.parse
import zlib

import engine_seeds
import peer_seeds

ROOT = pathlib.Path(__file__).resolve().parents[2]


def net_records():
    """name, bytes of each record of a net, good and bad."""
    path = ROOT / "protocol/vectors/net_records.txt"
    for line in path.read_text(encoding="ascii").splitlines():
        if line and not line.startswith("#"):
            name, _, _, statement, _, _ = (column.strip() for column in line.split("|"))
            yield name, bytes.fromhex(statement)


def frames():
    """(name, body or None, wire) of each frame vector."""
    for line in (ROOT / "protocol/vectors/frames.txt").read_text(encoding="ascii").splitlines():
        if line and not line.startswith("#"):
            name, body, wire, _ = (column.strip() for column in line.split("|"))
            yield name, None if body == "-" else bytes.fromhex(body), bytes.fromhex(wire)


def coded_frames():
    """(name, pairs of a pause and a byte) of each stream with a coded ROUND, or signed coded frame."""
    for file, column in (("streams.txt", 1), ("signed.txt", 4)):
        for line in (ROOT / "protocol/vectors" / file).read_text(encoding="ascii").splitlines():
            columns = [it.strip() for it in line.split("|")]
            if line.startswith("coded_round") or "_coded" in columns[0]:
                stream = bytes.fromhex(columns[column])
                yield columns[0], b"".join(bytes([0, byte]) for byte in stream)


def noises():
    """(name, pairs of a pause and a byte): what no frame alone has."""
    begun = bytes([0, 0x10, 0, 0x02, 0, 0x07])
    yield "begun_again", begun + begun
    yield "begun_and_left", begun + bytes([60, 0x07, 0, 0x10])
    yield "lone_dle", bytes([0, 0x10, 60, 0x10, 0, 0x10, 0, 0x02, 0, 0x10])
    yield "between_frames", bytes([0, 0x02, 0, 0x10, 0, 0x03, 0, 0x10, 0, 0x10]) + begun


def png(columns, rows, depth, colour_type, scanlines, between=(), interlace=0):
    """A PNG of these scan lines, each with its filter byte; `between` are (kind, data) chunks."""
    header = struct.pack(">IIBBBBB", columns, rows, depth, colour_type, 0, 0, interlace)
    chunks = [(b"IHDR", header), *between, (b"IDAT", zlib.compress(scanlines)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks)


def npy(descr, fortran_order, shape, data, version=1):
    """An array as numpy.save writes it."""
    header = str({"descr": descr, "fortran_order": fortran_order, "shape": shape}).encode() + b"\n"
    return (b"\x93NUMPY" + bytes([version, 0]) +
            struct.pack("<H" if version == 1 else "<I", len(header)) + header + data)


def rasters():
    """(name, parser of maps_fuzzer.cc, file)."""
    yield "p5", 0, b"P5 # c\n2 2\n255\n\x00\x01\xfe\xff"
    yield "p5_wide", 0, b"P5\n1 2\n1000\n\x03\xe8\x00\x0a"
    yield "p2", 0, b"P2\n2 2 # c\n9\n0 1\n2 9\n"
    yield "gray", 1, png(2, 2, 8, 0, bytes([0, 1, 2, 1, 3, 4]))
    yield "gray_1", 1, png(9, 1, 1, 0, bytes([0, 0xA5, 0x80]))
    yield "gray_16", 1, png(1, 2, 16, 0, bytes([0, 1, 2, 2, 3, 4]))
    yield "rgba", 1, png(1, 1, 8, 6, bytes([0, 1, 2, 3, 255]))
    yield "palette", 1, png(2, 1, 8, 3, bytes([0, 1, 0]),
                            [(b"PLTE", bytes(range(6))), (b"tRNS", b"\x80")])
    yield "interlaced", 1, png(2, 2, 8, 0, bytes([0, 1, 0, 2, 0, 3, 4]), interlace=1)
    yield "text", 1, png(1, 1, 8, 0, bytes(2), [(b"zTXt", b"a\0\0" + zlib.compress(bytes(99)))])
    yield "f8", 2, npy("<f8", False, (1, 2), struct.pack("<2d", 0.5, -1))
    yield "i8", 2, npy(">i8", True, (2, 1), struct.pack(">2q", -5, 7), version=2)
    yield "u1", 2, npy("|u1", True, (2, 3), bytes(range(6)))
    yield "grid", 3, b"# c\n1,2.5,nan\n-3e2, 4 ,0\n"
    yield "ros", 4, (b"image: lab.pgm\nresolution: 0.05\norigin: [-1.5, 2, 0]\nnegate: 0\n"
                     b"occupied_thresh: 0.65\nfree_thresh: 0.196\nmode: scale\n")
    yield "yaml", 4, b"a: &x {b: [1, 'two', \"3\"]}\nc: *x\nd: |\n  text\n? e\n: !!str 5\n"


def nets():
    """(name, PNML): the dialects in which tools write it."""
    def document(inside, kind="http://www.pnml.org/version-2009/grammar/ptnet"):
        return (f'<?xml version="1.0"?><pnml xmlns="http://www.pnml.org/version-2009/grammar/pnml">'
                f'<net id="n" type="{kind}"><name><text>x</text></name>{inside}</net></pnml>').encode()

    nodes = ('<place id="p"><name><text>P</text></name><initialMarking><text>3</text>'
             '</initialMarking></place><place id="q"/><transition id="t"/>')
    yield "standard", document(
        f'<page id="g">{nodes}<arc id="a" source="p" target="t"><inscription><text>2</text>'
        '</inscription></arc><arc id="b" source="t" target="q"/></page>')
    yield "pages", document(
        f'<page id="g"><page id="h">{nodes}</page><referencePlace id="r" ref="p"/>'
        '<referenceTransition id="s" ref="t"/><arc id="a" source="r" target="s"/></page>')
    yield "type_element", document(
        f'{nodes}<arc id="a" source="p" target="t"><type value="inhibitor"/></arc>'
        '<arc id="b" source="q" target="t"><type value="read"/></arc>')
    yield "arctype", document(
        f'{nodes}<arc id="a" source="p" target="t"><arctype><text>inhibitor</text></arctype></arc>',
        "http://www.pnml.org/version-2009/extensions/inhibitorptnet")
    yield "tapaal", document(
        '<place id="p" initialMarking="1" invariant="&lt; inf"/><transition id="t"/>'
        '<arc id="a" source="p" target="t" type="timed" inscription="[0,inf)" weight="2"/>'
        '<arc id="b" source="p" target="t" type="tapnInhibitor"/>', "P/T net")
    yield "pipe", (
        '<?xml version="1.0" encoding="iso-8859-1"?><pnml><net id="n" type="P/T net"><place id="p">'
        '<name><value>\xe4</value></name><initialMarking><value>Default,1,Red,0</value>'
        '</initialMarking><capacity><value>0</value></capacity></place></net></pnml>'
    ).encode("iso-8859-1")
    yield "own", document(
        '<toolspecific tool="pheromone" version="1"><claim identifier="c" text="always p &lt;= 1"/>'
        '</toolspecific><page id="g"><place id="p"><toolspecific tool="pheromone" version="1">'
        '<properties identifier="a b" name-percent="%01" box="go" owner="robot" tag="7"/>'
        '</toolspecific></place></page>')


def capture_records(file):
    """The records of a capture, each as capture_fuzzer.cc takes it: kind, length, payload."""
    at = 0
    while at < len(file):
        kind, length = struct.unpack_from("<II", file, at)
        body = file[at + 8:at + length - 4]
        at += length
        if kind == 6:  # a packet
            size, link, connection, direction = struct.unpack_from("<I4xHIB", body, 12)
            options = body[20 + (size + 3) // 4 * 4:]
            payload = struct.pack("<BBB", link, connection, direction - 1)
            payload += options[options.index(b"\x01\x80\x08\0") + 4:][:4] + body[28:20 + size]
            kind = 2
        elif kind >> 8 == 0x805048:
            payload = body[16:8 + struct.unpack_from("<I", body, 4)[0]]
        else:
            continue
        yield kind & 0xFF, struct.pack("<BH", kind & 0xFF, len(payload)) + payload


def channels():
    """(name, input of radio_fuzzer.cc): a few robots on channels of all kinds."""
    small, large, due, hello, sense, event, ack, noise, answer, command, turns, clock = range(12)
    joined = b"".join(bytes([hello, robot, 5, answer, 0, small, 10, due, 0])
                      for robot in range(14))
    talk = bytes([turns, 7, answer, 0, answer, 0, answer, 0, due, 0]) * 6
    contend = bytes([sense, 20, answer, 0, small, 12, due, 0, event, 21, answer, 1, due, 0])
    commands = bytes([command, 3, due, 0, ack, 3, command, 255, due, 0, clock, 9, large, 3])
    damaged = bytes([noise, 0x10, 0x02, 0x05, small, 200, sense, 1, answer, 0xE0, due, 0])
    kinds = {"transparent": [1, 2, 0, 2], "usb": [1, 12, 16, 2], "keyed": [17, 2, 25, 0, 2],
             "keyed_early": [25, 20, 0, 0, 2], "full_duplex": [0, 0, 0, 0]}
    for name, (flags, *times) in kinds.items():
        for baud in range(5):
            yield (f"{name}_{baud}", bytes([flags, baud, *times]) + joined +
                   talk + contend + commands + damaged + talk)
    yield "silent", bytes([1, 0, 2, 0, 2]) + joined + bytes([due, 0, large, 255]) * 30


def viewers():
    """(name, input of stream_fuzzer.cc): what viewers of the stream send."""
    texts = {
        "subscribe": {"op": "subscribe", "subscriptions": [
            {"id": 5, "channelId": 1}, {"id": 6, "channelId": 2}, {"id": 6, "channelId": 1}]},
        "unsubscribe": {"op": "unsubscribe", "subscriptionIds": [5, 6]},
        "advertise": {"op": "advertise", "channels": [
            {"id": 1, "topic": "/brush", "encoding": "json", "schemaName": ""},
            {"id": 2, "topic": "/clicked_point", "encoding": "json", "schemaName": ""}]},
        "unadvertise": {"op": "unadvertise", "channelIds": [1, 9]},
        "get": {"op": "getParameters", "id": "a", "parameterNames": ["stream.grid_hz", "x"]},
        "set": {"op": "setParameters", "id": "b", "parameters": [
            {"name": "stream.grid_hz", "value": 2}, {"name": "/pheromone/trail/tau_s", "value": 1}]},
        "watch": {"op": "subscribeParameterUpdates", "parameterNames": ["/pheromone/trail/tau_s"]},
        "ignore": {"op": "unsubscribeParameterUpdates", "parameterNames": []},
    }
    texts = {name: (2, json.dumps(it).encode()) for name, it in texts.items()}
    brush = {"pheromone": "trail", "x_m": 1, "y_m": 2, "radius_m": 0.1, "units": 1}
    published = {
        "brush": struct.pack("<BI", 1, 1) + json.dumps(brush).encode(),
        "eraser": struct.pack("<BI", 1, 1) + json.dumps(brush | {"erase": True}).encode(),
        "click": struct.pack("<BI", 1, 2) + b'{"header":{},"point":{"x":1.5,"y":-2,"z":0}}',
        "call": struct.pack("<BIII", 2, 3, 9, 4) + b'json{"pheromone":"trail","all":true}',
    }
    binaries = {name: (3, it) for name, it in published.items()}
    def message(flags, payload):
        return struct.pack("<BH", flags, len(payload)) + payload
    for name, (flags, payload) in (texts | binaries).items():
        yield name, message(*texts["advertise"]) + message(flags, payload) * 2
    for name, command, speed, identity in (
            ("play", 0, 4.0, b""), ("seek", 1, 0.5, b"some-id"), ("too-fast", 0, 1e9, b""),
            ("no-command", 7, 1.0, b"x")):
        request = struct.pack("<BBfBQI", 3, command, speed, command, 10**18, len(identity))
        yield f"playback-{name}", message(9, request + identity) + message(9, request[:-1])
    yield "session", b"".join(message(flags | 4, payload)
                              for flags, payload in (texts | binaries).values())


def http_requests():
    """What the description of the HTTP interface shows: over the Unix socket, with the token, and
    without it."""
    paths = json.loads((ROOT / "server/operators/web/api/openapi.json").read_text())["paths"]
    token = b"Authorization: Bearer 0123456789abcdef\r\n"
    session = b""
    for path, item in paths.items():
        name = path.strip("/").replace("/", "_").replace("{name}", "name")
        target = path.replace("{name}", "traffic.pcapng").encode()
        for at, parameters in enumerate([item["get"].get("parameters", [])] if "get" in item else []):
            query = urllib.parse.urlencode([(it["name"], it["example"]) for it in parameters
                                            if it["in"] == "query"], safe=",").encode()
            headers = b"".join(f"{it['name']}: {it['example']}\r\n".encode() for it in parameters
                               if it["in"] == "header")
            request = (b"GET " + target + (b"?" + query if query else b"") +
                       b" HTTP/1.1\r\nHost: localhost\r\n" + headers + b"\r\n")
            session += request
            yield f"get_{name}_{at}", b"\0" + request
        for at, example in enumerate(item["post"]["requestBody"]["content"]["application/json"][
                "examples"].values() if "post" in item else []):
            # The tests' control interface has other names.
            body = json.dumps(example["value"]).replace("N1", "door").encode()
            head = b"POST " + target + b" HTTP/1.1\r\nHost: lab.local\r\n"
            rest = b"Content-Length: %d\r\n\r\n" % len(body) + body
            yield f"post_{name}_{at}", b"\1" + head + rest
            yield f"post_{name}_{at}_token", b"\0" + head + token + rest
            yield f"post_{name}_{at}_none", b"\0" + head + rest
    yield "session", b"\0" + session
    yield "chunked", (b"\1POST /api/v1/halt HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n"
                      b"2\r\n{}\r\n0\r\n\r\nGET /healthz HTTP/1.0\r\n\r\n")


def connections():
    """Requests in pieces: of odd lengths, pipelined, half-sent, refused, and handshakes."""
    def pieces(flags, text, size):
        return bytes([flags]) + b"".join(bytes([len(text[at:at + size])]) + text[at:at + size]
                                         for at in range(0, len(text), size))

    for name, seed in http_requests():
        yield name, pieces(seed[0], seed[1:] * 2, 97)
        yield name + "_half", pieces(seed[0], seed[1:] + seed[1:-7], 60)
        yield name + "_stop", pieces(seed[0] | 4, seed[1:], 31)
    handshake = (b"GET / HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
                 b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
                 b"Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n\r\n")
    get = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"
    yield "handshake", pieces(0, get + handshake + b"\x81\x80\0\0\0\0", 200)
    yield "handshake_refused", pieces(0, handshake.replace(b"13", b"12") + get, 200)
    yield "handshake_foreign", pieces(
        0, handshake.replace(b"Host", b"Origin: http://evil\r\nHost") + get, 200)
    yield "handshake_half", pieces(0, handshake[:90], 7)
    yield "repeated_host", pieces(0, get.replace(b"Host", b"Host: a\r\nHost") + get, 200)
    yield "expect", pieces(1, b"POST /api/v1/halt HTTP/1.1\r\nHost: x\r\nExpect: 100-continue\r\n"
                              b"Content-Length: 2\r\n\r\n{}" + get, 80)
    yield "too_long", pieces(0, b"POST / HTTP/1.1\r\nContent-Length: 2000000\r\n\r\n" + get, 80)
    yield "not_http", pieces(0, b"\x16\x03\x01\0\xff" * 40, 200)


def crc32c(data):
    crc = 0xffffffff
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82f63b78 if crc & 1 else 0)
    return crc ^ 0xffffffff


def etcd_answers():
    """Reads and watches of a log of three groups, as etcd's gateway answers them."""
    def coded(text):
        return base64.b64encode(text if isinstance(text, bytes) else text.encode()).decode()

    def entry(key, value, revision):
        return {"key": coded("/pheromone/lab/" + key), "value": coded(value),
                "create_revision": "2", "mod_revision": str(revision), "version": "1"}

    def group(first, count, records, pieces=0):
        head = struct.pack("<BIQI", 1, count, 4, pieces)
        checksum = crc32c(struct.pack("<Q", first) + head + records)
        return entry(f"log/{first:016x}", head + struct.pack("<I", checksum) + records, first + 4)

    groups = [group(1, 4, b"abcd"), group(5, 2, b"ef"), group(7, 1, b"", 3)]
    common = [[entry("leader", "a", 4)], [entry("id", "lab-1", 4)]]

    def read(entries, floor=None, revision=20):
        parts = common + [[] if floor is None else [entry("floor", f"{floor:016x}", 9)], entries]
        return b"r" + json.dumps({
            "header": {"cluster_id": "38", "member_id": "73", "revision": str(revision)},
            "succeeded": True,
            "responses": [{"response_range": {"kvs": part, "more": True, "count": "9"}}
                          for part in parts]}).encode() + b"\0"

    def watch(*events, **more):
        return b"w" + json.dumps({"result": {"header": {"revision": "21"}, **more,
                                             "events": list(events)}}).encode() + b"\0"

    status = b's{"header":{"member_id":"73"},"leader":"38","raftTerm":"2"}\0'
    failed = b's{"error":"etcdserver: not leader","message":"etcdserver: not leader","code":9}\0'
    puts = [{"kv": it} for it in (*groups, entry("leader", "b", 22), entry("floor", f"{5:016x}", 23))]
    yield "read", b"\1" + read([]) + read(groups[:1]) + read(groups[1:]) + read([]) + status
    yield "inside", b"\6" + read(groups[1:2]) + read(groups[1:]) + failed
    yield "watch", b"\1" + read([]) + b"".join(watch(put) for put in puts) + watch(*puts)
    yield "gap", b"\1" + read([]) + watch(puts[1]) + 2 * (read(groups[1:]) + read([])) + read(groups)
    yield "trimmed", b"\2" + read([]) + read(groups[1:], 5) + read([], 5) + read(groups[1:], 5)
    yield "restored", b"\1" + read([]) + read(groups[:2]) + read([], revision=3) + read(groups[1:2])
    yield "compacted", (b"\1" + watch(canceled=True, compact_revision="9") + b'w{"error":{"message":'
                        b'"no leader"}}\0' + watch({"type": "DELETE", "kv": groups[0]}))
    yield "canceled", b"\1" + read([]) + watch(canceled=True, cancel_reason="no leader") + read(groups)
    yield "another", b"\1" + read([]) + watch({"kv": entry("id", "lab-2", 24)}, *puts) + read(groups)


def main(folder):
    for fuzzer in ("decoder", "message", "engine", "codec", "config", "journal", "keys", "maps", "tracker",
                   "capture", "radio", "pnml", "stream", "http", "session", "etcd", "peer_wire",
                   "signing"):
        (folder / fuzzer).mkdir(parents=True, exist_ok=True)
    for name, body, wire in frames():
        # decoder: the gap timeout, then a pause before each byte.
        timed = bytes([20]) + b"".join(bytes([1, byte]) for byte in wire)
        (folder / "decoder" / name).write_bytes(timed)
        if body is not None:
            (folder / "message" / name).write_bytes(body)
        if body is not None and body[1] < 0x80:
            # engine: the message twice, after a HELLO of the same robot.
            again = 2 * engine_seeds.message(body[0], body[1], body[2:])
            (folder / "engine" / name).write_bytes(
                engine_seeds.SMALL + engine_seeds.hello(body[0]) + again)
            # journal: records, each length, time and the event: link and message; Advance.
            robot = bytes([1]) + body[1:]
            event = engine_seeds.logged(1, bytes([0, 0, *robot[:2], len(robot) - 2]) + robot[2:])
            advance = engine_seeds.logged(2, b"")
            (folder / "journal" / name).write_bytes(
                b"\0" + 2 * (bytes([len(event), 3]) + event + bytes([len(advance), 20]) + advance))
    for name, heard in (*noises(), *coded_frames()):
        (folder / "decoder" / name).write_bytes(bytes([20]) + heard)
    for name, statement in net_records():
        body = bytes([7, 0x43]) + bytes(21) + statement
        (folder / "message" / f"net_{name}").write_bytes(body)
    (folder / "message" / "longer_than_any").write_bytes(bytes([7, 0x71]) + bytes(65))
    default = (ROOT / "server/config/default.toml").read_bytes()
    (folder / "config" / "default").write_bytes(default)
    cluster = default[default.index(b"# [cluster]"):default.index(b"# And in a serial or pty [[link]]")]
    (folder / "config" / "cluster").write_bytes(
        default + b"".join(line.removeprefix(b"# ") for line in cluster.splitlines(True)))
    plain = [line.split(b"#")[0].strip() for line in default.splitlines()]
    (folder / "config" / "plain").write_bytes(b"\n".join(line for line in plain if line))
    for name, parser, file in rasters():
        (folder / "maps" / name).write_bytes(bytes([parser]) + file)
    (folder / "keys" / "two").write_text("# ours\n7 " + "07" * 16 + " red\r\n\n254 " + "aF" * 16
                                         + "# spare\n")
    (folder / "keys" / "short").write_text("7 " + "07" * 15 + "\n")
    (folder / "tracker" / "pose").write_bytes(b"pose radio-a 7 2.35 0.9 -90\r\n\npose b 8 -1 .5 0")
    (folder / "tracker" / "gps").write_bytes(b"gps a 1 47.3769 8.5417 181.5\ngps a 2 0 -180 360 408")
    for name, session in engine_seeds.sessions():
        (folder / "engine" / f"session_{name}").write_bytes(session)
    for name, seed in engine_seeds.codec():
        (folder / "codec" / name).write_bytes(seed)
    for name, seed in channels():
        (folder / "radio" / name).write_bytes(seed)
    # signing: a greeting and its answer; requests, COMMANDs and a halt to all; each given twice.
    greeted = bytes([1, 0, 0, 4, 0, 0, 5, 1])
    talk = b"".join(bytes([1, 1, 0x21, 6, 1, 2, 3, 4, 5, kind, 1, 2, 0x51, 2, kind, 1])
                    for kind in range(4)) + bytes([1, 3, 0x51, 2, 9, 1])
    given = b"".join(bytes([1, 4, which]) for which in range(12))
    changed = b"".join(bytes([1, 6, which, which, 1]) for which in range(12))
    for name, seed in (("once", greeted + talk + given), ("twice", greeted + talk + 2 * given),
                       ("changed", greeted + talk + changed + given),
                       ("restart", greeted + talk + given + bytes([1, 7]) + given + greeted + given),
                       ("power", greeted + talk + bytes([1, 8]) + greeted + 2 * given),
                       ("any", greeted + bytes([1, 9, 0, 0x21, 6, *range(6)]) + talk)):
        (folder / "signing" / name).write_bytes(seed)
    for name, seed in viewers():
        (folder / "stream" / name).write_bytes(seed)
    for name, seed in http_requests():
        (folder / "http" / name).write_bytes(seed)
    for name, seed in etcd_answers():
        (folder / "etcd" / name).write_bytes(seed)
    for name, seed in connections():
        (folder / "session" / name).write_bytes(seed)
    for name, seed in peer_seeds.seeds():
        (folder / "peer_wire" / name).write_bytes(seed)
    for name, seed in nets():
        (folder / "pnml" / name).write_bytes(seed)
    for path in (ROOT / "proto_tests/replay").glob("*.pcapng"):
        file = path.read_bytes()
        (folder / "capture" / path.stem).write_bytes(b"\0" + file)
        records = list(capture_records(file))
        (folder / "capture" / f"{path.stem}_all").write_bytes(
            b"\2" + b"".join(record for _, record in records))
        (folder / "capture" / f"{path.stem}_rest").write_bytes(
            b"\1" + b"".join(record for kind, record in records if kind > 1))
        # codec: the state that a capture begins with, without record, portion and their lengths.
        state = b"".join(record[7:] for kind, record in records if kind == 1)
        (folder / "codec" / path.stem).write_bytes(b"\2" + state)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
