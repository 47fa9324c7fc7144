"""The server of the live page: on this machine alone, and without help from others."""

import os
import re
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request

import pytest

from polychirp.cli.app import main


@pytest.fixture
def address():
    """Host and port of a server in a process of its own."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "polychirp", "live", "--no-browser", "--port", str(port)]
    # NiceGUI serves nothing in a process that it takes for a test
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST")}
    silent = subprocess.DEVNULL
    with subprocess.Popen(command, stdout=silent, stderr=silent, env=environment) as server:
        yield "127.0.0.1", port
        server.terminate()


def page(host: str, port: int) -> tuple[str, dict[str, str]]:
    """Text and headers of the page, as soon as the server answers."""
    for _ in range(200):
        try:
            with urllib.request.urlopen(f"http://{host}:{port}/") as answer:
                return answer.read().decode(), dict(answer.headers)
        except (urllib.error.URLError, ConnectionError):
            time.sleep(0.3)
    raise AssertionError("the server does not answer")


@pytest.mark.slow
def test_the_page_is_served_on_this_machine_alone_and_names_no_other(address):
    text, headers = page(*address)
    assert "polychirp live" in text
    sources = re.findall(r"""(?:src|href)=["'](https?:)?//""", text)
    assert sources == []
    assert headers["content-security-policy"].startswith("default-src 'self'")
    with socket.socket() as elsewhere:
        # an address of the loop-back network on which a server on all addresses would answer
        assert elsewhere.connect_ex(("127.0.0.2", address[1])) != 0


def test_a_port_that_cannot_be_used_is_refused(capsys):
    assert main(["live", "--port", "80"]) == 2
    assert "80 is not between 1024 and 65535" in capsys.readouterr().err


def test_a_missing_package_is_named(monkeypatch, capsys):
    monkeypatch.setattr("polychirp.cli.live.find_spec", lambda _: None)
    assert main(["live"]) == 3
    assert 'pip install "polychirp[live]"' in capsys.readouterr().err
