"""The messages of ROS 2 by an IDL file, written without any library of ROS or DDS: their hashes
(REP-2011) and their bytes (plain CDR, little endian).

    types = Types(idl_file)
    types.hash("nav_msgs/msg/Odometry")                       # "RIHS01_3cc97d..."
    data = types.pack("std_msgs/msg/Bool", {"data": True})    # with the four bytes of encapsulation
    types.unpack("std_msgs/msg/Bool", data)                   # {"data": True}

What a dictionary leaves out is zero or empty.
"""

import hashlib
import json
import re
import struct

# IDL's name: the number of REP-2011, and how struct packs it.
BASIC = {"int8": (2, "b"), "uint8": (3, "B"), "int32": (6, "i"), "uint32": (7, "I"),
         "float": (10, "f"), "double": (11, "d"), "boolean": (15, "?"), "octet": (16, "B")}
STRING, BOUNDED_STRING, NESTED = 17, 21, 1
ARRAY, SEQUENCE = 48, 144  # added to the number of what they are of


class Field:
    def __init__(self, name, kind, bound, count):
        self.name, self.kind, self.bound = name, kind, bound
        self.count = count  # None: one; -1: a sequence; otherwise an array


class Types:
    def __init__(self, idl_file):
        self.structs = {}
        scope = []
        text = re.sub(r"//[^\n]*", "", idl_file.read_text())
        for module, struct_name, body, end in re.findall(
                r"module\s+(\w+)\s*\{|@final\s+struct\s+(\w+)\s*\{([^}]*)\};|(\};)", text):
            if module:
                scope.append(module)
            elif end:
                scope.pop()
            else:
                name = "/".join(scope[:2]) + "/" + struct_name[:-1]
                self.structs[name] = [self.field(line, scope[0]) for line in body.split(";")
                                      if line.strip()]

    def field(self, line, package):
        kind, name, array = re.fullmatch(r"\s*(\S+)\s+(\w+)(?:\[(\d+)\])?\s*", line).groups()
        count = int(array) if array else None
        if kind.startswith("sequence<"):
            kind, count = kind[len("sequence<"):-1], -1
        bound = 0
        if kind.startswith("string<"):
            kind, bound = "string", int(kind[len("string<"):-1])
        if kind not in BASIC and kind != "string":
            *outer, last = kind.split("::")
            kind = (f"{outer[0]}/msg/" if outer else f"{package}/msg/") + last[:-1]
        return Field(name, kind, bound, count)

    def description(self, name):
        fields = []
        for field in self.structs[name]:
            number = (NESTED if field.kind in self.structs else
                      (BOUNDED_STRING if field.bound else STRING) if field.kind == "string" else
                      BASIC[field.kind][0])
            number += 0 if field.count is None else SEQUENCE if field.count < 0 else ARRAY
            fields.append({"name": field.name, "type": {
                "type_id": number, "capacity": max(field.count or 0, 0),
                "string_capacity": field.bound,
                "nested_type_name": field.kind if field.kind in self.structs else ""}})
        return {"type_name": name, "fields": fields}

    def needed(self, name):
        found = set()
        for field in self.structs[name]:
            if field.kind in self.structs:
                found |= {field.kind} | self.needed(field.kind)
        return found

    def hash(self, name):
        whole = {"type_description": self.description(name), "referenced_type_descriptions": [
            self.description(other) for other in sorted(self.needed(name))]}
        return "RIHS01_" + hashlib.sha256(json.dumps(whole).encode()).hexdigest()

    def pack(self, name, value):
        out = bytearray()
        self.put(name, value, out)
        return b"\x00\x01\x00\x00" + bytes(out)

    def put(self, name, value, out):
        for field in self.structs[name]:
            given = value.get(field.name)
            if field.count is None:
                self.put_one(field.kind, given, out)
                continue
            items = list(given) if given is not None else [None] * max(field.count, 0)
            if field.count < 0:
                self.put_basic("I", len(items), out)
            assert field.count < 0 or len(items) == field.count, field.name
            if field.kind in ("int8", "uint8") and given is not None:
                out += struct.pack(f"<{len(items)}{BASIC[field.kind][1]}", *items)
                continue
            for item in items:
                self.put_one(field.kind, item, out)

    def put_one(self, kind, value, out):
        if kind == "string":
            text = (value or "").encode() + b"\0"
            self.put_basic("I", len(text), out)
            out += text
        elif kind in BASIC:
            self.put_basic(BASIC[kind][1], value or 0, out)
        else:
            self.put(kind, value or {}, out)

    @staticmethod
    def put_basic(code, value, out):
        out += bytes(-len(out) % struct.calcsize(code)) + struct.pack("<" + code, value)

    def unpack(self, name, data):
        assert data[:2] == b"\x00\x01", "expected plain CDR, little endian"
        value, at = self.get(name, data[4:], 0)
        # A writer may pad the end to four bytes.
        assert len(data) - 4 - at < 4, f"{name}: {len(data) - 4 - at} bytes are left"
        return value

    def get(self, name, data, at):
        value = {}
        for field in self.structs[name]:
            count = field.count
            if count is None:
                value[field.name], at = self.get_one(field.kind, data, at)
                continue
            if count < 0:
                count, at = self.get_one("uint32", data, at)
            if field.kind in ("int8", "uint8"):
                value[field.name] = list(struct.unpack_from(f"<{count}{BASIC[field.kind][1]}", data, at))
                at += count
                continue
            items = value[field.name] = []
            for _ in range(count):
                item, at = self.get_one(field.kind, data, at)
                items.append(item)
        return value, at

    def get_one(self, kind, data, at):
        if kind == "string":
            size, at = self.get_one("uint32", data, at)
            return data[at:at + size - 1].decode(), at + size
        if kind not in BASIC:
            return self.get(kind, data, at)
        code = BASIC[kind][1]
        size = struct.calcsize(code)
        at += -at % size
        return struct.unpack_from("<" + code, data, at)[0], at + size
