"""Write JSON Schema of crossing_map.json and job.toml beside what they describe: `make schemas`.

The first is made of the records of the plan, the second of the table of options.
"""

import json
from pathlib import Path
from typing import Any

import msgspec

from fabweave.options.table import OPTIONS
from fabweave.plan.crossing_map import CrossingMap

PACKAGE = Path(__file__).parents[2] / "fabweave"
DIALECT = "https://json-schema.org/draft/2020-12/schema"


def map_schema() -> dict[str, Any]:
    """Return the schema of the crossing map; programs may meet keys that are new."""
    made = msgspec.json.schema(CrossingMap)
    for one in made["$defs"].values():
        one["description"] = " ".join(one.get("description", "").split())
    return {"$schema": DIALECT, "title": "fabweave.crossing-map/1", **made}


def job_schema() -> dict[str, Any]:
    """Return the schema of job.toml, read as JSON would be."""
    options = {}
    for option in OPTIONS:
        kind = option.kind
        one: dict[str, Any] = {"type": ["string", "number"]}
        if kind.flag:
            one = {"type": "boolean"}
        elif kind.expected == "one of {choices}":
            one = {"enum": list(kind.choices)}
        elif kind.of_table is not None:
            one = {"type": ["string", "number", "object"]}
        if kind.repeatable:
            each = {"anyOf": [one, {"type": "object"}]}
            one = {"anyOf": [each, {"type": "array", "items": each}]}
        options[option.name] = {"description": option.text, **one}
    return {
        "$schema": DIALECT,
        "title": "job.toml",
        "type": "object",
        "required": ["fabweave", "job", "outcome"],
        "properties": {
            "fabweave": {"type": "string"},
            "job": {
                "type": "object",
                "required": ["mesh"],
                "properties": options,
                "additionalProperties": False,
            },
            "outcome": {"type": "object", "required": ["verdict", "pieces", "sheets", "notes"]},
        },
    }


def texts() -> dict[Path, str]:
    """Return what stands in each file."""
    schemas = {
        PACKAGE / "plan" / "crossing_map.schema.json": map_schema(),
        PACKAGE / "options" / "job.schema.json": job_schema(),
    }
    return {path: json.dumps(schema, indent=1) + "\n" for path, schema in schemas.items()}


if __name__ == "__main__":
    for path, text in texts().items():
        path.write_text(text, encoding="utf-8", newline="")
