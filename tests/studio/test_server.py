"""The studio answers its own pages, and no others; what ends in the middle is told in words."""

import glob
import http.client
import json
import os
import random
import re
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path
from posixpath import dirname, join, normpath

import pytest
from live_studio import Studio
from spoilt_input import spoilt
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from fabweave.options.settings import settings_from_options
from fabweave.studio.work import new_folder

pytestmark = pytest.mark.usefixtures("quick_jobs")

TORUS = "shape:torus?m=8&n=4"
OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


@pytest.fixture
def page(studio):
    opened = studio.page()
    yield opened
    opened.close()


def children(process):
    """Return the processes below one, whichever of its threads started them."""
    listed = glob.glob(f"/proc/{process}/task/*/children")
    own = [int(word) for path in listed for word in Path(path).read_text("ascii").split()]
    return own + [below for child in own for below in children(child)]


def test_the_first_state_is_what_was_named(studio):
    status, headers, body = studio.ask("state")
    assert status == 200
    assert json.loads(body)["mesh"].startswith("shape:torus")
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert "Access-Control-Allow-Origin" not in headers


def test_all_that_the_page_needs_is_served(studio):
    page = studio.ask("")[2].decode("utf-8")
    wanted = re.findall(r'(?:src|href)="([^":]+)"', page)
    served = set()
    while wanted:
        name = wanted.pop()
        status, _, body = studio.ask(name)
        assert status == 200, name
        served.add(name)
        imports = re.findall(r'from "(\.[^"]*)";$', body.decode("utf-8"), re.MULTILINE)
        found = {normpath(join(dirname(name), other)) for other in imports}
        wanted += found - served - set(wanted)
    shared = {"show/scripts/three.js", "show/scripts/camera.js"}
    assert {"studio/page/studio.js", "studio/page/studio.css"} | shared <= served


@pytest.mark.parametrize(
    ("path", "more"),
    [
        ("state", {"host": "evil.example"}),
        ("state", {"origin": "http://evil.example"}),
        ("state", {"origin": "null"}),
        ("take?name=a.obj", {"method": "POST", "body": OBJ, "origin": False}),
        ("end", {"method": "POST", "origin": "http://evil.example"}),
    ],
)
def test_pages_of_others_are_turned_away(studio, path, more):
    assert studio.ask(path, **more)[0] == 403


@pytest.mark.parametrize(
    "path",
    ["/", "/state", "/wrong/state", "../state", "jobs/../../state.py", "studio.py", "..%2fstate.py",
     "jobs/%2e%2e/%2e%2e/etc/passwd", "studio/page/%2e%2e/server.py", "studio/page/x/../up.js"],
)  # fmt: skip
def test_nothing_is_served_without_the_secret_or_from_elsewhere(studio, path):
    assert studio.ask(path)[0] in (404, 405)


@pytest.mark.parametrize("origin", [None, "http://evil.example", "null"])
def test_sockets_of_others_are_turned_away(studio, origin):
    with (
        pytest.raises((InvalidStatus, ConnectionClosed)),
        connect(f"ws://{studio.host}{studio.path}live", origin=origin) as socket,
    ):
        socket.recv(timeout=10)


def test_a_wish_is_answered_and_a_bad_one_told_in_words(page):
    seen = page.all_told("look", TORUS, {"size": "200mm"})
    assert seen[0]["crossings"] == 64
    for options in ({"size": "wide"}, {"nothing": "1"}, {"width": "open:2"}):
        told, *_ = page.all_told("look", TORUS, options)
        assert told["error"]
    told, *_ = page.all_told("look", "shape:nothing")
    assert "nothing" in told["error"]
    deep = '{"n": 1, "to": "look", "options": ' + "[" * 100_000 + "]" * 100_000 + "}"
    for bad in ("", "{}", "[]", '{"n": 1}', '{"n": "x", "to": "look"}', '{"n": 3, "to": "no"}',
                '{"n": 1e999, "to": "look"}', deep):  # fmt: skip
        page.socket.send(bad)
        assert page.told()["error"]


def test_the_latest_wish_wins(page):
    for size in range(200, 230):
        last = page.wish("look", TORUS, {"size": f"{size}mm"})
    answered = []
    while not answered or answered[-1]["n"] != last or not answered[-1].get("done"):
        answered.append(page.told())
    seen = [one["n"] for one in answered if "crossings" in one]
    assert seen[-1] == last
    assert len(seen) < 30
    assert seen == sorted(seen)


