"""``fabweave guide``: a list of topics, and a page in a terminal or as it is."""

import re

import pytest

from fabweave.cli.guide import TOPICS, for_terminal, options_page, page
from fabweave.cli.main import main


@pytest.mark.parametrize("topic", [*TOPICS, "options"])
def test_a_page_is_plain_text_where_there_is_no_terminal(topic, capsys):
    main(["guide", topic.upper()])
    told = options_page() if topic == "options" else for_terminal(page(topic))
    assert capsys.readouterr().out == told


def test_in_a_terminal_a_page_is_set_and_no_wider_than_one_reads(capsys, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "300")
    main(["guide", "weaves"])
    told = capsys.readouterr().out
    assert "\x1b[" in told
    plain = re.sub(r"\x1b\[[\d;]*m", "", told)
    assert max(len(line.rstrip()) for line in plain.splitlines()) <= 100
    assert not re.search(r"## |```|\|---|<!--", plain)
