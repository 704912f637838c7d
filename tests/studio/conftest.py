"""A studio of a small torus, and a page of it in a real browser."""

import pytest
from live_studio import Studio
from studio_tab import Tab


@pytest.fixture(scope="module")
def studio(tmp_path_factory):
    started = Studio(tmp_path_factory.mktemp("studio"), "shape:torus?m=8&n=4")
    yield started
    code, out, wrong = started.end()
    assert (code, wrong) == (0, "")
    assert "ended" in out


@pytest.fixture
def tab(browser, studio):
    opened = Tab(browser, studio)
    yield opened
    opened.close()