@pytest.mark.slow
def test_a_process_that_is_killed_is_replaced_and_the_wish_done_once_more(studio, page):
    wait_until_idle(studio)
    wish = page.wish("plan", "shape:torus?m=40&n=24", {"size": "1200mm"})
    for again in range(2):
        while "progress" not in page.told():
            pass
        before = {pid: cpu(pid) for pid in children(studio.process.pid)}
        time.sleep(0.5)
        os.kill(max(before, key=lambda pid: cpu(pid) - before[pid]), signal.SIGKILL)
        if again:
            # Once is an accident; twice is told.
            while "error" not in (told := page.told()):
                assert not told.get("done")
            assert "ended" in told["error"]
    while not page.told().get("done"):
        pass
    assert wish
    assert "figures" in page.all_told("plan", TORUS, {"size": "200mm"})[0]


@pytest.mark.slow
def test_a_wish_outlives_its_process(studio, page):
    wait_until_idle(studio)
    page.wish("plan", "shape:torus?m=20&n=12", {"size": "600mm"})
    while "progress" not in page.told():
        pass
    before = {pid: cpu(pid) for pid in children(studio.process.pid)}
    time.sleep(1.0)
    os.kill(max(before, key=lambda pid: cpu(pid) - before[pid]), signal.SIGKILL)
    while "figures" not in (told := page.told()):
        assert "error" not in told
    while not page.told().get("done"):
        pass


def test_a_session_is_kept_whole_or_not_at_all_and_below_the_folder(studio):
    told = {"states": [{"mesh": TORUS, "options": {}}], "at": 0, "title": "Mine"}
    assert studio.ask("session/abcdefgh2", "POST", json.dumps(told))[0] == 200
    assert json.loads(studio.ask("session/abcdefgh2")[2]) == told
    listed = json.loads(studio.ask("sessions")[2])
    assert [one["title"] for one in listed if one["name"] == "abcdefgh2"] == ["Mine"]
    for name, data in (
        ("abcdefgh2", "{"), ("abcdefgh2", '{"states": 1, "at": 0}'), ("abcdefgh2", "[" * 100_000),
        ("..%2f..%2fabcdefgh", json.dumps(told)), ("Short", json.dumps(told)),
        ("abcdefgh2", json.dumps({**told, "more": "x" * 2**23})),
    ):  # fmt: skip
        assert studio.ask(f"session/{name}", "POST", data)[0] in (400, 404)
    assert json.loads(studio.ask("session/abcdefgh2")[2]) == told
    assert {path.parent.name for path in studio.folder.rglob("*.json")} == {"sessions"}
    assert studio.ask("session/abcdefgh2", "DELETE", origin=False)[0] == 403
    assert studio.ask("session/abcdefgh2", "DELETE")[0] == 200
    assert studio.ask("session/abcdefgh2")[0] == 400


def test_a_session_that_was_left_early_is_called_after_its_model(studio):
    name, left = "abcdefgh3", {"at": 0, "states": [{"mesh": "/models/4f/grey cat.obj"}]}
    empty, odd = {"at": 5, "states": []}, {"at": 0, "states": [7]}
    for told, title in ((left, "grey cat"), (empty, ""), (odd, "")):
        studio.ask(f"session/{name}", "POST", json.dumps(told))
        listed = json.loads(studio.ask("sessions")[2])
        assert [one["title"] for one in listed if one["name"] == name] == [title]
    studio.ask(f"session/{name}", "DELETE")


def wait_until_idle(studio):
    """Wait until no process of a studio loads anything ahead of wishes."""
    before, now = -1.0, 0.0
    while now > before + 0.05:
        time.sleep(0.7)
        before, now = now, sum(cpu(pid) for pid in children(studio.process.pid))


def cpu(pid):
    """Return the seconds that a process has worked; 0 if it is gone."""
    try:
        parts = Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(parts[11]) + int(parts[12])) / os.sysconf("SC_CLK_TCK")


@pytest.mark.slow
def test_two_pages_at_once_have_what_each_wished(studio, page):
    other = studio.page()
    one, two = page.wish("look", TORUS, {}), other.wish("look", "shape:octahedron", {})
    for each, crossings in ((page, 64), (other, 12)):
        while "crossings" not in (told := each.told()):
            pass
        assert told["crossings"] == crossings
    assert (one, two) != (0, 0)
    # A page that is closed in the middle holds up no other.
    other.wish("plan", "shape:torus?m=60&n=30", {"size": "2000mm"})
    other.close()
    assert "figures" in page.all_told("plan", TORUS, {"size": "200mm"})[0]


def test_a_mesh_that_is_dropped_can_be_seen_and_is_kept_below_the_folder(studio, page):
    status, state = studio.take("../../cone of mine.obj", OBJ)
    assert status == 200
    inside = studio.folder.resolve()
    assert str(inside) in os.path.realpath(state["mesh"])
    assert page.all_told("look", state["mesh"], state["options"])[0]["faces"] == 4
    own = {**state["options"], "remesh": "none"}
    assert page.all_told("look", state["mesh"], own)[0]["crossings"] == 6


