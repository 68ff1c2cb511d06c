"""The rules of cleaning robots once more, and a search through all that they can do that is as plain
as can be: the judge of prove_test.py. Written from Tammet, Vain and Kuusik 2006, section 4, and
README.md of this folder; it shares nothing with the C++ code, not even the idea of what may be left out.

    floor = Floor.load("floors/paper.toml")
    Search(floor).clean()        # ("proved", 65): the paper's first query, and the longest until then
    Search(floor).bounded()      # ("proved", None): the second; or "refuted", and when a zone is first too dirty
    Search(floor).forgotten()    # ("proved", 76): and the longest that a zone waits for a cleaning

A state is what a person would write down: of each zone when it was cleaned, whether it is occupied,
and its soil; of each robot where it is, what it does and how long still; the time until zones soil.
Of the times of cleanings only the order is kept, and which are now: that is all that robots compare.
"""

import collections
import itertools
import pathlib
import sys
import tomllib

DECIDING, CLAIMING, CLEANING = "deciding", "claiming", "cleaning"
NOW = 1000  # a time stamp; others are places in their order

# robots: sorted (zone, what, time left, whether its tag was written to since it was read)
State = collections.namedtuple("State", "robots stamps occupied soil tick clock")


class Floor:
    def __init__(self, data):
        floor, robots, soil = data["floor"], data["robots"], data.get("soil", {})
        self.columns, self.rows = floor.get("columns", 4), floor.get("rows", 3)
        self.zones = range(self.columns * self.rows)
        rates = floor.get("rates_percent", 5)
        self.rates = rates if isinstance(rates, list) else [rates] * len(self.zones)
        self.count = robots.get("count", 2)
        self.starts = [[zone - 1 for zone in start] for start in robots.get("starts", [])] or list(
            itertools.combinations_with_replacement(self.zones, self.count))
        self.clean = robots.get("clean_units", 5)
        self.unconditional = robots.get("policy") == "claims-unconditionally"
        self.step = soil.get("step_units", 15)
        self.dirty, self.clean_below = soil.get("dirty_percent", 80), soil.get("clean_percent", 30)
        self.start, self.limit = soil.get("start_percent", 20), soil.get("limit_percent", 51)
        self.horizon = soil.get("horizon_units", 240)
        self.beside = [self._beside(zone) for zone in self.zones]

    @staticmethod
    def parse(text):
        return Floor(tomllib.loads(text))

    @staticmethod
    def load(path):
        return Floor.parse(pathlib.Path(path).read_text(encoding="utf-8"))

    def _beside(self, zone):
        column, row = divmod(zone, self.rows)
        return [c * self.rows + r for c, r in ((column - 1, row), (column + 1, row), (column, row - 1),
                                               (column, row + 1))
                if 0 <= c < self.columns and 0 <= r < self.rows]


class TwoInOneZone(Exception):
    pass


