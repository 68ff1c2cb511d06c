"""A client of the pheromone protocol, version 1, by somebody who has read the specification only.

Nothing here comes from the server's source: protocol/README.md and the vectors are all that was
used. "Section n" is a section of that page. Python 3.11, standard library only.

    from stranger.client import Client, open_terminal

    with open_terminal("radio-a.pty") as line:
        robot = Client(line, client_id=7)
        server = robot.hello(nonce=42)
        robot.deposit(pheromone=1, x=1000, y=600)
        print(robot.sense(pheromone=1, x=1000, y=500, heading=0))

wire      frames and messages: bytes to fields and back (sections 1, 2, 4 and 6)
client    a robot's conversation with the server (sections 3, 7 and 8)
servers   its line to one of several servers by TCP or UDP (section 8)
__main__  the same as a program; --self-test holds it against protocol/vectors
testing   what proto_tests/stranger_test.py asks of a real server, and a model of the field
"""
