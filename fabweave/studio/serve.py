"""Run the studio on this machine until it is ended."""

import secrets
import signal
import socket
import webbrowser
from functools import partial
from pathlib import Path

import click
import uvicorn
import websockets  # noqa: F401 - uvicorn would do without, and pages would find no socket

from fabweave.core.errors import InputError
from fabweave.core.job_folder import folder_at
from fabweave.mesh.shapes.catalogue import is_shape, shape_title
from fabweave.studio.server import studio_app
from fabweave.studio.state import FIRST, SIZE, State, opened

#: Pages of other machines cannot reach this address.
_HOST = "127.0.0.1"
#: A page that sends nothing for long is asked whether it is there, seconds; wishes are short.
_PING_S, _LONGEST = 30.0, 2**20


def first_state(model: str | None) -> State:
    """Return what the page shows at first.

    Raises
    ------
    InputError
        If there is no such file or shape.
    """
    if model is None:
        return State(FIRST, {"size": SIZE})
    if is_shape(model):
        shape_title(model)
        return State(model, {"size": SIZE})
    if not Path(model).is_file():
        raise InputError(f"there is no file {model}; name a mesh, a job.toml, or a shape:NAME")
    return opened(Path(model))


def serve(model: str | None, output: Path, port: int, *, browser: bool) -> None:
    """Serve the studio, and return when it is ended.

    Raises
    ------
    InputError
        If there is no such model, no room for the folder, or the port is taken.
    """
    state, folder = first_state(model), folder_at(output).absolute()
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        listener.bind((_HOST, port))
        # Browsers wait until it serves.
        listener.listen()
    except OSError as error:
        raise InputError(
            f"port {port} cannot be had: {error.strerror}; leave out --port"
        ) from error
    port = listener.getsockname()[1]
    token = secrets.token_urlsafe(24)
    hosts = frozenset(f"{name}:{port}" for name in (_HOST, "localhost"))
    app = studio_app(
        state, folder, token=token, hosts=hosts, stop=partial(signal.raise_signal, signal.SIGINT)
    )
    server = uvicorn.Server(
        uvicorn.Config(
            app,
            log_level="warning",
            server_header=False,
            access_log=False,
            # On one machine, what is sent is there before it would be packed.
            ws_per_message_deflate=False,
            ws_ping_interval=_PING_S,
            ws_max_size=_LONGEST,
            timeout_graceful_shutdown=2,
        )
    )
    address = f"http://{_HOST}:{port}/{token}/"
    click.echo(f"The studio is at {address}\nJobs go to {folder / 'jobs'}. Ctrl-C ends it.")
    if browser:
        webbrowser.open(address)
    try:
        server.run(sockets=[listener])
    except KeyboardInterrupt:
        click.echo("The studio has ended.")
