"""The app of explorers, served by marimo from this process."""

import asyncio
import dataclasses
import html
import socket
import threading
import urllib.parse
import webbrowser
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..._errors import ModelError
from ..._extras import needed

if TYPE_CHECKING:
    from .explorer import Explorer

HOST = "127.0.0.1"
NOTEBOOK = Path(__file__).with_name("app.py")
# What the app offers, by name. The app runs in a thread of this process.
offered: dict[str, Callable[[], "Explorer[Any]"]] = {}


@dataclasses.dataclass(frozen=True, eq=False)
class App:
    """A running app; a notebook shows it in its page. It ends with the process, or by `close`."""

    url: str
    _server: Any
    _thread: threading.Thread

    def wait(self) -> None:
        """Waits until the server ends."""
        self._thread.join()

    def close(self) -> None:
        """Ends the server."""
        self._server.should_exit = True
        self._thread.join()

    def __repr__(self) -> str:
        return f"<App at {self.url}>"

    def _repr_html_(self) -> str:
        return f'<iframe src="{html.escape(self.url)}" style="width:100%;height:900px;border:0"></iframe>'


def serve(choices: Mapping[str, Callable[[], "Explorer[Any]"]], *, port: int = 0, browser: bool = True) -> App:
    """Serves explorers by name, each made when it is first chosen; the page opens with the first one.

    Raises `ModelError` if there is none, if marimo is missing, or if the port is in use.
    """
    if not choices:
        raise ModelError("serve needs at least one explorer by name.")
    marimo = needed("marimo", "explore", "The app")
    uvicorn = needed("uvicorn", "explore", "The app")
    place = socket.socket()
    place.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        place.bind((HOST, port))
    except OSError as error:
        place.close()
        raise ModelError(f"Port {port} cannot be used: {error.strerror}. Pass another, or 0 for a free one.") from error
    place.listen()
    offered.update(choices)
    app = marimo.create_asgi_app(quiet=True, show_tracebacks=True).with_app(path="/", root=str(NOTEBOOK)).build()
    server = uvicorn.Server(uvicorn.Config(app, log_level="warning"))
    thread = threading.Thread(target=lambda: asyncio.run(_run(server, app, place)), daemon=True)
    thread.start()
    url = f"http://{HOST}:{place.getsockname()[1]}/?{urllib.parse.urlencode({'design': next(iter(choices))})}"
    found = App(url, server, thread)
    # Sessions need executors to close, which Python stops when the main thread ends. Functions of `atexit`, and threads
    # that join the main thread, run only after that.
    threading._register_atexit(found.close)  # pyright: ignore[reportAttributeAccessIssue]
    if browser:
        webbrowser.open(url)
    return found


async def _run(server: Any, app: Any, place: socket.socket) -> None:
    """Runs the server, and ends the sessions of open pages after it. Their threads would keep the process alive."""
    try:
        await server.serve([place])
    finally:
        for route in app.routes:
            await route.app.state.session_manager.shutdown()
