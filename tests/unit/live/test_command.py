"""``polychirp live`` before its page is served."""

from socket import socket

from polychirp.cli.app import main


def test_a_port_that_is_in_use_is_named_before_the_page_is_announced(capsys):
    with socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        assert main(["live", "--no-browser", "--port", str(port)]) == 2
    said = capsys.readouterr()
    assert f"--port: {port} is in use by another program" in said.err
    assert "the page is at" not in said.out + said.err
