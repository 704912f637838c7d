"""An open page of a studio, driven from outside, and what a person sees of it."""

import io
import time

import numpy as np
from PIL import Image


class Tab:
    """An open page of a studio, with all that went wrong in it."""

    def __init__(self, browser, studio, size=(1280, 800), **options):
        self.context = browser.new_context(
            viewport={"width": size[0], "height": size[1]}, reduced_motion="reduce", **options
        )
        self.page, self.studio = self.context.new_page(), studio
        self.wrong, self.requests = [], []
        self.page.on("console", self._told)
        self.page.on("pageerror", lambda error: self.wrong.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(studio.address)
        self.settle()

    def _told(self, message):
        if message.type in ("error", "warning") and "GPU stall" not in message.text:
            self.wrong.append(message.text)

    def until(self, condition, seconds=90.0):
        """Wait for what is asked of the page; its policy forbids to evaluate texts in it."""
        late = time.monotonic() + seconds
        while not self.page.evaluate(condition):
            assert time.monotonic() < late, condition
            time.sleep(0.03)

    def settle(self):
        """Wait until the object and all that it comes to are there."""
        self.until("Boolean(window.studio && studio.settled)")
        assert not self.page.locator(".stale").count()

    def state(self):
        return self.page.evaluate("studio.state")

    def close(self):
        self.context.close()
        assert self.wrong == []
        assert all(self.studio.host in address or address.startswith(("blob:", "data:"))
                   for address in self.requests)  # fmt: skip


def tap(tab, x=0.5, y=0.35):
    """Tap a place of the object, a share of the way across and down."""
    box = tab.page.locator("#object").bounding_box()
    tab.page.mouse.click(box["x"] + x * box["width"], box["y"] + y * box["height"])


def pixels(page, place="#object"):
    """Return what is seen of a part of a page, (H, W, 3)."""
    picture = Image.open(io.BytesIO(page.locator(place).screenshot())).convert("RGB")
    return np.asarray(picture).astype(int)


def still(page, place="#object"):
    """Return what is seen once it does not change any more."""
    late, before, now = time.monotonic() + 20.0, None, pixels(page, place)
    while before is None or (now != before).any():
        assert time.monotonic() < late
        time.sleep(0.3)
        before, now = now, pixels(page, place)
    return now
