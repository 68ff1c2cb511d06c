#!/usr/bin/env python3
"""Recordings for viewers: what a server recorded, exported, is what it showed.

    mcap_test.py BIN_DIR              with a reader of our own, made from the format's specification
    mcap_test.py BIN_DIR FOLDER       also with Foxglove's library, which npm installs in FOLDER
"""

import json
import math
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
from collections import Counter

from checks import check
from cdr_reader import read_cdr
from mcap_reader import read_mcap
from operated_daemon import ROOM, OperatedDaemon
from stranger.client import Client, open_terminal

HERE = pathlib.Path(__file__).resolve().parent
ROS2 = HERE.parent / "client_fw/ros2"
sys.path.insert(0, str(ROS2 / "testing"))
from ros_types import Types  # noqa: E402

# What pheromone-ros2 and Fast DDS exchange: type_hash_test.py has the hashes that ROS publishes.
LIVE_TYPES = Types(ROS2 / "messages.idl")
CONFIG = ROOM + """[capture]
folder = "captures"
"""
SCHEMAS = {"/robots": "foxglove.SceneUpdate", "/trails": "foxglove.SceneUpdate",
           "/goals": "foxglove.SceneUpdate", "/tags": "foxglove.SceneUpdate",
           "/tf": "foxglove.FrameTransforms", "/obstacles": "foxglove.Grid",
           "/pheromone/path": "foxglove.Grid", "/clients": ""}
BAG = {"/pheromone/path": ("nav_msgs/msg/OccupancyGrid", "ros2msg"),
       "/pheromone/obstacles": ("nav_msgs/msg/OccupancyGrid", "ros2msg"),
       "/robots/radio_a/robot_7/pose": ("geometry_msgs/msg/PoseStamped", "ros2msg"),
       "/tf": ("tf2_msgs/msg/TFMessage", "ros2msg")}


def export(bin_dir, out, *captures, status=0, options=()):
    result = subprocess.run([bin_dir / "pheromonectl", "export", "--mcap", out, *options, *captures],
                            text=True, capture_output=True, check=False, timeout=60)
    check(result.returncode == status, f"{captures}: {result}")
    return result.stdout + result.stderr


def varint(data, at):
    value = shift = 0
    while True:
        value |= (data[at] & 0x7F) << shift
        shift += 7
        at += 1
        if data[at - 1] < 0x80:
            return value, at


def protobuf(data):
    """The last value of each field."""
    fields, at = {}, 0
    while at < len(data):
        key, at = varint(data, at)
        size = {1: 8, 5: 4}.get(key & 7)
        if key & 7 == 0:
            fields[key >> 3], at = varint(data, at)
            continue
        if size is None:
            size, at = varint(data, at)
        fields[key >> 3] = data[at:at + size]
        at += size
    return fields


def record(bin_dir, folder):
    """A recording, and the map and the robot as the server showed them at its end."""
    (folder / "test.toml").write_text(CONFIG)
    daemon = OperatedDaemon(bin_dir, folder)

    def call(*request):
        status, text = daemon.call(*request)
        check(status == 200, f"{request}: {status} {text}")
        return json.loads(text)
    try:
        with open_terminal(folder / "radio-a.pty") as line:
            call("POST", "/api/v1/capture", {"action": "start"})
            robot = Client(line, 7, timeout=60)
            robot.hello(nonce=1)
            robot.sense(1, 1500, 500, 16384)
            call("POST", "/api/v1/paint", {"pheromone": "path", "points_m": [[1, 1], [2, 1]],
                                           "radius_m": 0.01, "units": 0.25})
            call("POST", "/api/v1/deposit", {"pheromone": "path", "x_m": 3, "y_m": 2, "quanta": 4})
            field = call("GET", "/api/v1/field?pheromone=path&nodes_per_cell=1")
            clients = call("GET", "/api/v1/clients")["clients"]
            call("POST", "/api/v1/capture", {"action": "stop"})
        return next((folder / "captures").iterdir()), field, clients
    finally:
        daemon.stop()


def read_message(file, message):
    """By the definition in the file, and again by the types that ROS publishes."""
    name, _, definition = file.schemas[message.topic]
    read = read_cdr(name, definition.decode(), message.data)
    check(read == LIVE_TYPES.unpack(name, message.data), f"{name}: its definition is not ROS's")
    return read