class Search:
    def __init__(self, floor):
        self.floor = floor

    # --- The rules. `soil` and `clock` are None where they are left out.

    def first(self, soil, clock):
        for start in self.floor.starts:
            yield State(tuple(sorted((zone, DECIDING, 0, False) for zone in start)),
                        tuple(0 for _ in self.floor.zones), frozenset(),
                        None if soil is None else tuple(soil for _ in self.floor.zones),
                        None if soil is None else self.floor.step, clock)

    def next(self, state):
        """Pairs of a state and the time that passes before anything is due there."""
        for i, (_, what, left, _) in enumerate(state.robots):
            if left == 0:
                act = {DECIDING: self.decide, CLAIMING: self.claim, CLEANING: self.finish}[what]
                for after in act(state, i):
                    yield self.let_time_pass(after)
        if state.tick == 0:
            cleaned = {zone for zone, what, _, _ in state.robots if what == CLEANING}
            soil = tuple(level if zone in cleaned else min(100, level + self.floor.rates[zone])
                         for zone, level in enumerate(state.soil))
            yield self.let_time_pass(state._replace(soil=soil, tick=self.floor.step))

    def with_robot(self, state, i, robot):
        return state._replace(robots=state.robots[:i] + (robot,) + state.robots[i + 1:])

    def decide(self, state, i):
        here = state.robots[i][0]
        seen = [zone for zone in [here] + self.floor.beside[here] if zone not in state.occupied]
        if not seen:
            yield self.with_robot(state, i, (here, DECIDING, 1, False))
            return
        oldest = min(state.stamps[zone] for zone in seen)
        if here in seen and state.stamps[here] == oldest:
            yield self.with_robot(state, i, (here, CLAIMING, 0, False))
            return
        for zone in seen:
            if state.stamps[zone] == oldest:
                yield self.with_robot(state, i, (zone, DECIDING, 1, False))

    def claim(self, state, i):
        here, _, _, was_written = state.robots[i]
        if was_written and not self.floor.unconditional:
            yield self.with_robot(state, i, (here, DECIDING, 0, False))
            return
        if any(j != i and zone == here and what == CLEANING
               for j, (zone, what, _, _) in enumerate(state.robots)):
            raise TwoInOneZone
        after = self.note_write(state, i, here)
        after = after._replace(occupied=after.occupied | {here})
        yield self.with_robot(after, i, (here, CLEANING, self.floor.clean, False))

    def finish(self, state, i):
        here = state.robots[i][0]
        after = self.note_write(state, i, here)
        stamps = tuple(NOW if zone == here else stamp for zone, stamp in enumerate(state.stamps))
        soil = state.soil and tuple(0 if zone == here else level
                                    for zone, level in enumerate(state.soil))
        after = after._replace(stamps=stamps, occupied=after.occupied - {here}, soil=soil)
        yield self.with_robot(after, i, (here, DECIDING, 0, False))

    def note_write(self, state, i, here):
        return state._replace(robots=tuple(
            (zone, what, left, was_written or (j != i and zone == here and what == CLAIMING))
            for j, (zone, what, left, was_written) in enumerate(state.robots)))

    def let_time_pass(self, state):
        passed = min(robot[2] for robot in state.robots)
        if state.tick is not None:
            passed = min(passed, state.tick)
        order = sorted(set(state.stamps))
        stamps = tuple(NOW if stamp == NOW and passed == 0 else order.index(stamp)
                       for stamp in state.stamps)
        robots = tuple(sorted((zone, what, left - passed, was_written)
                              for zone, what, left, was_written in state.robots))
        return State(robots, stamps, state.occupied, state.soil,
                     None if state.tick is None else state.tick - passed,
                     None if state.clock is None else state.clock + passed), passed

    # --- The searches.

    def graph(self, first, is_end):
        """All states, each with its successors and the time that passes there, none after an end."""
        graph = {state: None for state in first}
        waiting = collections.deque(graph)
        while waiting:
            state = waiting.popleft()
            graph[state] = [] if is_end(state) else list(self.next(state))
            for after, _ in graph[state]:
                if after not in graph:
                    graph[after] = None
                    waiting.append(after)
        return graph

    def longest(self, graph, first, is_end):
        longest = self.all_longest(graph, first, is_end)
        return longest and max(longest[state] for state in first)

    def all_longest(self, graph, first, is_end):
        """By state, the longest until an end, at least of the first; None if it may never come."""
        longest, on_the_way = {}, set()
        stack = [(state, None) for state in first]
        while stack:
            state, todo = stack.pop()
            if todo is None:
                if state in longest:
                    continue
                if state in on_the_way:
                    return None
                if is_end(state):
                    longest[state] = 0
                    continue
                on_the_way.add(state)
                todo = iter(graph[state])
            for after, _ in todo:
                if after in on_the_way:
                    return None
                if after not in longest:
                    stack += [(state, todo), (after, None)]
                    break
            else:
                on_the_way.discard(state)
                longest[state] = max((longest[after] + (0 if is_end(after) else passed)
                                      for after, passed in graph[state]), default=0)
        return longest

    def clean(self):
        def is_end(state):
            return all(level < self.floor.clean_below for level in state.soil)

        first = list(self.first(self.floor.dirty, None))
        longest = self.longest(self.graph(first, is_end), first, is_end)
        return ("refuted", None) if longest is None else ("proved", longest)

    def bounded(self):
        def is_wrong(state):
            return any(level >= self.floor.limit for level in state.soil)

        graph = self.graph(self.first(self.floor.start, 0),
                           lambda state: state.clock >= self.floor.horizon or is_wrong(state))
        times = [after.clock - passed for steps in graph.values() for after, passed in steps
                 if is_wrong(after) and after.clock - passed < self.floor.horizon]
        return ("refuted", min(times)) if times else ("proved", None)

    def for_ever(self):
        def is_wrong(state):
            return any(level >= self.floor.limit for level in state.soil)

        graph = self.graph(self.first(self.floor.start, None), is_wrong)
        return ("refuted" if any(map(is_wrong, graph)) else "proved"), None

    def forgotten(self):
        first = list(self.first(None, None))
        try:
            graph = self.graph(first, lambda state: False)
        except TwoInOneZone:
            return "refuted", None
        longest = 0
        for zone in self.floor.zones:
            def is_cleaned(state, zone=zone):
                return any(robot[:2] == (zone, CLEANING) for robot in state.robots)

            begun = {}
            for state in filter(is_cleaned, graph):
                for after, passed in graph[state]:
                    if not is_cleaned(after):
                        begun[after] = max(passed, begun.get(after, 0))
            until = self.all_longest(graph, list(begun) + first, is_cleaned)
            if until is None:
                return "refuted", None
            longest = max([longest] + [until[after] + passed for after, passed in begun.items()])
        return "proved", longest


if __name__ == "__main__":
    for path in sys.argv[1:]:
        search = Search(Floor.load(path))
        print(path, search.clean(), search.bounded(), search.forgotten())
