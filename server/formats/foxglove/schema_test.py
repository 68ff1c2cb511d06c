#!/usr/bin/env python3
"""Reads the messages of server/formats/foxglove by their schemas, as viewers do, with Debian's
python3-protobuf: schema_test.py PRINT_MESSAGES"""

import subprocess
import sys

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

# The fields of each message, numbered from 1 on, as Foxglove documents its well-known schemas and
# Google its own; of ours, as the dashboard reads them.
FIELDS = {
    "google.protobuf.Timestamp": "seconds nanos",
    "google.protobuf.Duration": "seconds nanos",
    "foxglove.Vector2": "x y",
    "foxglove.Vector3": "x y z",
    "foxglove.Point3": "x y z",
    "foxglove.Quaternion": "x y z w",
    "foxglove.Pose": "position orientation",
    "foxglove.Color": "r g b a",
    "foxglove.KeyValuePair": "key value",
    "foxglove.PackedElementField": "name offset type",
    "foxglove.Grid": "timestamp frame_id pose column_count cell_size row_stride cell_stride fields"
                     " data",
    "foxglove.ArrowPrimitive": "pose shaft_length shaft_diameter head_length head_diameter color",
    "foxglove.CubePrimitive": "pose size color",
    "foxglove.SpherePrimitive": "pose size color",
    "foxglove.CylinderPrimitive": "pose size bottom_scale top_scale color",
    "foxglove.LinePrimitive": "type pose thickness scale_invariant points color colors indices",
    "foxglove.TriangleListPrimitive": "pose points color colors indices",
    "foxglove.TextPrimitive": "pose billboard font_size scale_invariant color text",
    "foxglove.ModelPrimitive": "pose scale color override_color url media_type data",
    "foxglove.SceneEntityDeletion": "timestamp type id",
    "foxglove.SceneEntity": "timestamp frame_id id lifetime frame_locked metadata arrows cubes"
                            " spheres cylinders lines triangles texts models",
    "foxglove.SceneUpdate": "deletions entities",
    "foxglove.FrameTransform": "timestamp parent_frame_id child_frame_id translation rotation",
    "foxglove.FrameTransforms": "transforms",
    "foxglove.Log": "timestamp level message name file line",
    "pheromone.Tiles": "data",
}


def check_schema(name, schema):
    files = descriptor_pb2.FileDescriptorSet.FromString(schema)
    found = {f"{file.package}.{message.name}": message
             for file in files.file for message in file.message_type}
    assert name in found, f"{name}: not in its own schema"
    for message, description in found.items():
        fields = {field.number: field.name for field in description.field}
        assert fields == dict(enumerate(FIELDS[message].split(), 1)), f"{message}: {fields}"
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
    for name, check in checks.items():
        check_schema(name, schemas[name])
        message = reader_of(name, schemas[name]).FromString(messages[name])
        assert not message.UnknownFields(), name
        check(message)
    print(f"{len(checks)} schemas and messages are as documented")


if __name__ == "__main__":
    main()
