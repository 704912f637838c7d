"""Serve the studio to browsers of this machine: one page, its scripts, and a socket each.

Only this machine reaches it, and only by an address that holds a secret; pages of other sites are
turned away by Host and Origin. Nothing is written but under the folder given at start.
"""

import asyncio
import hashlib
import json
import re
import secrets
import signal
import socket
import webbrowser
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

import click
import uvicorn
import websockets  # noqa: F401 - uvicorn would do without, and pages would find no socket
from starlette.applications import Starlette
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from fabweave.core.errors import FabweaveError, InputError
from fabweave.core.job_folder import folder_at
from fabweave.mesh.io.files import READABLE
from fabweave.mesh.shapes.catalogue import is_shape, shape_title
from fabweave.studio.choosing import choose, warm_up
from fabweave.studio.sessions import Sessions
from fabweave.studio.state import SIZE, State, opened
from fabweave.studio.work import look, make, plan, warm
from fabweave.studio.worker import Told, Work, Worker, framed

#: Pages of other machines cannot reach this address; those of the network reach any.
_HOST, _ANY = "127.0.0.1", "0.0.0.0"  # noqa: S104 - where --lan asks for it
#: An address that is in no network of a house (RFC 5737), to ask by which way it would be reached.
_ELSEWHERE = ("192.0.2.1", 9)
#: A code that is typed has so many of these letters, which none takes for one another: 60 bits.
_LETTERS, _CODE = "abcdefghijkmnpqrstuvwxyz23456789", 12
#: A page that sends nothing for long is asked whether it is there, seconds; wishes are short.
_PING_S, _LONGEST = 30.0, 2**20


def first_state(model: str | None) -> State | None:
    """Return what the page shows at first; None where it is to be asked.

    Raises
    ------
    InputError
        If there is no such file or shape.
    """
    if model is None:
        return None
    if is_shape(model):
        shape_title(model)
        return State(model, {"size": SIZE})
    if not Path(model).is_file():
        raise InputError(f"there is no file {model}; name a mesh, a job.toml, or a shape:NAME")
    return opened(Path(model))


def serve(model: str | None, output: Path, port: int, *, browser: bool, lan: bool = False) -> None:
    """Serve the studio, and return when it is ended.

    With ``lan``, whoever is in the network and knows the code may open it, too.

    Raises
    ------
    InputError
        If there is no such model, no room for the folder, no network, or the port is taken.
    """
    state, folder = first_state(model), folder_at(output).absolute()
    address = _own_address() if lan else _HOST
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        listener.bind((_ANY if lan else _HOST, port))
        # Browsers wait until it serves.
        listener.listen()
    except OSError as error:
        raise InputError(
            f"port {port} cannot be had: {error.strerror}; leave out --port"
        ) from error
    port = listener.getsockname()[1]
    token = _code() if lan else secrets.token_urlsafe(24)
    hosts = frozenset(f"{name}:{port}" for name in (_HOST, "localhost", address))
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
    own = f"http://{_HOST}:{port}/{token}/"
    click.echo(f"The studio is at {own}\nJobs go to {folder / 'jobs'}. Ctrl-C ends it.")
    if lan:
        click.echo(
            f"\nOn a tablet or phone of this network, type:\n\n    {address}:{port}/{token}\n\n"
            "Whoever knows that address can see this work, change it, and make jobs in this "
            "folder.\nWhat is sent is not encrypted: do this in a network that you trust."
        )
    if browser:
        webbrowser.open(own)
    # Where much is going on, the loop may take the interrupt for its own, and simply return.
    with suppress(KeyboardInterrupt):
        server.run(sockets=[listener])
    click.echo("The studio has ended.")


