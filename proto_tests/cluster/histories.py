"""Compares what robots, operators and servers saw with the journals: the checker of faults_test.py.

    wrong = check_histories(Run(...))       # a list of texts, empty if all is as it must be

It believes nobody: a robot's history is what went over its line, and what a journal holds is found by
applying its events again (replayed_journal), apart from any server.
"""

import collections
import json
import subprocess


class Events:
    """What replayed_journal prints."""

    def __init__(self, lines):
        self.lines = lines
        self.events = [line.split("\t") for line in lines]

    def requests(self):
        """(sequence, link:id, body, answers) of each."""
        for it in self.events:
            if it[4] == "request":
                yield int(it[0]), f"{it[5]}:{int(it[6][:2], 16)}", it[6], it[7:]

    def hashes(self):
        return {int(it[0]): it[3] for it in self.events if it[3] != "-"}


class Journal(Events):
    """The events of one, applied again: from the first on, or from a state that another server gave."""

    def __init__(self, program, folder, hashed):
        made = subprocess.run([program, folder, *map(str, sorted(hashed))], capture_output=True,
                              text=True, check=False)
        self.error = made.stderr.strip() if made.returncode else ""
        super().__init__(made.stdout.splitlines())


def join(journals):
    """All events of all of them, in order."""
    lines = {int(it[0]): line for journal in journals for it, line in zip(journal.events, journal.lines)}
    return Events([lines[it] for it in sorted(lines)])


MUTATING = (0x2, 0x3, 0x6)
MUTATING_OPCODES = (0x43, 0x44, 0x45, 0x52)


def is_change(body):
    opcode = int(body[2:4], 16)
    return opcode >> 4 in MUTATING or opcode in MUTATING_OPCODES


def check_journal(name, journal):
    if journal.error:
        yield f"journal of {name}: {journal.error}"
    before = 0
    epochs = set()
    for it in journal.events:
        if int(it[1]) < before:
            yield f"journal of {name}: field time {it[1]} ms of event {it[0]} after {before} ms"
        before = int(it[1])
        epochs.add(it[2])
    if len(epochs) != 1:
        yield f"journal of {name}: epochs {sorted(epochs)}, expected one"


def check_equal(journals):
    """One may have a few events more: it is the last thing that servers do."""
    found = {}
    for name, journal in journals.items():
        for it, line in zip(journal.events, journal.lines):
            other, there = found.setdefault(it[0], (name, line))
            if line != there:
                yield f"event {it[0]} differs: {other} has {there!r}, {name} has {line!r}"
                break


def log_end(groups):
    """The first event that the log does not have."""
    return groups[-1][0] + groups[-1][1] if groups else 0


def check_groups(earlier, groups, journal):
    """(first event, events, term) of each in the log, `earlier` while servers ran, and at the end: a
    journal has committed events only, but servers may have died before they wrote the last ones."""
    end, before = None, 0
    for first, count, term in groups:
        if end is not None and first != end:
            yield f"the group at {first} in the log follows one that ends before {end}"
        if term < before:
            yield f"the group at {first} has term {term}, after {before}"
        end, before = first + count, term
    sequences = [int(it[0]) for it in journal.events]
    if sequences != list(range(1, len(sequences) + 1)):
        yield "the journals together do not have all events from the first on"
    if not log_end(earlier) <= len(journal.lines) + 1 <= log_end(groups):
        yield (f"the log ended before event {log_end(earlier)} and then {log_end(groups)}, the journals "
               f"after {len(journal.lines)}")


def check_robots(history, journal, others=()):
    """`others`: robots without a history."""
    sent = collections.defaultdict(list)
    answers = {}
    epochs = set()
    for it in history:
        if it["what"] == "sent":
            sent[it["robot"]].append(it["body"])
        elif it["what"] == "answer":
            answers[it["robot"], it["body"]] = it["answer"]
        elif it["what"] == "hello":
            epochs.add(it["epoch"])
        elif it["what"] == "wrong":
            yield f"robot {it['robot']} at {it['t']}: {it['why']}"
    if len(epochs) != 1:
        yield f"robots were told epochs {sorted(epochs)}, expected one"
    logged = collections.defaultdict(list)
    for sequence, robot, body, made in journal.requests():
        if is_change(body):
            logged[robot].append((body, sequence, made))
    for robot, bodies in sent.items():
        counts = collections.Counter(body for body, _, _ in logged[robot])
        for body in bodies:
            acknowledged = (robot, body) in answers
            if counts[body] > 1:
                yield f"robot {robot}: {body} was applied {counts[body]} times"
            if acknowledged and counts[body] == 0:
                yield f"robot {robot}: {body} was acknowledged and is lost"
            if not acknowledged:
                yield f"robot {robot}: {body} was never answered"
        order = [body for body, _, _ in logged[robot]]
        expected = [body for body in bodies if body in counts]
        if order != expected:
            yield f"robot {robot}: the log has its changes in another order"
        for body, sequence, made in logged[robot]:
            answer = answers.get((robot, body))
            if answer is not None and answer not in made:
                yield (f"robot {robot}: {body}, event {sequence}, was answered by {answer}, the "
                       f"replay's answer is {' '.join(made)}")
    for robot in set(logged) - set(sent) - set(others):
        yield f"robot {robot} has changes in the log that it never sent"


