"""Client and Server for asyncio: the same methods, awaited.

    async with AsyncClient(open_line("udp:127.0.0.1:4951"), client_id=7) as robot:
        await robot.hello(nonce=42)
        print(await robot.sense(1, 1000, 500, 0))

    server = AsyncServer("http://127.0.0.1:8377", token="...")
    async for message in server.watch("/clients"):
        print(message.value)

Requests are made in threads, so that there is one implementation of the protocol. A robot has one
thread, and one request at a time: further ones wait. A request whose task is cancelled goes on until
it is answered or given up, and the next one waits for that. `on_command` of a Client is called in
its thread.
"""

from __future__ import annotations

import asyncio
import functools
from collections.abc import AsyncIterator, Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Concatenate, ParamSpec, TypeVar

from ._stream import Message
from .robot import Client, Line, ServerInfo
from .server import Json, Server

P = ParamSpec("P")
T = TypeVar("T")


def _of_client(
    method: Callable[Concatenate[Client, P], T]
) -> Callable[Concatenate[AsyncClient, P], Coroutine[Any, Any, T]]:
    @functools.wraps(method)
    async def request(self: AsyncClient, /, *args: P.args, **kwargs: P.kwargs) -> T:
        return await self._run(functools.partial(method, self.client, *args, **kwargs))

    return request


def _of_server(
    method: Callable[Concatenate[Server, P], T]
) -> Callable[Concatenate[AsyncServer, P], Coroutine[Any, Any, T]]:
    @functools.wraps(method)
    async def request(self: AsyncServer, /, *args: P.args, **kwargs: P.kwargs) -> T:
        return await asyncio.to_thread(functools.partial(method, self.server, *args, **kwargs))

    return request


class AsyncClient:
    """A robot; see robot.Client for what it is made of. Owns the line."""

    def __init__(self, line: Line, client_id: int, **options: Any) -> None:
        self.client = Client(line, client_id, **options)
        self._thread = ThreadPoolExecutor(1, f"robot {client_id}")

    ping = _of_client(Client.ping)
    sense = _of_client(Client.sense)
    trace = _of_client(Client.trace)
    deposit = _of_client(Client.deposit)
    event = _of_client(Client.event)
    scan = _of_client(Client.scan)
    read = _of_client(Client.read)
    erase = _of_client(Client.erase)
    register = _of_client(Client.register)
    define = _of_client(Client.define)
    resolve = _of_client(Client.resolve)
    listen = _of_client(Client.listen)

    async def hello(self, nonce: int, **fields: int) -> ServerInfo:
        return await self._run(functools.partial(self.client.hello, nonce, **fields))

    async def write(
        self, x: int, y: int, tag: int, statement: dict[str, int], **more: int
    ) -> dict[str, Any]:
        return await self._run(functools.partial(self.client.write, x, y, tag, statement, **more))

    async def _run(self, call: Callable[[], T]) -> T:
        return await asyncio.get_running_loop().run_in_executor(self._thread, call)

    async def close(self) -> None:
        """After the request that is being made."""
        await self._run(self.client.line.close)
        self._thread.shutdown(wait=False)

    async def __aenter__(self) -> AsyncClient:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()


class AsyncServer:
    """A running pheromoned; made as server.Server is."""

    def __init__(self, *args: Any, **options: Any) -> None:
        self.server = Server(*args, **options)

    status = _of_server(Server.status)
    clients = _of_server(Server.clients)
    robots_as_array = _of_server(Server.robots_as_array)
    links = _of_server(Server.links)
    laws = _of_server(Server.laws)
    tags = _of_server(Server.tags)
    tags_as_array = _of_server(Server.tags_as_array)
    nets = _of_server(Server.nets)
    nets_as_array = _of_server(Server.nets_as_array)
    sense = _of_server(Server.sense)
    map_as_array = _of_server(Server.map_as_array)
    picture = _of_server(Server.picture)
    obstacles = _of_server(Server.obstacles)
    events = _of_server(Server.events)
    captures = _of_server(Server.captures)
    download_capture = _of_server(Server.download_capture)
    deposit = _of_server(Server.deposit)
    paint = _of_server(Server.paint)
    erase = _of_server(Server.erase)
    change_law = _of_server(Server.change_law)
    command = _of_server(Server.command)
    go_to = _of_server(Server.go_to)
    cancel_goal = _of_server(Server.cancel_goal)
    halt = _of_server(Server.halt)
    start_capture = _of_server(Server.start_capture)
    stop_capture = _of_server(Server.stop_capture)
    snapshot = _of_server(Server.snapshot)

    async def get(self, resource: str, **query: Any) -> Json:
        return await asyncio.to_thread(self.server.get, resource, **query)

    async def post(self, resource: str, **body: Any) -> Json:
        return await asyncio.to_thread(self.server.post, resource, **body)

    async def watch(self, *topics: str, timeout_s: float | None = None) -> AsyncIterator[Message]:
        """As Server.watch, in a thread of its own, which ends with the iteration."""
        loop = asyncio.get_running_loop()
        thread = ThreadPoolExecutor(1, "watch")
        try:
            stream = await loop.run_in_executor(thread, self.server.stream, timeout_s)
            messages = stream.messages(topics)

            def following() -> Message | None:
                return next(messages, None)

            try:
                while (message := await loop.run_in_executor(thread, following)) is not None:
                    yield message
            finally:
                stream.interrupt()  # whoever waits in the thread finds the end
                thread.submit(stream.__exit__)
        finally:
            thread.shutdown(wait=False)
