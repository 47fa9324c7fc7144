"""``polychirp live`` — a page on which radars can be changed while one looks."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from socket import SO_REUSEADDR, SOL_SOCKET, socket
from typing import Any

from polychirp.cli.progress import progress_bar
from polychirp.cli.terminal import say
from polychirp.errors import CapabilityError, InputError


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``live``."""
    parser = subparsers.add_parser(
        "live",
        help="change two radars on a street and see what happens",
        description="Serve a page on this machine alone: a street with two radars, sliders for "
        "their ramps, clocks and powers, and spectra, maps, detections and ghosts as they change.",
    )
    parser.add_argument("--port", metavar="N", type=int, default=8642, help="default: 8642")
    parser.add_argument(
        "--no-browser", action="store_true", help="do not open the page in a browser"
    )


def run(arguments: argparse.Namespace) -> int:
    """Serve the page until Ctrl-C."""
    if not 1024 <= arguments.port <= 65535:
        raise InputError(f"--port: {arguments.port} is not between 1024 and 65535")
    for package in ("nicegui", "plotly"):
        if find_spec(package) is None:
            raise CapabilityError(
                f"the live page needs the package '{package}'; install it with "
                'pip install "polychirp[live]"'
            )
    from polychirp.live.page import HOST, serve

    _refuse_used_port(HOST, arguments.port)
    _compile()
    say(f"the page is at http://{HOST}:{arguments.port}; stop it with Ctrl-C")
    try:
        with _quiet_end():
            serve(port=arguments.port, opens_browser=not arguments.no_browser)
    except KeyboardInterrupt as stop:
        if type(stop) is not KeyboardInterrupt:  # SIGTERM
            raise
    say("the page is closed")
    return 0


@contextmanager
def _quiet_end() -> Iterator[None]:
    """Leave out the tracebacks of requests that the end of the server cancels."""
    import logging

    def is_news(record: logging.LogRecord) -> bool:
        return "CancelledError" not in record.getMessage() + str(record.exc_info)

    log = logging.getLogger("uvicorn.error")
    log.addFilter(is_news)
    try:
        yield
    finally:
        log.removeFilter(is_news)


def _refuse_used_port(host: str, port: int) -> None:
    """Refuse a port at which another program listens, before the page is announced."""
    with socket() as trial:
        trial.setsockopt(SOL_SOCKET, SO_REUSEADDR, 1)
        try:
            trial.bind((host, port))
        except OSError:
            raise InputError(f"--port: {port} is in use by another program; name another") from None


def _compile() -> None:
    """Compile the kernels of all presets, so that the page shows its first picture at once."""
    from polychirp.live.presets import PRESETS
    from polychirp.live.settings import study_of
    from polychirp.study.kernel_parts import compile_parts, parts_of

    names = [name for settings in PRESETS.values() for name in parts_of(study_of(settings))]
    with progress_bar("live") as progress:
        compile_parts(tuple(dict.fromkeys(names)), progress=progress)
