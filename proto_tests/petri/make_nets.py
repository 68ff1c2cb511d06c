#!/usr/bin/env python3
"""Makes nets of the Model Checking Contest (https://mcc.lip6.fr) as PNML, unfolded.

Usage: make_nets.py NET N > FILE.pnml      a net of size N
       make_nets.py --counts               for each net and size: "NET N REACHABLE", as published

Nets are written from their description, not from the contest's files, so that IDs differ from those.
"""

import sys
from xml.sax.saxutils import quoteattr


class Net:
    """A net in the making; arcs are (place, weight)."""

    def __init__(self):
        self.tokens = {}
        self.transitions = {}

    def place(self, name, tokens=0):
        self.tokens[name] = tokens
        return name

    def transition(self, name, takes, gives):
        """Lists of places; one that is named twice has the weight 2."""
        self.transitions[name] = (takes, gives)

    def pnml(self, name):
        """Yields the lines of the document."""
        def arc(number, source, target, weight):
            label = f"<inscription><text>{weight}</text></inscription>" if weight != 1 else ""
            return f'<arc id="a{number}" source={quoteattr(source)} target={quoteattr(target)}>{label}</arc>'

        yield '<?xml version="1.0" encoding="UTF-8"?>'
        yield '<pnml xmlns="http://www.pnml.org/version-2009/grammar/pnml">'
        yield f'<net id="net" type="http://www.pnml.org/version-2009/grammar/ptnet">'
        yield f'<name><text>{name}</text></name><page id="page">'
        for place, tokens in self.tokens.items():
            yield (f"<place id={quoteattr(place)}><initialMarking><text>{tokens}</text>"
                   "</initialMarking></place>")
        number = 0
        for transition, (takes, gives) in self.transitions.items():
            yield f"<transition id={quoteattr(transition)}/>"
            for place in dict.fromkeys(takes):
                number += 1
                yield arc(number, place, transition, takes.count(place))
            for place in dict.fromkeys(gives):
                number += 1
                yield arc(number, transition, place, gives.count(place))
        yield "</page></net></pnml>"


def kanban(size):
    """Four cells of a factory, each with `size` cards.

    G. Ciardo, M. Tilgner: On the use of Kronecker operators for the solution of generalized
    stochastic Petri nets. ICASE report 96-35, 1996, with these counts.
    """
    net = Net()
    for i in "1234":
        net.place("Pm" + i)
        net.place("Pback" + i)
        net.place("Pkan" + i, size)
        net.place("Pout" + i)
        net.transition("tredo" + i, ["Pm" + i], ["Pback" + i])
        net.transition("tok" + i, ["Pm" + i], ["Pout" + i])
        net.transition("tback" + i, ["Pback" + i], ["Pm" + i])
    net.transition("tin1", ["Pkan1"], ["Pm1"])
    net.transition("tsynch1_23", ["Pout1", "Pkan2", "Pkan3"], ["Pkan1", "Pm2", "Pm3"])
    net.transition("tsynch23_4", ["Pout2", "Pout3", "Pkan4"], ["Pkan2", "Pkan3", "Pm4"])
    net.transition("tout4", ["Pout4"], ["Pkan4"])
    return net


def philosophers(size):
    """Dining philosophers who take their two forks one after the other, in any order.

    The contest's "Philosophers". A fork is on the table or with one of its two neighbours, and any
    combination is reachable: 3 ** size.
    """
    net = Net()
    for i in range(size):
        for place in ("Catch1", "Catch2", "Eat"):
            net.place(f"{place}_{i}")
        net.place(f"Think_{i}", 1)
        net.place(f"Fork_{i}", 1)
    for i in range(size):
        left, right = f"Fork_{i}", f"Fork_{(i + 1) % size}"
        net.transition(f"FF1a_{i}", [f"Think_{i}", left], [f"Catch1_{i}"])
        net.transition(f"FF1b_{i}", [f"Think_{i}", right], [f"Catch2_{i}"])
        net.transition(f"FF2a_{i}", [f"Catch1_{i}", right], [f"Eat_{i}"])
        net.transition(f"FF2b_{i}", [f"Catch2_{i}", left], [f"Eat_{i}"])
        net.transition(f"End_{i}", [f"Eat_{i}"], [f"Think_{i}", left, right])
    return net


