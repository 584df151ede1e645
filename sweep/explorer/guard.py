"""Refuse requests that pages of other sites make to the explorer.

A browser lets any page send requests to this machine, and a page whose own name leads to this machine could read the
answers.
"""

from __future__ import annotations

from secrets import compare_digest

from tornado.httputil import HTTPServerRequest
from tornado.routing import Matcher
from tornado.web import RequestHandler

NAMES = ("localhost", "127.0.0.1", "[::1]")
"""The names of this machine."""

KEY = "frame"
"""The key of an address that holds the secret of a notebook's frame, which may be part of a page of another site."""

_WORDS = "The explorer answers only its own pages. To open this address, select it in the address bar and press Enter."


class Foreign(Matcher):
    """Matches requests for another host or port, or from a page of another site that does not know the secret."""

    def __init__(self, port: int, secret: str) -> None:
        self.hosts = {f"{name}:{port}" for name in NAMES} | ({*NAMES} if port == 80 else set())
        self._secret = secret

    def match(self, request: HTTPServerRequest) -> dict[str, str] | None:
        host = request.host.lower()
        origin = request.headers.get("Origin", f"http://{host}").lower()
        elsewhere = request.headers.get("Sec-Fetch-Site") == "cross-site"
        secrets = request.query_arguments.get(KEY, [])
        if elsewhere and any(compare_digest(each, self._secret.encode()) for each in secrets):
            elsewhere = False
        known = host in self.hosts and origin.removeprefix("http://") in self.hosts and not elsewhere
        return None if known else {}


class Refusal(RequestHandler):
    """Answers every request with 403."""

    def prepare(self) -> None:
        self.set_status(403)
        self.finish(_WORDS)
