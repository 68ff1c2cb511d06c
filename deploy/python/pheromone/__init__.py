"""Pheromones for robots and scripts: the clients of pheromoned, the virtual-pheromone server.

    import pheromone

    server = pheromone.Server("http://127.0.0.1:8377", token="...")
    server.paint("path", [(1, 1), (4, 1)], radius_m=0.1)
    server.map_as_array("path")               # in a notebook, a picture

    from pheromone.robot import Client
    from pheromone.servers import open_line

    with open_line("udp:127.0.0.1:4951") as line:
        robot = Client(line, client_id=7)
        robot.hello(nonce=42)
        print(robot.sense(pheromone=1, x=2000, y=1050, heading=0))

server      the HTTP interface and the live stream: Server; Tracker reports poses of a camera
maps        what a Server's map_as_array gives: Map
recordings  what a server has recorded, as arrays: Recording
robot       a robot's side of the protocol, written from protocol/README.md alone: Client
servers     a robot's line: open_line
drive       a robot of any make that follows a trail: Drive, Follower
aio         Client and Server for asyncio: AsyncClient, AsyncServer
wire        frames and messages of the protocol: bytes to fields and back
__main__    a robot's requests as a program: python3 -m pheromone --help

Python 3.10 or newer. Nothing but the standard library is needed; arrays are NumPy's if NumPy is
installed, else lists. The modules for robots need a Unix.
"""

from ._answers import ProtocolError, Refused
from ._stream import Message
from .maps import Map
from .server import DEFAULT_ADDRESS, Sensed, Server, Tracker

__all__ = ["DEFAULT_ADDRESS", "Map", "Message", "ProtocolError", "Refused", "Sensed", "Server",
           "Tracker"]
