"""The pages that open a job and tell of its material fit a phone, a laptop and paper."""

import pytest
from jobs import OCTAHEDRON

pytestmark = [pytest.mark.apt, pytest.mark.slow]


@pytest.fixture(scope="module")
def made(finished):
    return finished(*OCTAHEDRON)


@pytest.mark.parametrize("name", ["index.html", "waste.html"])
@pytest.mark.parametrize("size", [(390, 844), (844, 390), (820, 1180), (1280, 800)])
def test_nothing_hangs_over_the_edge(browser, made, name, size):
    # A phone is one only for pages that say that they know of its width.
    context = browser.new_context(
        viewport={"width": size[0], "height": size[1]}, offline=True, is_mobile=size[0] < 800
    )
    page = context.new_page()
    wrong = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("requestfailed", lambda request: wrong.append(request.url))
    page.goto((made / name).as_uri())
    assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
    assert page.evaluate("window.innerWidth") == size[0]
    smallest = page.evaluate(
        "Math.min(...[...document.querySelectorAll('p, li, td, th')]"
        ".map((one) => parseFloat(getComputedStyle(one).fontSize)))"
    )
    assert smallest >= 12.0
    assert wrong == []
    context.close()


def test_what_is_bought_stays_ticked_on_both_pages(browser, made):
    context = browser.new_context(offline=True)
    page = context.new_page()
    ticks = "[...document.querySelectorAll('.buy input')].map((box) => box.checked)"
    page.goto((made / "index.html").as_uri())
    count = page.locator(".buy input").count()
    assert count > 0
    page.locator(".buy input").first.check()
    for name in ("index.html", "waste.html"):
        page.goto((made / name).as_uri())
        assert page.evaluate(ticks) == [True] + [False] * (count - 1)
        page.locator(".buy input").first.focus()
    page.locator(".buy input").first.uncheck()
    page.goto((made / "index.html").as_uri())
    assert page.evaluate(ticks) == [False] * count
    context.close()
