"""Reads messages of ROS 2 in CDR by their own definitions, from what the rules of XCDR1 (DDS-XTypes
1.3, 7.4.1 and 7.4.3) and the format "ros2msg" (https://mcap.dev/spec/registry) say alone.

    message = read_cdr("nav_msgs/msg/OccupancyGrid", definition, data)
    message["info"]["width"]

All of the data has to belong to the message.
"""

import re
import struct

from checks import check

SIZES = {"bool": "?", "byte": "B", "char": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H",
         "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d"}
FIELD = re.compile(r"([\w/]+)(\[\d*\])?\s+([a-z]\w*)(\s+[^=].*)?")


def types_of(name, definition):
    """The fields, (type, array, name), of each type that the definition has."""
    first, *others = re.split(r"^={80}\n", definition, flags=re.MULTILINE)
    texts = {re.sub("/msg/", "/", name): first}
    for other in others:
        head, _, text = other.partition("\n")
        check(re.fullmatch(r"MSG: \w+/\w+", head), f"the head of a definition: {head}")
        check(head[5:] not in texts, f"{head} is there twice")
        texts[head[5:]] = text
    types = {}
    for type_name, text in texts.items():
        lines = [line.partition("#")[0].strip() for line in text.splitlines()]
        fields = [FIELD.fullmatch(line) for line in lines if line]
        check(fields and all(fields), f"the definition of {type_name}:\n{text}")
        types[type_name] = [it.group(1, 2, 3) for it in fields]
    used = {it[0] for fields in types.values() for it in fields} - set(SIZES) - {"string"}
    check(used | {re.sub("/msg/", "/", name)} == set(types), f"{name} uses {used}, but defines {set(types)}")
    return types


class Cdr:
    def __init__(self, data):
        check(data[:4] == b"\0\1\0\0", f"no little-endian CDR: {data[:4].hex()}")
        self.data = data[4:]
        self.at = 0

    def number(self, layout):
        size = struct.calcsize(layout)
        padding = -self.at % size
        check(not any(self.data[self.at:self.at + padding]), "padding that is not 0")
        self.at += padding + size
        return struct.unpack_from("<" + layout, self.data, self.at - size)[0]

    def value(self, kind, types):
        if kind in SIZES:
            return self.number(SIZES[kind])
        if kind == "string":
            size = self.number("I")
            self.at += size
            text = self.data[self.at - size:self.at]
            check(len(text) == size and text.endswith(b"\0"), "a string without its end")
            return text[:-1].decode()
        return {name: self.values(of, array, types) for of, array, name in types[kind]}

    def values(self, kind, array, types):
        if not array:
            return self.value(kind, types)
        count = int(array[1:-1]) if array != "[]" else self.number("I")
        return [self.value(kind, types) for _ in range(count)]


def read_cdr(name, definition, data):
    cdr = Cdr(data)
    message = cdr.value(re.sub("/msg/", "/", name), types_of(name, definition))
    check(cdr.at == len(cdr.data), f"{len(cdr.data) - cdr.at} bytes after a {name}")
    return message
