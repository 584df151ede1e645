"""Serves the explorer to browsers on this machine, and to no one else."""

from __future__ import annotations

import logging
import signal
import webbrowser
from collections.abc import Callable
from typing import Any

from bokeh.application import Application
from bokeh.application.handlers import FunctionHandler
from bokeh.resources import Resources
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from bokeh.server.util import bind_sockets
from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop

from sweep.explore import view
from sweep.explore.setup import Setup
from sweep.explore.slices import Source

ADDRESS = "127.0.0.1"

FIRST_PORT, LAST_PORT = 5006, 5105
"""Tried in turn where no port is asked for, so that a link to the only explorer holds."""


def serve(source: Source, setup: Setup | None, port: int | None, *, browser: bool, say: Callable[[str], None]) -> None:
    """Serve until Ctrl-C; without a `setup` no trajectories are run.

    Raises
    ------
    OSError
        if the port is in use.
    """
    # Its advice to name an option of Bokeh's own command helps nobody here; the browser is refused all the same.
    logging.getLogger("bokeh.server.views.ws").setLevel(logging.CRITICAL)
    logging.getLogger("tornado.access").setLevel(logging.ERROR)
    sockets, found = _bind(port)
    hosts = [f"{host}:{found}" for host in ("localhost", ADDRESS)]
    url = f"http://{hosts[0]}/"
    loop = IOLoop()
    loop.make_current()
    application = Application(FunctionHandler(view.make(source, setup)))
    web = _Web({"/": application}, extra_websocket_origins=hosts, absolute_url=url)
    http = HTTPServer(web)
    http.add_sockets(sockets)
    BaseServer(loop, web, http).start()
    say(f"exploring {source.name} at {url} (Ctrl-C ends it)")
    if browser:
        loop.add_callback(lambda: webbrowser.open(url))
    for end in (signal.SIGINT, signal.SIGTERM):
        signal.signal(end, lambda *_: loop.add_callback_from_signal(loop.stop))
    loop.start()


class _Web(BokehTornado):  # type: ignore[misc]  # Bokeh tells no types of it
    """Sends only those of Bokeh's scripts that the page uses; its formulas and tables would be more than the rest."""

    def resources(self, absolute_url: str | bool | None = None) -> Resources:
        resources: Resources = super().resources(absolute_url)
        return resources.clone(components=["bokeh", "bokeh-widgets"])


def _bind(port: int | None) -> tuple[list[Any], int]:
    for each in [port] if port is not None else range(FIRST_PORT, LAST_PORT):
        try:
            return bind_sockets(ADDRESS, each)  # type: ignore[no-any-return]
        except OSError as error:
            last = error
    raise OSError(last.errno, last.strerror, f"port {port or f'{FIRST_PORT} to {LAST_PORT}'}")
