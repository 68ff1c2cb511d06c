#!/usr/bin/python3
"""RDF of what is written on tags, as rapper and rdflib read it; and what rdflib writes, read by us.

The facts are the five sentences of Tammet, Vain and Kuusik 2006, section 3.1.

Usage: rdf_test.py build/release/tests/rdf_convert
"""

import datetime
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import unittest

import rdflib

CONVERT = ""
RAPPER = {"nt": "ntriples", "ttl": "turtle", "rdf": "rdfxml"}
RDFLIB = {"nt": "nt", "ttl": "turtle", "rdf": "xml"}

RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
XSD = "http://www.w3.org/2001/XMLSchema#"
ROB = "http://robots.org/ns#"
NS = "http://example.org/ns#"

OPERATOR = 100
IDS = {12: "00:11:22:33:44:55", 15: "123-233-201", 17: "two words/17", OPERATOR: "operator"}
TAG = "zone-7"
TAG_NUMBER = 7

# Strings of robot 15, which the others share.
STRINGS = [NS, "performingaction", "notperformingaction", "cleaning", "washereattime", "hastype",
           "robot", "waslookingfortag", "didnotfindtag", "waslookingforproducttype", "foundtags",
           "book", "prohibits", "wateringplants", "closerthanmetres"]


def utc_s(text):
    return int(datetime.datetime.fromisoformat(text + "+00:00").timestamp())


def nr(text):
    return STRINGS.index(text) + 1


def symbol(text):
    return (nr(NS), nr(text)), f"<{NS}{text}>"


def robot(number):
    quoted = {12: "00%3A11%3A22%3A33%3A44%3A55", 17: "two%20words%2F17"}.get(number, IDS[number])
    return (-17, number), f"<http://robots.org/robot/{quoted}>"


def tag(number):
    name = f"tag/{TAG}" if number == TAG_NUMBER else f"tag-number/{number}"
    return (-18, number), f"<http://robots.org/{name}>"


def typed(text, name):
    return f'"{text}"^^<{XSD}{name}>'


def moment(text):
    return (-5, utc_s(text)), typed(text + "Z", "dateTime")


def whole(number):
    return (-3, number), typed(number, "int")


def metres(number, text):
    return (-4, struct.unpack("<i", struct.pack("<f", number))[0]), typed(text, "float")


def string(text):
    return (-1, nr(text)), typed(text, "string")


# Author, time, and the three terms: each its two words and what N-Triples should have.
FACTS = [
    # Robot nr 12 has been here at 10:12 on 24. January and was actively cleaning.
    (12, "2006-01-24T10:12:00", robot(12), symbol("washereattime"), moment("2006-01-24T10:12:00")),
    (12, "2006-01-24T10:12:00", robot(12), symbol("performingaction"), symbol("cleaning")),
    # Robot nr 12 has been here at 12:10 on 26. January but did not actively clean the area.
    (12, "2006-01-26T12:10:00", robot(12), symbol("washereattime"), moment("2006-01-26T12:10:00")),
    (12, "2006-01-26T12:10:00", robot(12), symbol("notperformingaction"), symbol("cleaning")),
    # Robot nr 15 has been here at 14.20 on 28. January looking for tag nr 244 and did not find a tag.
    (15, "2006-01-28T14:20:00", robot(15), symbol("hastype"), symbol("robot")),
    (15, "2006-01-28T14:20:00", robot(15), symbol("washereattime"), moment("2006-01-28T14:20:00")),
    (15, "2006-01-28T14:20:00", robot(15), symbol("waslookingfortag"), tag(244)),
    (15, "2006-01-28T14:20:00", robot(15), symbol("didnotfindtag"), tag(244)),
    # Robot nr 17 has been here at 14.35 on 28. January looking for tags of the product type 'book'
    # and found three.
    (17, "2006-01-28T14:35:00", robot(17), symbol("washereattime"), moment("2006-01-28T14:35:00")),
    (17, "2006-01-28T14:35:00", robot(17), symbol("waslookingforproducttype"), string("book")),
    (17, "2006-01-28T14:35:00", robot(17), symbol("foundtags"), whole(3)),
    # It is prohibited by the operator to water plants closer than 2 meters of the tag.
    (OPERATOR, "2006-01-20T08:00:00", tag(TAG_NUMBER), symbol("prohibits"),
     symbol("wateringplants")),
    (OPERATOR, "2006-01-20T08:00:00", symbol("wateringplants"), symbol("closerthanmetres"),
     metres(2.0, "2")),
]


