#!/usr/bin/env python3
"""Holds a running server against the description of its API: every request that openapi.json shows
is made, and every answer must be as it says, with no member that it does not name. (That every route
is in the file, is tried by openapi_test.cc.)

    openapi_walk_test.py BIN_DIR
"""

import copy
import http.client
import io
import json
import pathlib
import shutil
import sys
import unittest
import urllib.parse

import jsonschema
import numpy

ROOT = pathlib.Path(__file__).resolve().parents[4]
sys.path.insert(0, str(ROOT / "proto_tests"))
from operated_daemon import TOKEN, serve_class  # noqa: E402
from stranger.client import Client, open_terminal  # noqa: E402
from test_config import link, map_of, pheromone, pty, table  # noqa: E402

BIN = pathlib.Path()
CONFIG = "".join([
    map_of(4.0, 3.0, bias_m=0.2),
    table("obstacles", walls=[{"points_m": [[3.5, 2.5], [3.5, 2.9]], "thickness_m": 0.1}]),
    pheromone(1, "trail", tau_s=3000, sigma_m=0.3), pheromone(2, "path", tau_s=3000, sigma_m=0.3),
    table("[pheromone]", type=3, name="guide", blend=[{"pheromone": "trail", "weight": 1}]),
    *(table("[tag]", name=name, x_m=1.0, y_m=1.0) for name in
      ["N1", "N2", "N3", "N4", "N5", "N6", "S1", "S2", "S3", "S4", "P", "Src"]),
    table("[net]", name="bench", file="nets/pheromone.toml", robot_file="nets/robot.toml",
          parameters={"robots": 2}, period_ms=20, law="e3", rate=0.001, source=100000),
    table("journal", folder="state"), table("capture", folder="captures"),
    table("web", listen="127.0.0.1:0", token_file="token"),
    pty("radio-a"), link("modem", "serial", port="./unplugged"),
    link("udp", "udp", listen="127.0.0.1:0", security="accept", keys="robots.keys")])


def add_files(folder):
    shutil.copytree(ROOT / "deploy/examples/nets", folder / "nets")
    (folder / "robots.keys").write_text("8 " + 32 * "8" + "\n")
    (folder / "robots.keys").chmod(0o600)


def strict(schema):
    """The same, but refusing members that it does not name."""
    if isinstance(schema, list):
        return [strict(it) for it in schema]
    if not isinstance(schema, dict):
        return schema
    result = {key: strict(value) for key, value in schema.items()}
    if isinstance(schema.get("properties"), dict) and "additionalProperties" not in schema:
        result["additionalProperties"] = False
    return result


