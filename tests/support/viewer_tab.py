"""An open page of the viewer, driven from outside, and rays of our own to tell what is seen."""

import random
import shutil
from contextlib import contextmanager
from io import BytesIO

import numpy as np
from PIL import Image
from read_viewer import read_viewer
from viewer_scene import make_page, shoot, triangles_of

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
#: Where the size does not matter: fewer pixels are drawn sooner.
SMALL = (860, 600)


@contextmanager
def chromium(tool):
    """Run the system's browser, which draws in software."""
    started = tool.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
    yield started
    started.close()


class Scene:
    """A page on disk, its plan, and its strips as the verifier reads them."""

    def __init__(self, folder, shape, size_mm, **settings):
        page, self.plan, self.job = make_page(shape, size_mm, **settings)
        self.path = folder / "assembly.html"
        self.path.write_text(page, encoding="utf-8")
        self.read = read_viewer(self.path)
        self.corners, self.owner = triangles_of(self.read)
        self.ids = [piece.id for piece in self.plan.pieces]
        self.step_of = {id_: step.step for step in self.plan.steps for id_ in step.pieces}

    def piece(self, label):
        return self.plan.pieces[self.ids.index(label)]


class Page:
    """A page on disk, without a plan."""

    def __init__(self, path):
        self.path = path


class Tab:
    """An open page, with all that went wrong in it."""

    def __init__(self, browser, scene, size=SMALL, script=None, address="", path=None, **options):
        width, height = size
        self.context = browser.new_context(
            viewport={"width": width, "height": height}, offline=True,
            **{"reduced_motion": "reduce", **options},
        )  # fmt: skip
        self.page = self.context.new_page()
        self.wrong, self.requests, self.scene = [], [], scene
        self.page.on("console", self._told)
        self.page.on("pageerror", lambda error: self.wrong.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        if script:
            self.page.add_init_script(script)
        self.path = path or scene.path
        self.page.goto(self.path.as_uri() + address)
        self.page.wait_for_function("window.fabweave !== undefined")

    def _told(self, message):
        if message.type in ("error", "warning") and "GPU stall" not in message.text:
            self.wrong.append(message.text)

    def close(self):
        self.context.close()
        assert self.wrong == []
        asked = {request.partition("#")[0] for request in self.requests}
        assert asked == {self.path.as_uri()}

    def chosen(self):
        return self.page.evaluate("document.body.dataset.piece")

    def search(self, words):
        """Take the first thing that is found."""
        self.page.fill("#query", words)
        self.page.keyboard.press("Enter")

    def hand(self):
        """Return what touches the screen with fingers: a kind of event, and where they are."""
        session = self.context.new_cdp_session(self.page)

        def touch(kind, *points):
            places = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(points)]
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": places})

        return touch

    def wait(self, true):
        """Wait until something is true in the page, whose policy forbids a waiting of its own."""
        for _ in range(200):
            if self.page.evaluate(true):
                return
            self.page.wait_for_timeout(100)
        raise AssertionError(f"it never came true that {true}")

    def slide(self, name, value):
        """Move a slider."""
        self.page.evaluate(
            "([name, value]) => { const s = document.getElementById(name); s.value = value;"
            "s.dispatchEvent(new Event('input')); }", [name, value],
        )  # fmt: skip
        self.settle()

    def settle(self):
        """Wait until turning has ended and labels stand."""
        self.page.wait_for_timeout(450)
        self.page.evaluate("fabweave.draw()")

    def go_to(self, step):
        self.page.evaluate(
            "step => { const s = document.getElementById('slider'); s.value = step;"
            "s.dispatchEvent(new Event('input')); }", step,
        )  # fmt: skip
        self.settle()

    def look(self):
        """Take over the camera, for rays of our own."""
        lens = self.page.evaluate(
            "[fabweave.lens.projectionMatrix.elements, fabweave.lens.matrixWorldInverse.elements]"
        )
        project, view = (np.array(matrix).reshape(4, 4).T for matrix in lens)
        self.back = np.linalg.inv(project @ view)
        self.box = self.page.locator("#object").bounding_box()

    def ray(self, x, y):
        """Return where the ray of a point of the canvas begins, and its way."""
        back, box = self.back, self.box
        flat = (2 * x / box["width"] - 1, 1 - 2 * y / box["height"])
        ends = [back @ (*flat, depth, 1.0) for depth in (-1.0, 1.0)]
        near, far = (end[:3] / end[3] for end in ends)
        return near, (far - near) / np.linalg.norm(far - near)

    def seen(self, x, y, visible):
        """Return what our own rays meet in a pixel; None where its neighbours see other things."""
        met = set()
        for dx, dy in ((0.5, 0.5), (-1.5, -1.5), (2.5, -1.5), (-1.5, 2.5), (2.5, 2.5)):
            origin, way = self.ray(x + dx, y + dy)
            far = shoot(self.scene.corners, origin, way)
            far = np.where(visible[self.scene.owner], far, np.inf)
            first = int(np.argmin(far))
            if np.isinf(far[first]):
                met.add("")
                continue
            piece = self.scene.owner[first]
            # The layers of a lap, and strips that touch, are a matter of depth's precision.
            near = far[self.scene.owner != piece] - far[first] < 1.0
            met.add(None if np.any(near) else self.scene.ids[piece])
        return met.pop() if len(met) == 1 else None

    def points(self, visible, wanted, seed):
        """Return points of the canvas and what is seen there, by our own rays."""
        dice = random.Random(seed)  # noqa: S311 - no secret
        self.look()
        box, found = self.box, []
        while len(found) < wanted:
            x = int(dice.uniform(0.05, 0.95) * box["width"])
            y = int(dice.uniform(0.15, 0.9) * box["height"])
            label = self.seen(x, y, visible) if self.free(x, y) else None
            if label is not None and (label or dice.random() < 0.15):
                found.append((x, y, label))
        return found

    def shot(self, origin, way):
        """Return how far along a ray the object is met."""
        return float(shoot(self.scene.corners, origin, way).min())

    def project(self, points):
        """Return where points, (N, 3), are on the canvas, (N, 2)."""
        seen = np.column_stack((points, np.ones(len(points)))) @ np.linalg.inv(self.back).T
        flat = seen[:, :2] / seen[:, 3:]
        return (flat * (1, -1) + 1) / 2 * (self.box["width"], self.box["height"])

    def scale(self, point):
        """Return how many pixels a millimetre across is at a point."""
        self.look()
        lens = np.array(self.page.evaluate("fabweave.lens.matrixWorld.elements")).reshape(4, 4).T
        ends = self.project(np.array([point, point + lens[:3, 0]]))
        return float(np.linalg.norm(ends[1] - ends[0]))

    def pixels(self):
        """Return what the canvas shows, (H, W, 3)."""
        picture = self.page.locator("#object").screenshot()
        return np.asarray(Image.open(BytesIO(picture)).convert("RGB"), dtype=float)

    def free(self, x, y):
        """Tell whether no button stands over a point of the canvas."""
        return self.page.evaluate(
            "([x, y]) => document.elementFromPoint(x, y)?.id === 'object'",
            [x + self.box["x"], y + self.box["y"]],
        )

    def tap(self, x, y):
        self.page.locator("#object").click(position={"x": x, "y": y})


def all_of(scene):
    return np.ones(len(scene.ids), dtype=bool)