def hash_of(words):
    """As server/base/hash.h defines it: SplitMix64's finaliser, chained; the last 32 bits."""
    mask = (1 << 64) - 1
    result = 0
    for word in words:
        z = (result + (word & 0xFFFFFFFF) + 0x9E3779B97F4A7C15) & mask
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & mask
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
        result = z ^ (z >> 31)
    return f"{result & 0xFFFFFFFF:08x}"


def words_of(fact):
    author, time, *terms = fact
    return [author, utc_s(time)] + [word for words, _ in terms for word in words]


def lines():
    all_lines = [f"robot {number} {unique_id}" for number, unique_id in IDS.items()]
    all_lines += [f"string 15 {i + 1} {text}" for i, text in enumerate(STRINGS)]
    all_lines += [f"mapping {number} 15" for number in (12, 17, OPERATOR)]
    all_lines.append(f"name {TAG_NUMBER} {TAG}")
    all_lines += [f"block {TAG} " + " ".join(map(str, words_of(fact))) for fact in FACTS]
    return "\n".join(all_lines) + "\n"


def expected_triples():
    triples = []
    for fact in FACTS:
        author, time, subject, predicate, obj = fact
        seconds = time.replace("-", "").replace(":", "") + "Z"
        author_iri = robot(author)[1].rsplit("/", 1)[1][:-1]
        event = (f"<http://robots.org/event/{TAG}/{author_iri}/{seconds}/"
                 f"{hash_of(words_of(fact)[2:])}>")
        for name, value in ((f"{RDF}type", f"<{RDF}Statement>"), (f"{RDF}subject", subject[1]),
                            (f"{RDF}predicate", predicate[1]), (f"{RDF}object", obj[1]),
                            (f"{ROB}tag", f"<http://robots.org/tag/{TAG}>"),
                            (f"{ROB}robotId", typed(IDS[author], "string")),
                            (f"{ROB}dtime", typed(time + "Z", "dateTime"))):
            triples.append(f"{event} <{name}> {value} .")
    return sorted(triples)


class RdfTest(unittest.TestCase):
    maxDiff = None

    def setUp(self):
        rdflib.NORMALIZE_LITERALS = False
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        subprocess.run([CONVERT, "write", self.folder.name], input=lines(), text=True, check=True)

    def path(self, ending):
        return pathlib.Path(self.folder.name) / f"tags.{ending}"

    def read(self, path):
        result = subprocess.run([CONVERT, "read", str(path), str(TAG_NUMBER), TAG],
                                capture_output=True, text=True, check=False)
        self.assertEqual(result.stderr, "")
        return result.stdout

    def test_rapper_reads_the_facts_in_each_format(self):
        for ending, syntax in RAPPER.items():
            with self.subTest(ending):
                result = subprocess.run(["rapper", "-q", "-i", syntax, "-o", "ntriples",
                                         str(self.path(ending))],
                                        capture_output=True, text=True, check=True)
                self.assertEqual(result.stderr, "")
                self.assertEqual(sorted(result.stdout.splitlines()), expected_triples())

    def test_rdflib_reads_the_facts_in_each_format(self):
        for ending, syntax in RDFLIB.items():
            with self.subTest(ending):
                graph = rdflib.Graph().parse(str(self.path(ending)), format=syntax)
                triples = sorted(graph.serialize(format="nt").strip().splitlines())
                self.assertEqual([line for line in triples if line], expected_triples())

    def test_what_rdflib_writes_is_read_as_the_same_facts(self):
        graph = rdflib.Graph().parse(str(self.path("nt")), format="nt")
        ours = self.read(self.path("nt"))
        self.assertEqual(len(ours.splitlines()), len(FACTS))
        # Numbers of robots are given in the order of the file.
        self.assertIn(f"{TAG}\toperator\t2006-01-20T08:00:00Z\t", ours)
        self.assertIn("\twateringplants closerthanmetres 2.0\n", ours)
        self.assertIn(f"{TAG}\ttwo words/17\t2006-01-28T14:35:00Z\t", ours)
        self.assertIn(" waslookingforproducttype \"book\"\n", ours)
        self.assertIn(" waslookingfortag tag:244\n", ours)

        def without_robots(text):
            return sorted(re.sub(r"(?<=Z\t)[0-9]+|robot:[0-9]+", "", line)
                          for line in text.splitlines())

        for ending, syntax in RDFLIB.items():
            with self.subTest(ending):
                path = pathlib.Path(self.folder.name) / f"theirs.{ending}"
                graph.serialize(destination=str(path), format=syntax)
                self.assertEqual(without_robots(self.read(path)), without_robots(ours))


if __name__ == "__main__":
    CONVERT = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
