"""Serve the explorer to browsers on this machine only."""

from __future__ import annotations

import asyncio
import logging
import signal
import socket
import threading
import traceback
import webbrowser
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from secrets import token_urlsafe

from bokeh.server.server import Server
from tornado.routing import Rule

from sweep.explorer import view
from sweep.explorer.guard import KEY, Foreign, Refusal
from sweep.explorer.setup import Setup
from sweep.explorer.slices import Source

PORTS = range(5006, 5106)
"""Ports tried in turn if none is requested, so that links to a single explorer stay valid."""

_PACKAGE = Path(__file__).parents[1]
_SECONDS = 60.0
"""Longest wait for an explorer to start or to end."""


@dataclass(frozen=True)
class Beside:
    """An explorer in a thread of this process; a notebook shows it as the value of a cell."""

    url: str
    frame: str
    """The address that a notebook opens, whose page may be of another site."""
    height: int
    """Pixels in a notebook."""
    close: Callable[[], None]
    """Ends the server."""

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.frame}" width="100%" height="{self.height}" style="border: 0"></iframe>'


def serve(source: Source, setup: Setup | None, port: int | None, *, browser: bool, say: Callable[[str], None]) -> None:
    """Serve until Ctrl-C; without a `setup` no trajectories are run.

    Raises
    ------
    OSError
        if the port is in use.
    """
    url = serve_beside(source, setup, port=port).url
    ended = threading.Event()
    for end in (signal.SIGINT, signal.SIGTERM):
        signal.signal(end, lambda *_: ended.set())
    say(f"exploring {source.name} at {url} (Ctrl-C ends it)")
    if browser:
        webbrowser.open(url)
    ended.wait()


def serve_beside(source: Source, setup: Setup | None, height: int = 0, port: int | None = 0) -> Beside:
    """Serve until it is closed or this process ends, and return at once; by default on any free port."""
    _quieten()
    secret = token_urlsafe()
    began, ended = Future[tuple[str, asyncio.AbstractEventLoop]](), asyncio.Event()

    async def work() -> None:
        try:
            server = _server(source, setup, port, secret)
        except Exception as error:  # raised in the caller's thread
            began.set_exception(error)
            return
        server.start()
        began.set_result((f"http://localhost:{server.port}/", asyncio.get_running_loop()))
        await ended.wait()
        server.stop()
        server.unlisten()
        await asyncio.sleep(0.1)  # waits until its connections are closed

    thread = threading.Thread(target=lambda: asyncio.run(work()), daemon=True, name="explorer")
    thread.start()
    url, loop = began.result(_SECONDS)

    def close() -> None:
        loop.call_soon_threadsafe(ended.set)
        thread.join(_SECONDS)

    return Beside(url, f"{url}?{KEY}={secret}", height, close)


def _server(source: Source, setup: Setup | None, port: int | None, secret: str) -> Server:
    """Make Bokeh's server on a port, or on the first free one of `PORTS`; it refuses pages of other sites."""
    fill = view.make(source, setup)
    for each in PORTS if port is None else [port]:
        try:
            server = Server(fill, address="127.0.0.1", port=each)
        except OSError as error:
            last = error
            continue
        foreign = Foreign(server.port, secret)
        server._tornado.default_router.rules.insert(0, Rule(foreign, Refusal))
        server._tornado.websocket_origins.update(foreign.hosts)
        for listening in server._http._sockets.values():  # else each click waits 40 ms twice
            listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return server
    raise OSError(last.errno, last.strerror, f"port {port or f'{PORTS[0]} to {PORTS[-1]}'}")


def _quieten() -> None:
    """Keep messages of Bokeh and Tornado about closing pages and odd addresses off the terminal; our errors stay."""
    for name in ("bokeh.server.views.ws", "tornado.access", "tornado.general"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    # The last words of a page that closes under load find no session, which Bokeh asserts; and an address may name a
    # session, a token or a file that cannot exist.
    for name in ("bokeh.server.protocol_handler", "tornado.application"):
        logging.getLogger(name).addFilter(_is_ours)


def _is_ours(record: logging.LogRecord) -> bool:
    """Return whether a message is about an error in this package, or no error."""
    frames = traceback.walk_tb(record.exc_info[2] if record.exc_info else None)
    files = [Path(frame.f_code.co_filename) for frame, _ in frames]
    return not files or any(file.is_relative_to(_PACKAGE) for file in files)
