"""The viewer of a small job, open in a real browser."""

import pytest
from viewer_tab import Scene, Tab


@pytest.fixture(scope="module")
def torus(tmp_path_factory):
    return Scene(
        tmp_path_factory.mktemp("torus"), "shape:torus?m=10&n=6", 300.0, max_length_mm=200.0
    )


@pytest.fixture
def tab(browser, torus):
    opened = Tab(browser, torus)
    yield opened
    opened.close()
