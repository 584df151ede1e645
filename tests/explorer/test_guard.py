"""Requests of other sites get no page, whatever name they use for this machine."""

from __future__ import annotations

import re
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from http import HTTPStatus
from http.client import HTTPConnection
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import pytest

import sweep
from sweep.explorer.slices import Source

if TYPE_CHECKING:
    from sweep.explorer.server import Beside

pytestmark = pytest.mark.browser

PATHS = ("/", "/static/js/bokeh.min.js", "/ws", "/metadata", "/autoload.js", "/nothing")


@pytest.fixture(scope="module")
def shown() -> Iterator[Beside]:
    from sweep.explorer.server import serve_beside

    explored = serve_beside(Source(sweep.predict({"friction": {"mu": [40, 60]}, "body": {"b": [2, 3]}})), None)
    yield explored
    explored.close()


def answer(shown: Beside, path: str = "/", **headers: str) -> tuple[int, str]:
    """The status of a request, and the page if there is one; in the names of headers, _ stands for -."""
    port = urlsplit(shown.url).port
    given = {name.replace("_", "-"): text.replace("PORT", str(port)) for name, text in headers.items()}
    with closing(HTTPConnection("127.0.0.1", port, timeout=60)) as connection:
        connection.request("GET", path, headers=given)
        with connection.getresponse() as response:
            return response.status, response.read().decode() if response.status == HTTPStatus.OK else ""


OWN_NAMES = ("localhost:PORT", "127.0.0.1:PORT", "[::1]:PORT")
OTHER_NAMES = (
    "evil.example:PORT", "evil.example", "localhost", "localhost:1", "localhost.evil.example:PORT", "127.0.0.2:PORT",
)  # fmt: skip
OTHER_SITES = (
    {"Sec_Fetch_Site": "cross-site"},
    {"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "navigate", "Sec_Fetch_Dest": "iframe"},
    {"Origin": "http://evil.example:PORT"},
    {"Origin": "null"},
)


@pytest.mark.parametrize("path", PATHS)
def test_requests_of_other_sites_and_by_other_names_are_refused(path: str, shown: Beside) -> None:
    for host in OWN_NAMES:
        assert answer(shown, path, Host=host)[0] != HTTPStatus.FORBIDDEN, host
    for headers in (*({"Host": host} for host in OTHER_NAMES), *OTHER_SITES):
        assert answer(shown, path, **headers)[0] == HTTPStatus.FORBIDDEN, headers


@pytest.mark.parametrize("site", ["none", "same-origin", "same-site"])
def test_an_address_that_was_typed_and_a_notebook_are_answered(site: str, shown: Beside) -> None:
    assert answer(shown, Sec_Fetch_Site=site)[0] == HTTPStatus.OK
    assert answer(shown, shown.frame.removeprefix(shown.url[:-1]), Sec_Fetch_Site="cross-site")[0] == HTTPStatus.OK
    assert answer(shown, "/?frame=guessed", Sec_Fetch_Site="cross-site")[0] == HTTPStatus.FORBIDDEN


def test_no_page_is_built_for_another_site(shown: Beside, monkeypatch: pytest.MonkeyPatch) -> None:
    from sweep.explorer import view

    built, make = list[object](), view.View
    monkeypatch.setattr(view, "View", lambda *arguments: built.append(arguments) or make(*arguments))
    with ThreadPoolExecutor(40) as pool:
        found = pool.map(lambda _: answer(shown, Sec_Fetch_Site="cross-site"), range(40))
        assert {status for status, _ in found} == {HTTPStatus.FORBIDDEN}
    assert not built
    assert answer(shown)[0] == HTTPStatus.OK
    assert len(built) == 1


@pytest.mark.parametrize(
    ("origin", "status"),
    [
        ("http://localhost:PORT", HTTPStatus.SWITCHING_PROTOCOLS),
        ("http://127.0.0.1:PORT", HTTPStatus.SWITCHING_PROTOCOLS),
        ("http://[::1]:PORT", HTTPStatus.SWITCHING_PROTOCOLS),
        ("http://evil.example:PORT", HTTPStatus.FORBIDDEN),
        ("http://localhost.evil.example:PORT", HTTPStatus.FORBIDDEN),
    ],
)
def test_a_websocket_opens_from_this_machine_alone(origin: str, status: HTTPStatus, shown: Beside) -> None:
    found = re.search(r'"token":"([^"]+)"', answer(shown)[1])
    assert found
    headers = {
        "Origin": origin, "Upgrade": "websocket", "Connection": "Upgrade", "Sec_WebSocket_Version": "13",
        "Sec_WebSocket_Key": "dGhlIHNhbXBsZSBub25jZQ==", "Sec_WebSocket_Protocol": f"bokeh, {found[1]}",
    }  # fmt: skip
    assert answer(shown, "/ws", **headers)[0] == status


@pytest.mark.parametrize("path", ["/?bokeh-session-id=%00", "/?bokeh-token=abc", "/static/%00"])
def test_an_address_that_means_nothing_is_refused_without_a_word(
    path: str, shown: Beside, capfd: pytest.CaptureFixture[str]
) -> None:
    assert answer(shown, path)[0] == HTTPStatus.INTERNAL_SERVER_ERROR
    assert capfd.readouterr() == ("", "")