def check_bag(bin_dir, folder, capture, field, clients):
    """The same recording for ROS 2, as an independent reader of CDR finds it."""
    out = folder / "lab-ros2.mcap"
    export(bin_dir, out, capture, options=("--ros2",))
    file = read_mcap(out)
    check(file.profile == "ros2", f"the profile is {file.profile}")
    check({topic: schema[:2] for topic, schema in file.schemas.items()} == BAG, file.schemas)
    check(set(file.encodings.values()) == {"cdr"}, file.encodings)
    last = {}
    for it in file.messages:
        last[it.topic] = message = read_message(file, it)
        for header in [of["header"] for of in message.get("transforms", [message])]:
            check((header["stamp"]["sec"], header["stamp"]["nanosec"], header["frame_id"])
                  == (*divmod(it.time_ns, 10 ** 9), "map"), f"{it.topic} {header}")
    pose = clients[0]["pose"]
    yaw = math.radians(pose["heading_deg"])
    turned = {"x": 0, "y": 0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}
    found = last["/robots/radio_a/robot_7/pose"]["pose"]
    check(found["position"] == {"x": pose["x_m"], "y": pose["y_m"], "z": 0}, found)
    check(all(abs(found["orientation"][key] - value) < 1e-9 for key, value in turned.items()), found)
    (robot,) = last["/tf"]["transforms"]
    check(robot["child_frame_id"] == "robot/radio-a/7", robot)
    check(robot["transform"] == {"translation": found["position"], "rotation": found["orientation"]}, robot)
    # 98 is the maximum, and a cell shows what is within half a step of Foxglove's 254 as well.
    grid, walls = last["/pheromone/path"], last["/pheromone/obstacles"]
    rows = [level for row in reversed(field["values"]) for level in row]
    for of in (grid, walls):
        check((of["info"]["width"], of["info"]["height"]) == (field["columns"], field["rows"]), of["info"])
        check(abs(of["info"]["resolution"] - field["cell_m"]) < 1e-7, of["info"])
        check([of["info"]["origin"]["position"][key] for key in "xy"] == field["origin_m"], of["info"])
        check(of["info"]["origin"]["orientation"] == {"x": 0, "y": 0, "z": 0, "w": 1}, of["info"])
    check(walls["data"] == [100 if level is None else 0 for level in rows], "the walls")
    for cell, level in zip(grid["data"], rows):
        if not level:
            check(cell == (-1 if level is None else 0), f"{cell} for {level}")
        else:
            check(cell >= 1 and abs(cell - 98 * level / field["maximum"]) <= 0.5 + 98 / 254 / 2,
                  f"{cell} for {level}")
    check(len(set(grid["data"])) == 4, "nothing, a wall, what was painted and what was deposited")
    return out


def check_export(bin_dir, folder):
    capture, field, clients = record(bin_dir, folder)
    bag = check_bag(bin_dir, folder, capture, field, clients)
    out = folder / "lab.mcap"
    export(bin_dir, out, capture)
    file = read_mcap(out)
    check({topic: schema[0] for topic, schema in file.schemas.items()} == SCHEMAS, file.schemas)
    for topic, encoding in file.encodings.items():
        check(encoding == ("json" if topic == "/clients" else "protobuf"), topic)
    last = {it.topic: it for it in file.messages}
    told = json.loads(last["/clients"].data)["clients"]
    check([(it["id"], it["pose"]) for it in told] == [(it["id"], it["pose"]) for it in clients],
          f"{told} is not {clients}")
    check(set(told[0]["antennas"]["pheromones"]) == {"path"}, told)
    # Each cell is round(level / scale * 254), at least 1 where there is something; 255 is a wall. The
    # highest level is 0.5, so that the scale is that.
    grid = protobuf(last["/pheromone/path"].data)
    check(struct.unpack("<I", grid[4])[0] == field["columns"], "the grid's columns")
    expected = bytes(255 if level is None else max(1, math.floor(level / 0.5 * 254 + 0.5)) if level
                     else 0 for row in reversed(field["values"]) for level in row)
    check(protobuf(grid[8])[1] == b"254 = 0.5 units", f"the scale is told as {protobuf(grid[8])}")
    check(grid[9] == expected, f"the grid is not the map:\n{grid[9].hex()}\n{expected.hex()}")
    check(Counter(expected)[127] == 11 and Counter(expected)[254] == 1, "the map is as painted")
    return [out, bag]


def check_library(folder, *files):
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("package.json", "package-lock.json", "read.mjs"):
        shutil.copy(HERE / "mcap" / name, folder / name)
    subprocess.run(["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"], cwd=folder,
                   check=True, stdout=subprocess.DEVNULL)
    for path in files:
        result = subprocess.run(["node", "read.mjs", path], cwd=folder, check=True, text=True,
                                stdout=subprocess.PIPE)
        found = json.loads(result.stdout)
        ours = read_mcap(path)
        counts = Counter(it.topic for it in ours.messages)
        check(found["streamed"] == found["indexed"] == counts, f"{path}: {found} is not {counts}")
        check(found["statistics"] == len(ours.messages), path)
        check(found["schemas"] == {topic: it[0] for topic, it in ours.schemas.items()}, found)
        check(found["decoded"] == {it.topic: read_message(ours, it) for it in ours.messages
                                   if ours.schemas[it.topic][1] == "ros2msg"}, found["decoded"])
    print(f"read with @mcap/core and @foxglove/rosmsg2-serialization: {len(files)} files")


