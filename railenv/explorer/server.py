"""Serving the page to the browser of this machine, and to nobody else."""

from __future__ import annotations

import logging
import socket
import warnings
from typing import Any

import panel as pn
from bokeh.events import DocumentReady

from railenv import checks
from railenv.errors import ParameterError
from railenv.explorer import style
from railenv.explorer.page import Page
from railenv.explorer.state import State

ADDRESS = "127.0.0.1"
"""The loopback address: other machines cannot reach the page."""

PORT = 5006

TITLE = "railenv explore"


_TEMPLATE = f"""
{{% extends base %}}
{{% block postamble %}}
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>{style.WHOLE}</style>
<script>
// a file that misses its place would be opened instead of the page, and all would be lost
for (const name of ["dragover", "drop"]) {{
  window.addEventListener(name, (event) => {{
    if (!event.composedPath().some((part) => part.type === "file")) event.preventDefault()
  }})
}}
</script>
{{% endblock %}}
{{% block contents %}}
{{{{ embed(roots.page) }}}}
{{% endblock %}}
"""
"""The page around Panel's content."""


def build(state: State) -> Any:
    """Return the page of a new session."""
    page = Page(state)
    pn.state.on_session_destroyed(lambda _: page.close())
    if pn.state.curdoc is not None:
        pn.state.curdoc.js_on_event(DocumentReady, *page.begin)
    template = pn.Template(_TEMPLATE)
    template.add_panel("page", page.layout)
    return template


def server(state: State, port: int = PORT) -> Any:
    """Return a server of the page that listens on the loopback address, not yet started.

    Parameters
    ----------
    state : State
        State that a page shows first.
    port : int
        Port; 0 for any free one.

    Raises
    ------
    ParameterError
        If the port is invalid or taken.
    """
    port = checks.whole("port", port, low=0, high=65535)
    chosen = _free_port(port)

    def page() -> Any:
        return build(state)

    # pages of other sites in the same browser may not talk to it
    origins = [f"{host}:{chosen}" for host in (ADDRESS, "localhost")]
    warnings.filterwarnings("ignore", "the speed locus ends early", UserWarning)
    pn.extension()
    logging.getLogger("bokeh").setLevel(logging.ERROR)
    return pn.serve(
        {"/": page},
        address=ADDRESS,
        port=chosen,
        websocket_origin=origins,
        title=TITLE,
        show=False,
        start=False,
        verbose=False,
    )


def run(running: Any, *, browser: bool = True) -> None:
    """Run a server until it is interrupted; optionally open its page in the browser."""
    if browser:
        running.io_loop.add_callback(running.show, "/")
    running.run_until_shutdown()


def address(running: Any) -> str:
    """Return the address of a server's page."""
    return f"http://{ADDRESS}:{running.port}/"


def _free_port(port: int) -> int:
    with socket.socket() as tried:
        tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            tried.bind((ADDRESS, port))
        except OSError as error:
            raise ParameterError(f"port is {port}, which cannot be used: {error.strerror}") from None
        return int(tried.getsockname()[1])
