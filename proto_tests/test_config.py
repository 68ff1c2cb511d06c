"""Configurations of servers under test, put together from their tables.

    CONFIG = map_of(10, 10) + pheromone(1, "trail", tau_s=30) + pty("radio-a") + table("web", listen=...)
"""

import json


def value(it):
    if isinstance(it, dict):
        return "{" + ", ".join(f"{key} = {value(of)}" for key, of in it.items()) + "}"
    if isinstance(it, (list, tuple)):
        return "[" + ", ".join(map(value, it)) + "]"
    return json.dumps(it)


def table(header, /, **keys):
    """[header]; with brackets of its own, [[header]]."""
    return f"[{header}]\n" + "".join(f"{key} = {value(it)}\n" for key, it in keys.items())


def map_of(width_m=10.0, height_m=10.0, cell_m=0.1, bias_m=0.33, **more):
    """A map, and robots whose antennas are `bias_m` from their middle."""
    return (table("map", width_m=width_m, height_m=height_m, cell_m=cell_m, **more)
            + table("antennas", bias_m=bias_m))


def pheromone(number, name, tau_s=0, *, core_m=0.1, sigma_m=0.4, quantum=0.125, maximum=1.0):
    """Without `tau_s`, it stays."""
    return table("[pheromone]", type=number, name=name, core_m=core_m, sigma_m=sigma_m, tau_s=tau_s,
                 quantum=quantum, maximum=maximum)


def link(name, kind, **keys):
    return table("[link]", name=name, kind=kind, **keys)


def pty(name):
    return link(name, "pty", path=name + ".pty")