def check_recordings_are_kept(bin_dir, folder):
    """An output's name is forgotten, or is that of a recording."""
    whole = (HERE / "replay/traffic.pcapng").read_bytes()
    first, second = folder / "1.pcapng", folder / "2.pcapng"
    tables = folder / "tables"
    tables.mkdir()
    for path in (first, second, tables / "events.csv"):
        path.write_bytes(whole)
    (folder / "link.mcap").symlink_to(first)
    told = "is a recording, expected another name to export to"
    for out in (first, folder / "link.mcap"):
        check(f"{out}: {told}" in export(bin_dir, out, second, status=2), out)
        text = export(bin_dir, out, second, first, status=2)
        check(f"{out}: the output is the input {first}, expected another name" in text, text)
    check(told in export(bin_dir, first, "--live", status=2), "before it records")
    result = subprocess.run([bin_dir / "pheromonectl", "export", "--csv", tables, second],
                            text=True, capture_output=True, check=False, timeout=60)
    check(result.returncode == 2 and f"{tables}/events.csv: {told}" in result.stderr, result)
    for path in (first, second, tables / "events.csv"):
        check(path.read_bytes() == whole, f"{path} has changed")
    check(len(list(tables.iterdir())) == 1, "the other tables")


def check_earlier_files_are_kept(bin_dir, folder):
    """What could not be exported replaces nothing, and a device stays one."""
    whole = HERE / "replay/traffic.pcapng"
    out = folder / "kept.mcap"
    export(bin_dir, out, whole)
    earlier = out.read_bytes()
    (folder / "empty").touch()
    for name in ("nope.pcapng", "empty"):
        text = export(bin_dir, out, folder / name, status=1)
        check(name in text and "messages" not in text, text)
        check(out.read_bytes() == earlier, name)
    export(bin_dir, out, HERE / "replay/evaporation.pcapng")
    check(out.read_bytes() != earlier, "a later export replaces it")
    check(not list(folder.glob("*.new*")), "files are left beside it")
    full = folder / "full"
    full.symlink_to("/dev/full")
    text = export(bin_dir, full, whole, status=1)
    check("full: cannot be written: No space left on device" in text, text)
    check(full.is_symlink() and full.is_char_device(), "the device is gone")
    result = subprocess.run([bin_dir / "pheromonectl", "export", "--mcap", "/dev/stdout", whole],
                            capture_output=True, check=True, timeout=60)
    check(result.stdout.startswith(earlier), "into a pipe")


def main():
    bin_dir = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        files = check_export(bin_dir, folder)
        # Recordings with all that there is; several make one file.
        corpus = sorted((HERE / "replay").glob("*.pcapng"))
        for capture in corpus:
            files.append(folder / (capture.stem + ".mcap"))
            export(bin_dir, files[-1], capture)
            read_mcap(files[-1])
            bag = folder / (capture.stem + "-ros2.mcap")
            export(bin_dir, bag, capture, options=("--ros2",))
            for message in (read := read_mcap(bag)).messages:
                read_message(read, message)
        # The last grid is how a recording ended, however seldom grids are.
        last = {}
        for rate in ("0.01", "10"):
            out = folder / "grids.mcap"
            export(bin_dir, out, HERE / "replay/evaporation.pcapng", options=("--grid-rate", rate))
            last[rate] = [it for it in read_mcap(out).messages if it.topic.startswith("/pheromone/")][-1]
        # Without its first field, the time: a grid that is still the same is not written again.
        check(len({it.data[2 + it.data[1]:] for it in last.values()}) == 1, "the last grids")
        two = [it for it in corpus if it.stem in ("evaporation", "traffic")]
        files.append(folder / "two.mcap")
        export(bin_dir, files[-1], *two)
        check(len(read_mcap(files[-1]).messages) == sum(
            len(read_mcap(folder / (it.stem + ".mcap")).messages) for it in two), "two in one")
        # What is cut off is exported up to there, and told.
        whole = (HERE / "replay/traffic.pcapng").read_bytes()
        (folder / "cut.pcapng").write_bytes(whole[:len(whole) * 3 // 4])
        files.append(folder / "cut.mcap")
        text = export(bin_dir, files[-1], folder / "cut.pcapng", status=1)
        check("cut.pcapng" in text and "messages up to there" in text, text)
        read_mcap(files[-1])
        text = export(bin_dir, folder / "none/x.mcap", two[0], status=1)
        check("No such file or directory" in text, text)
        check_recordings_are_kept(bin_dir, folder)
        check_earlier_files_are_kept(bin_dir, folder)
        if len(sys.argv) > 2:
            check_library(pathlib.Path(sys.argv[2]), *files)


if __name__ == "__main__":
    main()
