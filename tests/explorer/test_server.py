"""What the server of the explorer says on the terminal."""

import asyncio
from typing import Any

import pytest

from sweep.explorer.slices import Source

pytestmark = pytest.mark.browser


@pytest.mark.parametrize(("wrong", "said"), [("closed", []), ("broken", ["bokeh.server.protocol_handler"])])
def test_the_last_words_of_a_closing_page_are_no_error(
    wrong: str, said: list[str], source: Source, caplog: pytest.LogCaptureFixture
) -> None:
    """Under load they arrive after Bokeh has let go of the page's session."""
    from bokeh.protocol import Protocol
    from bokeh.server.connection import ServerConnection
    from bokeh.server.protocol_handler import ProtocolHandler

    from sweep.explorer.server import serve_beside

    serve_beside(source, None).close()
    caplog.clear()
    connection: Any = ServerConnection.__new__(ServerConnection)
    connection._protocol, connection._session = Protocol(), None if wrong == "closed" else object()
    asyncio.run(ProtocolHandler().handle(Protocol().create("PULL-DOC-REQ"), connection))
    assert [record.name for record in caplog.records] == said
