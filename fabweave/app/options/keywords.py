"""TEMPORARY: replaced by the option table."""

from typing import Any

from fabweave.app.settings import Settings


def settings_from_options(mesh: str, **options: Any) -> Settings:
    """Return settings."""
    from fabweave.cli.commands import make
    from fabweave.cli.options import job_settings

    words = [mesh, "-o", "x"]
    for key, value in options.items():
        for one in value if isinstance(value, list | tuple) else [value]:
            flag = "--" + key.replace("_", "-")
            if one is True:
                words.append(flag)
            else:
                words += [
                    flag,
                    f"{one}mm"
                    if isinstance(one, int | float)
                    and key not in ("fair", "smooth", "seed", "scale", "crossing")
                    else str(one),
                ]
    with make.make_context("make", words) as context:
        return job_settings(context.params.pop("mesh"), context.params)
