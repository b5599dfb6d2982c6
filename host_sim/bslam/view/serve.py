"""A page for this machine's browser: served on the loopback address, from the installed package alone."""

from __future__ import annotations

import asyncio
import errno
import logging
import os
import signal
import socket
import sys
import webbrowser
from collections.abc import Callable

from bokeh.document import Document
from bokeh.server.server import Server

from bslam.errors import BslamError

ADDRESS = "127.0.0.1"


def serve(page: Callable[[Document], None], port: int, say: Callable[[str], None], browse: bool) -> None:
    """Serve documents that `page` fills until Ctrl-C. port 0: a free one.

    say: told where the page is, once it is there. browse: open it, where there is a screen. Raises BslamError
    if the port is taken.
    """
    logging.getLogger("bokeh").setLevel(logging.ERROR)  # it tells of every visit
    port = _free_port(port)
    loop = asyncio.new_event_loop()
    asyncio.set_event_loop(loop)
    # Only pages that this server has sent may talk to it, whatever else the browser shows.
    origins = [f"{ADDRESS}:{port}", f"localhost:{port}"]
    server = Server({"/": page}, address=ADDRESS, port=port, allow_websocket_origin=origins)
    url = f"http://{ADDRESS}:{port}/"
    server.start()
    say(url)
    if browse and has_screen():
        server.io_loop.add_callback(webbrowser.open, url)
    # An exception that Ctrl-C raises is lost where it meets a callback of the interpreter's own.
    before = signal.signal(signal.SIGINT, lambda *_: loop.call_soon_threadsafe(server.io_loop.stop))
    try:
        server.io_loop.start()
    finally:
        signal.signal(signal.SIGINT, before)
        server.unlisten()
        server.stop(wait=False)


def _free_port(port: int) -> int:
    """The port, or any where it is 0: the server must know its own before it has it."""
    with socket.socket() as one:
        one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            one.bind((ADDRESS, port))
        except OSError as error:
            why = "another program has it" if error.errno == errno.EADDRINUSE else error.strerror
            raise BslamError(f"--port {port}: {why}; allowed: a port that is free, or 0 for any") from error
        return int(one.getsockname()[1])


def has_screen() -> bool:
    """A browser would open a window; elsewhere it might take the terminal."""
    return sys.platform in ("darwin", "win32") or any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")
    )