class Walk(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        serve_class(cls, BIN, CONFIG, add_files)
        cls.port = cls.daemon.web_port()
        line = open_terminal(cls.folder / "radio-a.pty")
        cls.addClassCleanup(line.close)
        robot = Client(line, 7, timeout=30)
        robot.hello(nonce=1)
        robot.sense(1, 1000, 1000, 0)
        cls.document = json.loads((ROOT / "server/operators/web/api/openapi.json").read_text())
        cls.components = strict(cls.document["components"])

    def operations(self, method):
        for path, item in self.document["paths"].items():
            if method in item:
                yield path, item[method]

    def request(self, method, target, body=None, token=TOKEN, **headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        if token and method == "POST":
            headers["Authorization"] = "Bearer " + token
        connection.request(method, target, None if body is None else json.dumps(body), headers)
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        return answer, content

    def validate(self, value, schema):
        # References are relative to the whole document.
        jsonschema.Draft202012Validator(
            {**strict(schema), "components": self.components}).validate(value)

    def check(self, operation, answer, content, expected):
        self.assertEqual(answer.status, expected, content[:500])
        described = operation["responses"][str(expected)]
        if "$ref" in described:
            described = self.document["components"]["responses"][described["$ref"].split("/")[-1]]
        kind = answer.getheader("Content-Type")
        self.assertIn(kind, described["content"])
        for header in described.get("headers", {}):
            if header != "X-Raster":
                self.assertIsNotNone(answer.getheader(header), header)
        if kind == "application/json":
            self.validate(json.loads(content), described["content"][kind]["schema"])

    def targets(self, path, operation):
        """What the examples of the parameters make: none of the optional ones, and each alone."""
        parameters = [it for it in operation.get("parameters", []) if it["in"] == "query"]
        required = [(it["name"], it["example"]) for it in parameters if it["required"]]
        for option in [None, *(it for it in parameters if not it["required"])]:
            values = [] if option is None else option["schema"].get("enum", [option["example"]])
            for query in ([(option["name"], value)] for value in values) if option else [[]]:
                query = required + query
                yield path + ("?" + urllib.parse.urlencode(query, safe=",") if query else "")

    def test_1_changes_are_as_described(self):
        for path, operation in self.operations("post"):
            content = operation["requestBody"]["content"]["application/json"]
            for name, example in content["examples"].items():
                with self.subTest(path=path, example=name):
                    self.validate(example["value"], content["schema"])
                    expected = 409 if path == "/api/v1/step-down" else 200  # this server is alone
                    self.check(operation, *self.request("POST", path, example["value"]), expected)

    def test_2_changes_that_are_not_permitted_or_valid(self):
        for path, operation in self.operations("post"):
            content = operation["requestBody"]["content"]["application/json"]
            example = next(iter(content["examples"].values()))["value"]
            with self.subTest(path=path):
                self.check(operation, *self.request("POST", path, example, token=None), 401)
                self.check(operation, *self.request("POST", path, example,
                                                    Origin="http://elsewhere.example"), 403)
                self.check(operation, *self.request("POST", path, {**example, "unheard_of": 1}), 400)
            for key in content["schema"].get("required", []):
                with self.subTest(path=path, without=key):
                    less = {name: value for name, value in example.items() if name != key}
                    self.check(operation, *self.request("POST", path, less), 400)

    def test_3_what_can_be_read_is_as_described(self):
        self.request("POST", "/api/v1/tags", {"action": "write", "tag": "N2", "author": 1,
                                              "block": [-17, 15, 1, 2, -3, 244]})
        for path, operation in self.operations("get"):
            for target in self.targets(path, operation) if "{" not in path else []:
                with self.subTest(target=target):
                    answer, content = self.request("GET", target)
                    self.check(operation, answer, content, 200)
                    head, nothing = self.request("HEAD", target)
                    self.assertEqual((head.status, nothing), (200, b""))
            if "400" in operation["responses"]:
                with self.subTest(path=path, query="unheard_of"):
                    required = next(self.targets(path, operation))
                    target = required + ("&" if "?" in required else "?") + "unheard_of=1"
                    self.check(operation, *self.request("GET", target), 400)

    def test_4_recordings_are_downloaded_whole_and_in_part(self):
        path = "/api/v1/captures/{name}"
        operation = self.document["paths"][path]["get"]
        listed = json.loads(self.request("GET", "/api/v1/captures")[1])["captures"]
        self.assertEqual(len(listed), 1)
        target = path.replace("{name}", listed[0]["name"])
        answer, whole = self.request("GET", target)
        self.check(operation, answer, whole, 200)
        self.assertEqual(whole, (self.folder / "captures" / listed[0]["name"]).read_bytes())
        part, content = self.request("GET", target, **{
            "Range": "bytes=4-99", "If-Range": answer.getheader("ETag")})
        self.check(operation, part, content, 206)
        self.assertEqual(content, whole[4:100])
        self.check(operation, *self.request("GET", target, **{
            "Range": "bytes=4-99", "If-Range": '"another"'}), 200)
        self.check(operation, *self.request("GET", target, Range=f"bytes={len(whole)}-"), 416)
        self.check(operation, *self.request("GET", target + "x"), 404)
        head, nothing = self.request("HEAD", target)
        self.assertEqual((head.getheader("Content-Length"), nothing), (str(len(whole)), b""))

    def test_5_arrays_load_in_numpy(self):
        self.request("POST", "/api/v1/erase", {"pheromone": "path", "all": True})
        self.request("POST", "/api/v1/paint", {"pheromone": "path", "points_m": [[1, 1]],
                                               "radius_m": 0.01, "units": 0.5})
        for resource in ("field?pheromone=path&", "obstacles?"):
            answer, content = self.request("GET", f"/api/v1/{resource}format=npy")
            array = numpy.load(io.BytesIO(content), allow_pickle=False)
            facts = json.loads(answer.getheader("X-Raster"))
            values = json.loads(self.request("GET", "/api/v1/" + resource)[1])
            del values["values"]
            values.pop("field_time_s", None)
            facts.pop("field_time_s", None)
            self.assertEqual(facts, values)
            self.assertEqual(array.shape, (facts["rows"], facts["columns"]))
            if "path" in resource:
                self.assertEqual(array[facts["rows"] - 1 - 10][10], 0.5)
                self.assertTrue(numpy.isnan(array[facts["rows"] - 1 - 27][35]))
            else:
                self.assertEqual(array[facts["rows"] - 1 - 27][35], 1)
                self.assertEqual(array[0][0], 0)

    def test_6_it_is_valid_itself(self):
        schemas = copy.deepcopy(self.document["components"]["schemas"])
        for name, schema in schemas.items():
            with self.subTest(schema=name):
                jsonschema.Draft202012Validator.check_schema(schema)
        served = json.loads(self.request("GET", "/api/v1/openapi.json")[1])
        self.assertEqual(served, self.document)


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main()
