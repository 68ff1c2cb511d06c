"""Ports of loopback and domains of DDS that no other test on this machine has, and that nobody is at.

A number belongs to this process until it ends. Its mark is the name of a socket, which like a port is
there once in a network namespace.
"""

import contextlib
import errno
import random
import socket

# Domain d has the 250 ports from 7400 + 250 d on. All are below those that the system gives to whoever
# connects, of which it could give one away before its owner listens.
DOMAINS = range(1, 80)
PORTS = range(7400 + 250 * DOMAINS.stop, 32_768)


def free_port():
    """For TCP or UDP."""
    return next(it for it in random.sample(PORTS, len(PORTS)) if _take(f"port-{it}", it))


def free_domain():
    return next(it for it in DOMAINS if _take(f"domain-{it}", 7400 + 250 * it + 10))


def _take(name, port):
    """Whether it is this process's from now on: it was not marked, and nobody is at this port."""
    with contextlib.ExitStack() as probes:
        mark = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            mark.bind(f"\0pheromone-test-{name}")
            for kind in (socket.SOCK_STREAM, socket.SOCK_DGRAM):
                probes.enter_context(socket.socket(socket.AF_INET, kind)).bind(("127.0.0.1", port))
        except OSError as error:
            mark.close()
            if error.errno != errno.EADDRINUSE:
                raise
            return False
    mark.detach()  # the system closes it at this process's end
    return True
