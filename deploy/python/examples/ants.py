#!/usr/bin/env python3
"""Robots in one asyncio program: each walks at random and leaves a trail, and all are watched.

    ants.py udp:127.0.0.1:4951 --robots 5 --steps 20 [--server http://127.0.0.1:8377]
"""
import argparse
import asyncio
import math
import random
import secrets

from pheromone import DEFAULT_ADDRESS
from pheromone.aio import AsyncClient, AsyncServer
from pheromone.servers import open_line

TRAIL = 1  # the pheromone's number


async def walk(line: str, number: int, steps: int) -> None:
    async with AsyncClient(open_line(line), number, timeout=2) as robot:
        told = await robot.hello(nonce=secrets.randbelow(1 << 16))
        mm = 100 / told.pose_unit_10um
        x, y, heading = 5000.0, 5000.0, random.uniform(0, 2 * math.pi)
        for _ in range(steps):
            left, right = await robot.trace(TRAIL, round(x * mm), round(y * mm),
                                            round(heading / math.tau * 65536) % 65536)
            heading += random.gauss(0, 0.5) + 0.2 * (left > right) - 0.2 * (right > left)
            x = min(max(x + 100 * math.cos(heading), 0), 10000)
            y = min(max(y + 100 * math.sin(heading), 0), 10000)
            await asyncio.sleep(0.05)


async def watch(server: str) -> None:
    async for message in AsyncServer(server).watch("/clients"):
        print(len(message.value["clients"]), "robots", flush=True)


async def main(options: argparse.Namespace) -> None:
    watching = asyncio.create_task(watch(options.server))
    await asyncio.gather(*(walk(options.line, number, options.steps)
                           for number in range(1, options.robots + 1)))
    watching.cancel()
    trail = await AsyncServer(options.server).map_as_array("trail")
    print(trail, "and the highest level is", max(max(row) for row in trail.values))


parser = argparse.ArgumentParser(description="Robots that walk at random and leave a trail.")
parser.add_argument("line", help="the server's link: udp:HOST:PORT or HOST:PORT")
parser.add_argument("--server", default=DEFAULT_ADDRESS)
parser.add_argument("--robots", type=int, default=5)
parser.add_argument("--steps", type=int, default=20)
asyncio.run(main(parser.parse_args()))
