"""Serves the explorer to browsers on this machine, and to no one else."""

from __future__ import annotations

import asyncio
import logging
import signal
import threading
import traceback
import webbrowser
from collections.abc import Callable
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Any

from bokeh.application import Application
from bokeh.application.handlers import FunctionHandler
from bokeh.resources import Resources
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from bokeh.server.util import bind_sockets
from bokeh.server.views.ws import WSHandler
from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop

from sweep.explorer import view
from sweep.explorer.setup import Setup
from sweep.explorer.slices import Source

ADDRESS = "127.0.0.1"

_SECONDS = 60.0
"""Longest wait for an explorer in a thread to start or to end."""

FIRST_PORT, LAST_PORT = 5006, 5105
"""Tried in turn where no port is asked for, so that a link to the only explorer holds."""


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


@dataclass(frozen=True)
class Beside:
    """An explorer in a thread of this process; a notebook shows it as the value of a cell."""

    url: str
    height: int
    """Pixels in a notebook."""
    close: Callable[[], None]
    """Ends it."""

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.url}" width="100%" height="{self.height}" style="border: 0"></iframe>'


def _of_open_page(record: logging.LogRecord) -> bool:
    """Tell whether an error is of a page that is there: the last words of one that closes find no session any more."""
    error = record.exc_info[1] if record.exc_info else None
    places = traceback.extract_tb(error.__traceback__) if isinstance(error, AssertionError) else []
    return not (places and places[-1].name == "session")


def serve_beside(source: Source, setup: Setup | None, height: int = 0, port: int | None = 0) -> Beside:
    """Serve until it is closed or this process ends, and return at once; by default at any port that is free."""
    # Its advice to name an option of Bokeh's own command helps nobody here; the browser is refused all the same.
    logging.getLogger("bokeh.server.views.ws").setLevel(logging.CRITICAL)
    logging.getLogger("tornado.access").setLevel(logging.ERROR)
    logging.getLogger("bokeh.server.protocol_handler").addFilter(_of_open_page)
    sockets, found = _bind(port)
    hosts = [f"{host}:{found}" for host in ("localhost", ADDRESS)]
    url = f"http://{hosts[0]}/"
    ready, closed = SimpleQueue[IOLoop](), asyncio.Event()

    async def work() -> None:
        application = Application(FunctionHandler(view.make(source, setup)))
        web = _Web({"/": application}, extra_websocket_origins=hosts, absolute_url=url)
        http = HTTPServer(web)
        http.add_sockets(sockets)
        server = BaseServer(IOLoop.current(), web, http)
        server.start()
        ready.put(IOLoop.current())
        await closed.wait()
        server.stop()
        for one in sockets:
            one.close()
        await http.close_all_connections()

    thread = threading.Thread(target=lambda: asyncio.run(work()), daemon=True, name="explorer")
    thread.start()
    loop = ready.get(timeout=_SECONDS)

    def close() -> None:
        loop.add_callback(closed.set)
        thread.join(_SECONDS)

    return Beside(url, height, close)


class _Web(BokehTornado):  # type: ignore[misc]  # Bokeh tells no types of it
    """Sends only those of Bokeh's scripts that the page uses; its formulas and tables would be more than the rest."""

    def resources(self, absolute_url: str | bool | None = None) -> Resources:
        resources: Resources = super().resources(absolute_url)
        return resources.clone(components=["bokeh", "bokeh-widgets"])

    def get_handler_delegate(self, request: Any, target_class: Any, *others: Any, **named: Any) -> Any:
        target_class = _Socket if target_class is WSHandler else target_class
        return super().get_handler_delegate(request, target_class, *others, **named)


class _Socket(WSHandler):  # type: ignore[misc]
    """Sends each message at once: a click and its curve are dozens, and twice one waited 40 ms for the one before."""

    def open(self) -> None:
        super().open()
        self.set_nodelay(True)


def _bind(port: int | None) -> tuple[list[Any], int]:
    for each in [port] if port is not None else range(FIRST_PORT, LAST_PORT):
        try:
            return bind_sockets(ADDRESS, each)  # type: ignore[no-any-return]
        except OSError as error:
            last = error
    raise OSError(last.errno, last.strerror, f"port {port or f'{FIRST_PORT} to {LAST_PORT}'}")
