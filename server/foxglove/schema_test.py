#!/usr/bin/env python3
"""Judges the schemas and messages that server/foxglove encodes with protoc and Debian's
python3-protobuf: schema_test.py PRINT_MESSAGES"""

import pathlib
import subprocess
import sys
import tempfile

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

HERE = pathlib.Path(__file__).parent


def described_by_protoc():
    """Each message of the files in testing/ and what they import, by its full name."""
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "set"
        subprocess.run(
            ["protoc", f"--proto_path={HERE / 'testing'}", "--include_imports",
             f"--descriptor_set_out={out}", "viewer_messages.proto", "tiles.proto"],
            check=True)
        files = descriptor_pb2.FileDescriptorSet.FromString(out.read_bytes())
    return messages_of(files)


def messages_of(files):
    return {f"{file.package}.{message.name}": message
            for file in files.file for message in file.message_type}


def check_schema(name, schema, expected):
    files = descriptor_pb2.FileDescriptorSet.FromString(schema)
    found = messages_of(files)
    assert name in found, f"{name}: not in its own schema"
    for message, description in found.items():
        assert description == expected[message], f"{message}: {description}"
    assert all(file.syntax == "proto3" for file in files.file)
    seen = set()  # a file after those that it imports
    for file in files.file:
        assert set(file.dependency) <= seen, f"{file.name} imports {file.dependency}"
        seen.add(file.name)


def reader_of(name, schema):
    """The class of a message, made from the schema alone, as a viewer does it."""
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema).file:
        pool.Add(file)
    return message_factory.MessageFactory(pool).GetPrototype(pool.FindMessageTypeByName(name))


def point(it):
    return (it.x, it.y, it.z)


def check_time(it):
    assert (it.seconds, it.nanos) == (1_700_000_000, 7), it


def check_grid(grid):
    check_time(grid.timestamp)
    assert grid.frame_id == "map"
    assert point(grid.pose.position) == (-0.25, 1.5, 0) and grid.pose.orientation.w == 1
    assert (grid.column_count, grid.row_stride, grid.cell_stride) == (3, 3, 1)
    assert (grid.cell_size.x, grid.cell_size.y) == (0.05, 0.05)
    assert [(it.name, it.offset, it.type) for it in grid.fields] == [
        ("level", 0, 1), ("254 = 0.5 units", 0, 1)]
    assert grid.data == bytes([0, 1, 254, 255, 0, 7])


def check_scene(scene):
    assert [(it.type, it.id) for it in scene.deletions] == [(1, ""), (0, "radio-a/9")]
    robot, trail, place = scene.entities
    check_time(robot.timestamp)
    assert (robot.id, robot.frame_id, robot.lifetime.seconds) == ("radio-a/7", "map", 5)
    assert {it.key: it.value for it in robot.metadata} == {
        "link": "radio-a", "id": "7", "law": "eq6"}
    (arrow,) = robot.arrows  # points along +y, its middle at (1, 2)
    assert abs(arrow.pose.position.x - 1) < 1e-9 and arrow.pose.position.y < 2
    assert abs(arrow.pose.orientation.z - 0.5 ** 0.5) < 1e-9
    assert abs(arrow.shaft_length + arrow.head_length - 0.25) < 1e-9
    assert [point(it.pose.position) for it in robot.spheres] == [(0.8, 2, 0), (1.2, 2, 0)]
    assert [it.text for it in robot.texts] == ["7"]
    (line,) = trail.lines
    assert line.type == 0 and [point(it) for it in line.points] == [(1, 1, 0), (1, 2, 0)]
    (circle,) = place.lines
    assert circle.type == 1 and len(circle.points) == 32
    assert all(abs((it.x - 3) ** 2 + (it.y - 4) ** 2 - 0.25) < 1e-9 for it in circle.points)
    assert [it.text for it in place.texts] == ["the door"]


def check_transforms(transforms):
    (transform,) = transforms.transforms
    check_time(transform.timestamp)
    assert (transform.parent_frame_id, transform.child_frame_id) == ("map", "robot/radio-a/7")
    assert point(transform.translation) == (1, 2, 0) and transform.rotation.z == 1


def check_log(log):
    check_time(log.timestamp)
    assert (log.level, log.message, log.name) == (3, "link radio-a is down", "link")


def check_tiles(tiles):
    assert tiles.data == b"tiles" * 100


def main():
    printed = subprocess.run([sys.argv[1]], check=True, capture_output=True, text=True).stdout
    schemas, messages = {}, {}
    for line in printed.splitlines():
        what, name, text = line.split(" ")
        (schemas if what == "schema" else messages)[name] = bytes.fromhex(text)
    checks = {"foxglove.Grid": check_grid, "foxglove.SceneUpdate": check_scene,
              "foxglove.FrameTransforms": check_transforms, "foxglove.Log": check_log,
              "pheromone.Tiles": check_tiles}
    assert set(schemas) == set(messages) == set(checks)
    expected = described_by_protoc()
    for name, check in checks.items():
        check_schema(name, schemas[name], expected)
        message = reader_of(name, schemas[name]).FromString(messages[name])
        assert not message.UnknownFields(), name
        check(message)
    print(f"{len(checks)} schemas and messages are as protoc has them")


if __name__ == "__main__":
    main()
