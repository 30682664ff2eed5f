"""Where the page listens, and who may talk to it."""

import asyncio
import socket
import subprocess
import sys
import urllib.error
import urllib.request

import pytest

pytest.importorskip("panel", reason="needs the extra explore")

from typer.testing import CliRunner

from railenv import cli
from railenv.errors import ParameterError
from railenv.explorer import server
from railenv.explorer.state import State


@pytest.fixture(scope="module")
def running():
    """A server in a process of its own; its port."""
    command = [sys.executable, "-m", "railenv.cli", "explore", "--no-browser", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        said = process.stdout.readline()
        assert said.startswith("the Explorer is at http://127.0.0.1:"), said
        yield int(said.strip().rstrip("/").rpartition(":")[2])
        process.terminate()
        process.wait(timeout=60)


def test_it_serves_a_page_that_loads_nothing_from_elsewhere(running):
    with urllib.request.urlopen(f"http://127.0.0.1:{running}/", timeout=120) as answer:
        page = answer.read().decode()
    assert "<title>railenv explore</title>" in page
    assert 'name="viewport"' in page
    addresses = [part.split('"')[1] for part in page.split("<") if " src=" in part or " href=" in part]
    assert not [a for a in addresses if a.startswith(("http", "//"))]


def test_it_listens_on_the_loopback_address_only(running):
    with socket.create_connection(("127.0.0.1", running), timeout=20):
        pass
    others = {"127.0.0.2"}
    others |= {found[4][0] for found in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)}
    for address in others - {"127.0.0.1"}:
        with pytest.raises(OSError), socket.create_connection((address, running), timeout=5):  # noqa: PT011
            pass


@pytest.mark.parametrize(
    ("origin", "allowed"), [("http://127.0.0.1", True), ("http://elsewhere.example", False)]
)
def test_pages_of_other_sites_may_not_talk_to_it(running, origin, allowed):
    """A web socket from another origin is refused, as from a site whose name leads to this machine."""
    from tornado.httpclient import HTTPClientError, HTTPRequest
    from tornado.websocket import websocket_connect

    async def connect():
        with urllib.request.urlopen(f"http://127.0.0.1:{running}/", timeout=120) as answer:
            token = answer.read().decode().split('"token":"')[1].split('"')[0]
        port = f":{running}" if allowed else ""
        address, headers = f"ws://127.0.0.1:{running}/ws", {"Origin": f"{origin}{port}"}
        request = HTTPRequest(address, headers=headers, connect_timeout=60.0)
        return await websocket_connect(request, subprotocols=["bokeh", token])

    if allowed:
        asyncio.run(connect())
    else:
        with pytest.raises(HTTPClientError, match="403"):
            asyncio.run(connect())


@pytest.mark.parametrize("path", ["/etc/passwd", "/static/../../../../etc/passwd", "/vehicle.toml"])
def test_it_serves_no_files(running, path):
    with pytest.raises(urllib.error.HTTPError, match="40"):
        urllib.request.urlopen(f"http://127.0.0.1:{running}{path}", timeout=60)


def test_a_port_that_is_taken_is_told():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(ParameterError, match=f"port is {port}, which cannot be used"):
            server.server(State(), port)
    with pytest.raises(ParameterError, match="port is 70000"):
        server.server(State(), 70000)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--vehicle", "NONE"], "unknown vehicle"),
        (["--speed", "1000"], "speed is 1000"),
        (["--vehicle", "TABLE_1", "--model", "coach"], "body"),
        (["--radius", "0"], "radius"),
    ],
)
def test_the_command_refuses_what_cannot_be(words, message):
    result = CliRunner().invoke(cli.app, ["explore", "--no-browser", *words])
    assert result.exit_code == 1
    assert message in str(result.exception)