def test_files_that_are_spoilt_are_refused_in_words(studio, page):
    draw = random.Random(5)  # noqa: S311 - no secret
    for number in range(12):
        status, state = studio.take(f"m{number}.obj", spoilt(OBJ, draw))
        assert status == 200
        told = page.all_told("look", state["mesh"], state["options"])
        assert any("faces" in one or one.get("error") for one in told)
        assert not any("defect" in one.get("error", "") for one in told)
    state = studio.take("far.obj", OBJ.replace(b"v 1 0 0", b"v 1e300 0 0"))[1]
    told, *_ = page.all_told("look", state["mesh"], {**state["options"], "remesh": "none"})
    assert "defect" not in told["error"]
    for name, data in (("a.exe", OBJ), ("a.toml", b"[job"), ("a.png", b"\x89PNG"), ("", OBJ)):
        status, told = studio.take(name, data)
        assert status == 400
        assert told["error"]


@pytest.mark.slow
def test_where_nothing_can_be_written_that_is_said(tmp_path):
    started = Studio(tmp_path / "studio")
    try:
        (tmp_path / "studio" / "models").write_text("in the way")
        status, told = started.take("a.obj", OBJ)
        assert status == 507
        assert "cannot take the file" in told["error"]
    finally:
        assert started.end()[0] == 0


@pytest.mark.slow
def test_a_job_that_is_made_is_what_the_command_line_makes_of_job_toml(studio, page, tmp_path):
    mesh = "shape:octahedron"
    options = {"size": "200mm", "width": "even,15mm", "effort": "quick", "fasten": "joints,3"}
    seen, _ = page.all_told("look", mesh, options)
    *_, made, done = page.all_told("make", mesh, options)
    assert done["done"]
    folder = studio.folder / "jobs" / made["made"]
    (tmp_path / "job.toml").write_text(seen["toml"], "utf-8")
    subprocess.run(
        [sys.executable, "-m", "fabweave", "make", "--config", str(tmp_path / "job.toml"), "-q",
         "-o", str(tmp_path / "again")],
        check=True,
    )  # fmt: skip
    for name in ("contents.json", "crossing_map.json", "sheets/sheet_01.dxf"):
        assert (folder / name).read_bytes() == (tmp_path / "again" / name).read_bytes()
    status, headers, _ = studio.ask(f"jobs/{made['made']}/index.html")
    assert status == 200
    assert "script-src 'unsafe-inline'" in headers["Content-Security-Policy"]
    # The next one stands beside it.
    settings = settings_from_options(mesh, **options)
    assert new_folder(folder.parent, settings).name == "octahedron-2"


@pytest.mark.slow
def test_others_of_the_network_get_in_by_the_code_alone_and_only_where_that_is_asked(
    studio, tmp_path
):
    def status(host, path, **headers):
        with closing(http.client.HTTPConnection(host, timeout=10)) as link:
            link.request("GET", path, headers=headers)
            answer = link.getresponse()
            answer.read()
            return answer.status

    try:
        open_ = Studio(tmp_path / "studio", TORUS, "--lan")
    except AttributeError:
        pytest.skip("this machine is in no network")
    try:
        said = "".join(open_.process.stdout.readline() for _ in range(8))
        address, code = re.search(r"(\d+\.\d+\.\d+\.\d+:\d+)(/\S+)", said).groups()
        assert "not encrypted" in said
        assert status(address, f"{code}/state") == 200
        assert status(address, "/state") == 404
        assert status(address, f"{code[:-1]}/state") == 404
        assert status(address, f"{code}/state", Host="evil.example") == 403
        assert status(address, f"{code}/state", Origin="http://evil.example") == 403
        # One that was not asked is not there for others.
        closed = f"{address.partition(':')[0]}:{studio.host.partition(':')[2]}"
        with pytest.raises(OSError, match="refused"):
            status(closed, f"{studio.path}state")
    finally:
        assert open_.end()[0] == 0


@pytest.mark.slow
def test_the_page_can_end_the_studio(tmp_path):
    started = Studio(tmp_path / "studio")
    assert started.ask("end", "POST")[0] == 200
    out, wrong = started.process.communicate(timeout=20)
    assert (started.process.returncode, wrong) == (0, "")
    assert "ended" in out


@pytest.mark.slow
@pytest.mark.parametrize("model", ["nothing.obj", "shape:nothing"])
def test_what_is_not_there_is_one_message(model, tmp_path):
    ran = subprocess.run(
        [sys.executable, "-m", "fabweave", "studio", model, "-o", str(tmp_path / "s")],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ran.returncode == 2
    assert len(ran.stderr.splitlines()) == 1
    assert not (tmp_path / "s").exists()
