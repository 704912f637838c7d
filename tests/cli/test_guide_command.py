"""``fabweave guide``: a list of topics, a page in a terminal or as it is, and a hint."""

import re

import pytest

from fabweave.app.options.page import options_page
from fabweave.cli.main import main
from fabweave.guide.pages import TOPICS, for_terminal, page, summary


def test_without_a_topic_all_are_listed_with_a_line_each(capsys):
    main(["guide"])
    head, *lines, hint = capsys.readouterr().out.splitlines()
    assert head.split() == ["topic", "what", "it", "is", "about"]
    assert [line.split(maxsplit=1)[0] for line in lines] == [*TOPICS, "options"]
    for line in lines[:-1]:
        name, told = line.split(maxsplit=1)
        assert told.strip() == summary(page(name))
    assert hint == "fabweave guide TOPIC shows a page."


@pytest.mark.parametrize("topic", TOPICS)
def test_a_page_is_plain_text_where_there_is_no_terminal(topic, capsys):
    main(["guide", topic.upper()])
    assert capsys.readouterr().out == for_terminal(page(topic))


def test_the_reference_of_options_is_a_page(capsys):
    main(["guide", "options"])
    assert capsys.readouterr().out == options_page()


def test_in_a_terminal_a_page_is_set_and_no_wider_than_one_reads(capsys, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "300")
    main(["guide", "weaves"])
    told = capsys.readouterr().out
    assert "\x1b[" in told
    plain = re.sub(r"\x1b\[[\d;]*m", "", told)
    assert max(len(line.rstrip()) for line in plain.splitlines()) <= 100
    for mark in ("## ", "```", "|---", "<!--"):
        assert mark not in plain
    assert re.search(r"^Choosing one *$", plain, re.MULTILINE)


def test_an_unknown_topic_names_the_closest_first_and_all(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["guide", "weavs"])
    assert stop.value.code == 2
    told = capsys.readouterr().err
    named = told.partition("choose one of ")[2].partition(";")[0].split(", ")
    assert named[0] == "weaves"
    assert sorted(named) == sorted([*TOPICS, "options"])