def _own_address() -> str:
    """Return the address that other machines of the network have for this one."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asked:
        try:
            # Nothing is sent: the system says from where it would be.
            asked.connect(_ELSEWHERE)
        except OSError as error:
            raise InputError(f"--lan finds no network: {error.strerror}") from error
        return str(asked.getsockname()[0])


def _code() -> str:
    """Return a secret that is typed with ease."""
    letters = "".join(secrets.choice(_LETTERS) for _ in range(_CODE))
    return "-".join(letters[at : at + 4] for at in range(0, _CODE, 4))


#: No larger file is taken; and no longer wish.
_MOST_BYTES, _LONGEST_WISH = 256 * 2**20, 2**20
#: What is under way is interrupted for a newer wish of the same page once it took so long, seconds.
_PATIENCE_S = 0.8
#: So many meshes are known to all desks.
_KEPT_MESHES = 12
#: What a wish may say of how it is to be shown.
_VIEW = ("have", "yarns", "radius", "faces", "finer", "more", "examples")
#: What may be dropped on a page.
_TAKEN = (*READABLE, "toml")
#: Folders of the package that pages are served from, under the same names, so that modules find one
#: another there as they do in the package.
_PLACES = ("studio/page", "show/scripts")
_TYPES = {"html": "text/html", "js": "text/javascript", "css": "text/css"}
_UNSAFE = re.compile(r"[^A-Za-z0-9._-]+")
#: Pages may load what is served here and nothing else; finished jobs have their scripts in them.
_OWN = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; connect-src 'self'; frame-src 'self'; form-action 'none'; "
    "base-uri 'none'; frame-ancestors 'none'"
)
_JOBS = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src 'self' data:; frame-src 'self'; object-src 'self'; frame-ancestors 'self'"
)


class Page:
    """A page in some browser, as far as the server knows it."""

    def __init__(self, socket: WebSocket) -> None:
        """Take a socket that was accepted."""
        self._socket, self._one = socket, asyncio.Lock()

    async def tell(self, to: str, number: int, told: Told) -> None:
        """Send what is told of a wish; a page that is gone is no matter."""
        values = {"to": to, "n": number, **told[0]}
        with suppress(WebSocketDisconnect, RuntimeError, OSError):
            async with self._one:
                if told[1]:
                    await self._socket.send_bytes(framed(values, told[1]))
                else:
                    await self._socket.send_text(json.dumps(values))


@dataclass
class Desk:
    """One worker, and the latest wish of each page that waits for it.

    Parameters
    ----------
    name : str
    work : callable
        What its worker does with a wish.
    patience_s : float or None
        When a newer wish of a page ends the one before; None for never.
    meshes : dict
        Meshes and stations that some desk made, for all of them; see ``keep`` of what workers tell.
    warm : callable
        What its worker does when somebody is expected.
    """

    name: str
    work: Work
    patience_s: float | None
    meshes: dict[str, Any]
    warm: Work = warm
    worker: Worker = field(default_factory=Worker)
    waiting: dict[Page, dict[str, Any]] = field(default_factory=dict)
    busy: tuple[Page, int] | None = None
    since: float = 0.0
    _woken: asyncio.Event = field(default_factory=asyncio.Event)

    def expect(self) -> None:
        """Let its process start before anybody waits for it."""
        self._woken.set()

    def ask(self, page: Page, wish: dict[str, Any]) -> None:
        """Take a wish; an older one of the same page is forgotten."""
        self.waiting[page] = wish
        self._woken.set()
        if self.busy and self.busy[0] is page and self.patience_s is not None:
            loop = asyncio.get_running_loop()
            left = self.patience_s - (loop.time() - self.since)
            loop.call_later(max(left, 0.0), self._hurry, self.busy)

    def _hurry(self, about: tuple[Page, int]) -> None:
        if self.busy == about and about[0] in self.waiting:
            self.worker.interrupt()

    def stop(self, page: Page) -> int | None:
        """Forget what a page wished, and stop what is done for it; the number of what never began.

        What was begun is told to have stopped once it has.
        """
        forgotten = self.waiting.pop(page, None)
        if self.busy and self.busy[0] is page:
            self.worker.interrupt()
        return None if forgotten is None else int(forgotten["n"])

    async def serve(self) -> None:
        """Do what is wished, for one page after another, until it is cancelled."""
        try:
            while True:
                await self._woken.wait()
                if not self.waiting:
                    self._woken.clear()
                    if not self.worker.started:
                        async for _ in self.worker.do(self.warm, {}):
                            pass
                    continue
                page = next(iter(self.waiting))
                wish = self.waiting.pop(page)
                number = wish["n"]
                self.busy, self.since = (page, number), asyncio.get_running_loop().time()
                new = self.meshes.keys() - self.worker.given
                wish["known"] = {key: self.meshes[key] for key in new}
                self.worker.given |= new
                async for told in self.worker.do(self.work, wish):
                    self._keep(told[0].pop("keep", {}))
                    await page.tell(self.name, number, told)
                self.busy = None
                await page.tell(self.name, number, ({"done": True}, {}))
        finally:
            self.worker.close()

    def _keep(self, meshes: dict[str, Any]) -> None:
        """Keep some meshes for all desks, the last ones."""
        self.meshes.update(meshes)
        while len(self.meshes) > _KEPT_MESHES:
            del self.meshes[next(iter(self.meshes))]


class Guard:
    """Turn away whoever does not come from a page of this server."""

    def __init__(self, app: ASGIApp, hosts: frozenset[str]) -> None:
        """Guard an app that answers to these hosts."""
        self._app, self._hosts = app, hosts

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on what is good, with headers that keep it so."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        origin = headers.get("origin")
        own = origin is None or origin.removeprefix("http://") in self._hosts
        needed = scope["type"] == "websocket" or scope.get("method") not in ("GET", "HEAD")
        if headers.get("host") not in self._hosts or not own or (needed and origin is None):
            if scope["type"] == "websocket":
                await send({"type": "websocket.close", "code": 1008})
                return
            await PlainTextResponse("This is not for other pages.", 403)(scope, receive, send)
            return
        jobs = "/jobs/" in scope["path"]

        async def sealed(message: Message) -> None:
            if message["type"] == "http.response.start":
                more = MutableHeaders(scope=message)
                more["Content-Security-Policy"] = _JOBS if jobs else _OWN
                more["X-Content-Type-Options"] = "nosniff"
                more["Referrer-Policy"] = "no-referrer"
                more["Cross-Origin-Resource-Policy"] = "same-origin"
                more["Cache-Control"] = "no-store"
            await send(message)

        await self._app(scope, receive, sealed)


def studio_app(
    state: State | None,
    folder: Path,
    *,
    token: str,
    hosts: frozenset[str],
    stop: Callable[[], None],
) -> ASGIApp:
    """Return the studio as a web application.

    Parameters
    ----------
    state : State or None
        What a new page shows; None where it asks.
    folder : Path
        Where jobs and dropped files go; nothing is written elsewhere.
    token : str
        The secret that all addresses begin with.
    hosts : set of str
        As which it may be addressed, with the port.
    stop : callable
        Ends the server.
    """
    meshes: dict[str, Any] = {}
    desks = {
        "look": Desk("look", look, _PATIENCE_S, meshes),
        "plan": Desk("plan", plan, 0.0, meshes),
        "choose": Desk("choose", choose, 0.0, meshes, warm_up),
        "make": Desk("make", make, None, meshes),
    }
    sessions = Sessions(folder / "sessions")

    @asynccontextmanager
    async def running(_app: Starlette) -> AsyncIterator[None]:
        tasks = [asyncio.create_task(desk.serve()) for desk in desks.values()]
        try:
            yield
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def live(socket: WebSocket) -> None:
        await socket.accept()
        page = Page(socket)
        for name in ("look", "choose", "plan"):
            desks[name].expect()
        try:
            # A page that is gone is found out by what is sent to it, too.
            with suppress(WebSocketDisconnect, RuntimeError):
                while True:
                    told = await socket.receive_text()
                    if len(told) <= _LONGEST_WISH:
                        await _asked(desks, page, told, folder)
        finally:
            for desk in desks.values():
                desk.stop(page)

    async def answered(work: Awaitable[Any]) -> Response:
        try:
            return JSONResponse(await work)
        except FabweaveError as error:
            return JSONResponse({"error": str(error)}, 400)
        except OSError as error:
            why = f"{folder} cannot take the file: {error.strerror or error}"
            return JSONResponse({"error": why}, 507)

    async def take(request: Request) -> Response:
        return await answered(_taken(request, folder))

    async def listed(_request: Request) -> Response:
        return JSONResponse(await asyncio.to_thread(sessions.listed))

    async def session(request: Request) -> Response:
        name = request.path_params["name"]
        if request.method == "POST":
            data = bytes(await _body(request, "the session"))
            return await answered(asyncio.to_thread(sessions.save, name, data))
        if request.method == "DELETE":
            return await answered(asyncio.to_thread(sessions.forget, name))
        return await answered(asyncio.to_thread(sessions.read, name))

    async def end(_request: Request) -> Response:
        asyncio.get_running_loop().call_later(0.2, stop)
        return JSONResponse({})

    async def first(_request: Request) -> Response:
        known = {"mesh": None, "options": {}} if state is None else state.to_json()
        return JSONResponse({**known, "folder": str(folder), "takes": _TAKEN})

    (folder / "jobs").mkdir(parents=True, exist_ok=True)
    app = Starlette(
        routes=[
            Mount(
                f"/{token}",
                routes=[
                    Route("/", partial(_file, "studio/page", "studio.html")),
                    Route("/state", first),
                    Route("/take", take, methods=["POST"]),
                    Route("/sessions", listed),
                    Route("/session/{name}", session, methods=["GET", "POST", "DELETE"]),
                    Route("/end", end, methods=["POST"]),
                    WebSocketRoute("/live", live),
                    Mount("/jobs", StaticFiles(directory=folder / "jobs", html=True)),
                    *(Route(f"/{place}/{{name}}", partial(_named, place)) for place in _PLACES),
                ],
            )
        ],
        lifespan=running,
    )
    return Guard(app, hosts)


async def _asked(desks: dict[str, Desk], page: Page, told: str, folder: Path) -> None:
    """Pass on what a page asks; what makes no sense is answered, and changes nothing."""
    number = 0
    try:
        asked = json.loads(told)
        number, desk = int(asked["n"]), desks[asked["to"]]
        if asked.get("stop"):
            if (forgotten := desk.stop(page)) is not None:
                await page.tell(desk.name, forgotten, ({"stopped": True, "done": True}, {}))
            return
        state = State.of({"mesh": "", "options": {}} if asked.get("examples") else asked)
    except FabweaveError as error:
        await page.tell(asked["to"], number, ({"error": str(error), "done": True}, {}))
        return
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
        await page.tell("look", number, ({"error": f"no wish: {error}", "done": True}, {}))
        return
    view = {name: asked.get(name) for name in _VIEW}
    desk.ask(page, {**state.to_json(), **view, "n": number, "folder": str(folder / "jobs")})


async def _taken(request: Request, folder: Path) -> dict[str, Any]:
    """Keep a file that was dropped, and return the state that it means.

    InputError is raised for what is too large, is no such file, or does not read.
    """
    name = _UNSAFE.sub("-", request.query_params.get("name", "")).strip(".-")[-80:]
    if name.rpartition(".")[2].lower() not in _TAKEN:
        raise InputError(
            f"{name or 'this'} is no mesh or job.toml; drop one of {', '.join(_TAKEN)}"
        )
    data = await _body(request, name)
    digest = hashlib.sha256(data).hexdigest()[:8]
    path = folder / "models" / digest / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    return (await asyncio.to_thread(opened, path)).to_json()


async def _body(request: Request, name: str) -> bytearray:
    """Return what was sent; InputError is raised if it is too large."""
    data = bytearray()
    async for part in request.stream():
        data += part
        if len(data) > _MOST_BYTES:
            raise InputError(f"{name} has more than {_MOST_BYTES >> 20} MB; simplify the mesh")
    return data


async def _named(place: str, request: Request) -> Response:
    return await _file(place, request.path_params["name"], request)


async def _file(place: str, name: str, _request: Request) -> Response:
    """Return one of the files of the page: its own, or one that it shares with the viewer."""
    kind = _TYPES.get(name.rpartition(".")[2])
    file = resources.files("fabweave").joinpath(place, name)
    if kind and re.fullmatch(r"[a-z]+\.[a-z]+", name) and file.is_file():
        return Response(file.read_text("utf-8"), media_type=kind)
    return PlainTextResponse("There is no such file.", 404)
