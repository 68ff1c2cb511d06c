#!/usr/bin/env python3
"""Stands between a server and etcd's members, and can be told to lie: groups that the server appends
are dropped, and it is told that they are in the log. For a checker that has to notice that.

    lying_relay.py CLUSTER PORT=HOST:PORT...       lies from the first line of its standard input on

Once it lies it prints a line.
"""

import base64
import json
import select
import socket
import sys
import threading

SAYS = json.dumps({"header": {"revision": "1"}, "succeeded": True,
                   "responses": [{"response_put": {"header": {"revision": "1"}}}]}).encode()


class Relay:
    def __init__(self, cluster):
        self.log = f"/pheromone/{cluster}/log/".encode()
        self.lies = False

    def listen(self, port, member):
        with socket.create_server(("127.0.0.1", port)) as listening:
            while True:
                client, _ = listening.accept()
                threading.Thread(target=self.serve, args=(client, member), daemon=True).start()

    def serve(self, client, member):
        try:
            with client, socket.create_connection(member) as server:
                self.pass_on(client, server)
        except OSError:
            pass

    def pass_on(self, client, server):
        asked = b""
        while True:
            for one in select.select((client, server), (), ())[0]:
                data = one.recv(1 << 16)
                if not data:
                    return
                if one is server:
                    client.sendall(data)
                    continue
                asked += data
                while (size := request_size(asked)) is not None and len(asked) >= size:
                    request, asked = asked[:size], asked[size:]
                    if self.lies and self.appends(request):
                        client.sendall(b"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\n"
                                       b"Content-Length: %d\r\n\r\n" % len(SAYS) + SAYS)
                    else:
                        server.sendall(request)

    def appends(self, request):
        head, _, body = request.partition(b"\r\n\r\n")
        if b"/kv/txn" not in head.split(b"\r\n")[0]:
            return False
        puts = [base64.b64decode((it.get("request_put") or it.get("requestPut"))["key"])
                for it in json.loads(body).get("success", [])
                if it.get("request_put") or it.get("requestPut")]
        return any(key.startswith(self.log) for key in puts)


def request_size(data):
    """Of the first request, once its head is there; None."""
    head, ends, _ = data.partition(b"\r\n\r\n")
    if not ends:
        return None
    sizes = [int(line.split(b":")[1]) for line in head.split(b"\r\n")
             if line.lower().startswith(b"content-length:")]
    return len(head) + 4 + (sizes[0] if sizes else 0)


def main():
    relay = Relay(sys.argv[1])
    for word in sys.argv[2:]:
        port, _, member = word.partition("=")
        host, _, of_member = member.rpartition(":")
        threading.Thread(target=relay.listen, args=(int(port), (host, int(of_member))),
                         daemon=True).start()
    sys.stdin.readline()
    relay.lies = True
    print("lies", flush=True)
    sys.stdin.read()


if __name__ == "__main__":
    main()
