"""A robot as an operator has it.

    operated = OperatedRobot(daemon, "udp")       # by its link
    operated.command("set", 7, 300)               # once it was obeyed
    operated.known()["nonce"]

    link("udp", "udp", **signing(key_header, folder))   # a link for it; key_header None: unsigned
"""

import json
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from operated_daemon import await_that, check  # noqa: E402


def signing(key_header, folder, robot=1):
    """What a link of test_config.link has to have, for a robot with the key of that header."""
    if key_header is None:
        return {}
    keys = folder / "robots.keys"
    keys.touch(mode=0o600)
    keys.write_text(f"{robot} {''.join(re.findall(r'0x(..)', key_header.read_text()))}\n")
    return {"security": "require", "keys": keys.name}


class OperatedRobot:
    def __init__(self, daemon, link, robot=1):
        self.daemon = daemon
        self.link = link
        self.robot = robot

    def known(self):
        """What the server knows of it; None before it has said HELLO."""
        status, text = self.daemon.call("GET", "/api/v1/clients")
        check(status == 200, text)
        robots = [it for it in json.loads(text)["clients"] if it["id"] == self.robot and it["known"]]
        return robots[0] if robots else None

    def last(self, what):
        """Its "last_command" or "last_event", {} before the first."""
        return self.known()[what] or {}

    def command(self, name, *arguments):
        before = self.last("last_command").get("seq")
        status, text = self.daemon.call("POST", "/api/v1/command", {
            "link": self.link, "id": self.robot, "command": name, "arguments": list(arguments)})
        check(status == 200, text)

        def done():
            last = self.last("last_command")
            return last.get("seq") != before and last["outcome"] != "pending"

        await_that(done, f"{name} {arguments}")
        last = self.last("last_command")
        check(last["outcome"] == "accepted", str(last))
