"""Settings that nobody can mean get one message, quickly and without a warning."""

import tomllib

import pytest

from fabweave.cli import main
from fabweave.errors import InputError
from fabweave.settings import JobSettings, job_toml


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--seed", "-5"), "the seed is -5, and must be from 0 to"),
        (("--seed", str(2**63)), "must be from 0 to"),
        (("--size", "1e300mm"), "say how large it is to be"),
        (("--size", "1e-300mm"), "say how large it is to be"),
        (("--scale", "1e9"), "the mesh would be 1e+11 mm large"),
    ],
)
@pytest.mark.parametrize("command", ["make", "inspect"])
def test_what_nobody_means_is_refused(command, options, words, tmp_path, capsys) -> None:
    folder = ("-o", str(tmp_path / "out"), "-q") if command == "make" else ()
    with pytest.raises(SystemExit) as stop:
        main([command, "shape:torus", *options, *folder])
    assert stop.value.code == 2
    error = " ".join(capsys.readouterr().err.split())
    assert error.startswith("fabweave: ")
    assert words in error
    assert list(tmp_path.iterdir()) == []


def test_the_largest_seed_comes_back_from_toml() -> None:
    settings = JobSettings("shape:cube", seed=2**63 - 1)
    assert tomllib.loads(job_toml(settings, {}))["job"]["seed"] == 2**63 - 1
    with pytest.raises(InputError, match="must be from 0"):
        JobSettings("shape:cube", seed=2**63)
