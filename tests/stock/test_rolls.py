"""What goes with rolls, and what does not; and what --stock takes, several times."""

import pytest

from fabweave.core.errors import InputError
from fabweave.job.ask import complete_settings
from fabweave.options.settings import job_toml, settings_from_job, settings_from_options
from fabweave.stock.sheet_size import parse_roll

MESH = "shape:icosahedron"
LIST = '[[sheet]]\nname = "band"\nroll = "12mm:20m"\nprice = 3.0\n'


def asked(*stock, **options):
    return settings_from_options(MESH, stock=list(stock), **{"strips": "straight", **options})


def test_strips_are_as_wide_as_the_roll_and_fill_it(tmp_path):
    (tmp_path / "stock.toml").write_text(LIST)
    settings, supplies = complete_settings(asked("roll:12mm:50m:2", str(tmp_path / "stock.toml")))
    assert settings.width_rule.constant
    assert settings.width_rule.most_mm == 12.0
    assert not settings.narrowable
    assert (settings.stock.margin_mm, settings.stock.gap_mm, supplies.margin_mm) == (0.0, 0.0, 0.0)
    assert supplies.rolls
    assert [(sheet.name, sheet.quantity) for sheet in supplies.sheets] == [("", 2), ("band", None)]
    # job.toml alone says the same again.
    (tmp_path / "job.toml").write_text(job_toml(settings, {}))
    (tmp_path / "stock.toml").unlink()
    assert settings_from_job(tmp_path / "job.toml") == settings


@pytest.mark.parametrize(
    ("stock", "options"),
    [
        (["roll:12mm:5m"], {"strips": "wavy"}),
        (["roll:12mm:5m"], {"width": "9mm"}),
        (["roll:12mm:5m"], {"width": "0.5"}),
        (["roll:12mm:5m"], {"sheet": ["600x400mm"]}),
        (["roll:12mm:5m", "roll:15mm:5m"], {}),
        (["roll:12mm:5m"], {"kerf": "0.1mm"}),
        (["roll:12mm:5m"], {"joint": "dovetail"}),
        (["roll:12mm:5m"], {"joint": "slot"}),
        (["roll:12mm:5m"], {"micro_joints": "4"}),
        (["roll:12mm:5m"], {"rim": "ring", "leave_out": "top:80mm"}),
        (["roll:12mm:5m"], {"rotations": "across:10deg"}),
        (["roll:12mm"], {}),
    ],
)
def test_what_does_not_go_with_a_roll_is_refused_in_a_line(stock, options):
    with pytest.raises(InputError) as refused:
        asked(*stock, **options)
    assert "\n" not in str(refused.value)


def test_a_width_that_is_the_rolls_is_taken():
    assert asked("roll:12mm:5m", width="12mm").stock.sheets == (parse_roll("roll:12mm:5m"),)


def test_two_lists_whose_entries_share_a_name_are_refused(tmp_path):
    for name in ("a.toml", "b.toml"):
        (tmp_path / name).write_text(LIST)
    with pytest.raises(InputError):
        asked(str(tmp_path / "a.toml"), str(tmp_path / "b.toml"))