def check_operators(edits, journal):
    """`edits`: (x_um, y_um, status) of each, of which no two are at one place."""
    counts = collections.Counter((int(it[5]), int(it[6])) for it in journal.events if it[4] == "edit")
    for x_um, y_um, status in edits:
        count = counts[x_um, y_um]
        if count > 1:
            yield f"the edit at {x_um} {y_um} um was made {count} times"
        if status == 200 and count != 1:
            yield f"the edit at {x_um} {y_um} um was acknowledged and is lost"
    for place in set(counts) - {(x, y) for x, y, _ in edits}:
        yield f"the edit at {place} um was made by nobody"


def check_hashes(statuses, groups, journal):
    """`statuses`: (node, sequence, hash) that servers told of committed states."""
    found = journal.hashes()
    for node, sequence, told in statuses:
        if sequence in found and found[sequence] != told:
            yield f"{node} told hash {told} after event {sequence}, the replay has {found[sequence]}"
        elif sequence >= log_end(groups):
            yield (f"{node} told hash {told} after event {sequence} as committed, the log ends before "
                   f"event {log_end(groups)}")


class Halts:
    """Which robots a halt has to reach, and whether it does: fed with their history while it is made.

        halts.begin(t, robots)          # {robot: the place of its server in its list}
        while halts.missing(): ...      # more lines
        halts.end()
    """

    def __init__(self):
        self.servers = {}  # of each robot that has not moved since: when it was answered last, and where
        self.delays = []   # (t, robot, s until it came), without those while the program did not run
        self._t, self._waiting, self._came, self._stalls = 0.0, {}, [], []

    def feed(self, it):
        robot = it["robot"]
        if it["what"] == "answer":
            self.servers[robot] = it["t"], it["server"]
        elif it["what"] == "moved":
            self.servers.pop(robot, None)
            self._waiting.pop(robot, None)
        elif it["what"] == "stall":
            self._stalls.append((it["t"] - it["s"], it["t"]))
        elif it["what"] == "halt" and robot in self._waiting and it["t"] >= self._t:
            del self._waiting[robot]
            self._came.append((self._t, robot, it["t"] - self._t))

    def begin(self, t, robots):
        """Those that are still where they were."""
        self._t, self._came = t, []
        self._stalls = [it for it in self._stalls if it[1] > t]
        self._waiting = {robot: server for robot, server in robots.items()
                         if self.servers.get(robot, (0, None))[1] == server}

    def missing(self):
        return sorted(self._waiting)

    def end(self):
        self.delays += [(t, robot, s) for t, robot, s in self._came
                        if not any(begin < t + s and t < end for begin, end in self._stalls)]
        self._waiting = {}


def read(path):
    with open(path, encoding="ascii") as file:
        return [json.loads(line) for line in file]


def answered_since(path, t):
    """(robot, body) of the changes that were begun after t and are answered."""
    with open(path, encoding="ascii") as file:
        history = list(following(file))
    begun = {(it["robot"], it["body"]) for it in history if it["what"] == "sent" and it["t"] > t}
    return begun & {(it["robot"], it["body"]) for it in history if it["what"] == "answer"}


def following(file):
    """What was added to one that is still written, in whole lines."""
    while (at := file.tell(), line := file.readline())[1]:
        if not line.endswith("\n"):
            file.seek(at)
            return
        yield json.loads(line)


def latencies(history):
    """Of each change, (when it was sent, the time until its answer)."""
    begun, found = {}, []
    for it in history:
        if it["what"] == "sent":
            begun[it["robot"]] = it["t"]
        elif it["what"] == "answer" and it["robot"] in begun:
            found.append((begun[it["robot"]], it["t"] - begun[it["robot"]]))
    return found
