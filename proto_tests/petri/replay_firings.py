#!/usr/bin/env python3
"""Replays what a net has fired (pheromonectl net replay) through the net (pheromonectl net export
--format pnml), with the rule of firing and nothing else: none of the server's code.

    replay_firings.py NET.pnml FIRINGS.jsonl [--net NAME]

Fails at the first firing that the net does not permit, at a beginning that is not its initial
marking (but after a journal whose beginning was removed), and at an end that is another marking.
"""

import argparse
import collections
import json
import sys
import xml.etree.ElementTree as ElementTree

PNML = "{http://www.pnml.org/version-2009/grammar/pnml}"


class Wrong(Exception):
    """What the net does not permit."""


def text_in(element, name, otherwise):
    found = element.find(f"{PNML}{name}/{PNML}text")
    return otherwise if found is None else found.text


class Net:
    """Places with tokens, and for each transition the arcs that take, give, read and inhibit."""

    def __init__(self, root):
        self.initial = {}
        arcs = collections.namedtuple("Arcs", "takes gives reads inhibitors")
        self.transitions = {}
        for place in root.iter(PNML + "place"):
            self.initial[place.get("id")] = int(text_in(place, "initialMarking", "0"))
        for transition in root.iter(PNML + "transition"):
            self.transitions[transition.get("id")] = arcs({}, {}, {}, {})
        for arc in root.iter(PNML + "arc"):
            source, target = arc.get("source"), arc.get("target")
            weight = int(text_in(arc, "inscription", "1"))
            kind = arc.find(PNML + "type")
            kind = "normal" if kind is None else kind.get("value")
            if source in self.transitions:
                self.transitions[source].gives[target] = weight
            elif kind in ("normal", "read", "inhibitor"):
                its = self.transitions[target]
                {"normal": its.takes, "read": its.reads,
                 "inhibitor": its.inhibitors}[kind][source] = weight
            else:
                raise Wrong(f"an arc of the unknown kind {kind}")

    def fire(self, name, marking):
        if name not in self.transitions:
            raise Wrong(f"the net has no transition {name}")
        its = self.transitions[name]
        for place, weight in [*its.takes.items(), *its.reads.items()]:
            if marking[place] < weight:
                raise Wrong(f"{name} needs {weight} of {place}, which has {marking[place]}")
        for place, weight in its.inhibitors.items():
            if marking[place] >= weight:
                raise Wrong(f"{name} is inhibited by {place}, which has {marking[place]}")
        for place, weight in its.takes.items():
            marking[place] -= weight
        for place, weight in its.gives.items():
            marking[place] += weight


def complete(net, tokens):
    unknown = set(tokens) - set(net.initial)
    if unknown:
        raise Wrong(f"the net has no place {sorted(unknown)[0]}")
    return {place: tokens.get(place, 0) for place in net.initial}


def replay(net, lines):
    """How often each transition was fired, and by whom: (counts, robots)."""
    marking = None
    counts = collections.Counter()
    robots = set()
    for line in lines:
        where = f'sequence {line["sequence"]}'
        try:
            if "begins" in line:
                marking = complete(net, line["begins"])
                if line["from"] != "snapshot" and marking != net.initial:
                    raise Wrong("it does not begin in the initial marking")
            elif marking is None:
                raise Wrong("it was not told to begin")
            elif "ends" in line:
                if complete(net, line["ends"]) != marking:
                    raise Wrong("it ends in another marking")
            else:
                net.fire(line["transition"], marking)
                counts[line["transition"]] += 1
                if line["robot"] != 0:
                    robots.add(line["robot"])
        except Wrong as error:
            raise Wrong(f"{where}: {error}") from error
    return counts, robots


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("pnml")
    parser.add_argument("firings")
    parser.add_argument("--net", help="only this one of the server's nets")
    arguments = parser.parse_args()
    with open(arguments.firings, encoding="utf-8") as file:
        lines = [json.loads(line) for line in file]
    lines = [line for line in lines if arguments.net in (None, line["net"])]
    try:
        net = Net(ElementTree.parse(arguments.pnml).getroot())
        counts, robots = replay(net, lines)
    except Wrong as error:
        sys.exit(f"{arguments.firings}: {error}")
    print(f"{sum(counts.values())} firings of {len(counts)} of {len(net.transitions)} transitions, "
          f"by {len(robots)} robots and the environment: all legal")


if __name__ == "__main__":
    main()