def fms(size):
    """A flexible manufacturing system: `size` parts of three kinds, and three machines.

    G. Ciardo, K. Trivedi: A decomposition approach for stochastic reward net models. Performance
    Evaluation 18(1), 1993; without priorities and with batches of 1, as in the contest, which has
    these counts.
    """
    net = Net()
    for kind, machine, machines in (("1", "M1", 3), ("2", "M2", 1)):
        part = "P" + kind
        other = "P2" if kind == "1" else "P1"
        net.place(part, size)
        for suffix in ("w" + machine, machine, "d", "s", "w" + other):
            net.place(part + suffix)
        net.place(machine, machines)
        net.transition("t" + part, [part], [part + "w" + machine])
        net.transition("t" + part + machine, [part + "w" + machine, machine], [part + machine])
        net.transition("t" + machine + part, [part + machine], [part + "d", machine])
        net.transition("t" + part + "e", [part + "d"], [part + "s"])
        net.transition("t" + part + "j", [part + "d"], [part + "w" + other])
        net.transition("t" + part + "s", [part + "s"], [part])
    net.place("P3", size)
    net.place("P3M2")
    net.place("P3s")
    net.transition("tP3", ["P3"], ["P3M2"])
    net.transition("tP3M2", ["P3M2", "M2"], ["P3s", "M2"])
    net.transition("tP3s", ["P3s"], ["P3"])
    for place in ("P12", "P12wM3", "P12M3", "P12s"):
        net.place(place)
    net.place("M3", 2)
    net.transition("tx", ["P1wP2", "P2wP1"], ["P12"])
    net.transition("tP12", ["P12"], ["P12wM3"])
    net.transition("tP12M3", ["P12wM3", "M3"], ["P12M3"])
    net.transition("tM3P12", ["P12M3"], ["P12s", "M3"])
    net.transition("tP12s", ["P12s"], ["P1", "P2"])
    return net


def swimming_pool(size):
    """Bathers who need a cabin to change in and a bag for their clothes; they may get stuck.

    The contest's "SwimmingPool", with these counts.
    """
    net = Net()
    net.place("Out", 20 * size)
    for place in ("Entered", "WaitBag", "Undress", "InBath", "Dress", "Dressed"):
        net.place(place)
    net.place("Cabins", 10 * size)
    net.place("Bags", 15 * size)
    net.transition("Enter", ["Out"], ["Entered"])
    net.transition("GetK", ["Entered", "Cabins"], ["WaitBag"])
    net.transition("GetB", ["WaitBag", "Bags"], ["Undress"])
    net.transition("RelK", ["Undress"], ["InBath", "Cabins"])
    net.transition("GetK2", ["InBath", "Cabins"], ["Dress"])
    net.transition("RBag", ["Dress"], ["Dressed", "Bags"])
    net.transition("RKey", ["Dressed"], ["Out", "Cabins"])
    return net


def token_ring(size):
    """Dijkstra's self-stabilising ring of size + 1 processes, each with a number of its own at first.

    E. W. Dijkstra: Self-stabilizing systems in spite of distributed control. CACM 17(11), 1974; the
    contest's "TokenRing", with these counts.
    """
    net = Net()
    count = size + 1
    for process in range(count):
        for value in range(count):
            net.place(f"State_{process}_{value}", int(process == value))
    for value in range(count):
        last = f"State_{size}_{value}"
        net.transition(f"Main_{value}", [f"State_0_{value}", last],
                       [f"State_0_{(value + 1) % count}", last])
    for process in range(1, count):
        for value in range(count):
            for before in range(count):
                if before != value:
                    left = f"State_{process - 1}_{before}"
                    net.transition(f"Other_{process}_{value}_{before}",
                                   [f"State_{process}_{value}", left],
                                   [f"State_{process}_{before}", left])
    return net


NETS = {"kanban": kanban, "philosophers": philosophers, "fms": fms, "swimming_pool": swimming_pool,
        "token_ring": token_ring}

COUNTS = [
    ("kanban", 1, 160), ("kanban", 2, 4600), ("kanban", 3, 58400), ("kanban", 4, 454475),
    ("kanban", 5, 2546432),
    ("philosophers", 5, 243), ("philosophers", 10, 59049),
    ("fms", 1, 120), ("fms", 2, 3444), ("fms", 3, 48590), ("fms", 4, 438600), ("fms", 5, 2895018),
    ("swimming_pool", 1, 89621),
    ("token_ring", 5, 166), ("token_ring", 10, 58905),
]


def main(arguments):
    if arguments == ["--counts"]:
        for row in COUNTS:
            print(*row)
    elif len(arguments) == 2 and arguments[0] in NETS and arguments[1].isdigit():
        for line in NETS[arguments[0]](int(arguments[1])).pnml("-".join(arguments)):
            print(line)
    else:
        sys.exit(f"usage: make_nets.py NET N | --counts, where NET is one of {', '.join(NETS)}")


if __name__ == "__main__":
    main(sys.argv[1:])
