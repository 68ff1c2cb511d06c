"""The Python client of the pheromone protocol, deploy/python/pheromone, as a judge of servers.

Nothing in its modules wire, robot and servers comes from the server's source: protocol/README.md and
the vectors are all that was used. "Section n" is a section of that page. Tests name them:

stranger.wire      frames and messages
stranger.client    a robot's conversation with the server: pheromone.robot
stranger.servers   its line to one of several servers
stranger.testing   what proto_tests/stranger_test.py asks of a real server, and a model of the field
"""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2] / "deploy/python"))
from pheromone import robot as client  # noqa: E402
from pheromone import servers, wire  # noqa: E402

sys.modules.update({f"{__name__}.client": client, f"{__name__}.servers": servers,
                    f"{__name__}.wire": wire})
