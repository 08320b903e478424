"""Run every benchmark: ``python -m benchmarks`` (or ``make bench``); names pick some.

``agreement``, ``deep`` and ``fuzz`` take half an hour or more each, ``planning_large`` ten minutes, ``seeds``
and ``cell`` a few; ``deploy`` needs gcc, ``report`` a browser, and ``deep`` and ``study`` the extras of those
names: they are run by their names only.
"""

from __future__ import annotations

import json
import platform
import sys
from importlib import import_module
from pathlib import Path

NAMES = (
    "learning",
    "learners",
    "startup",
    "synthesis",
    "growth",
    "minimise",
    "rules",
    "planning",
    "export",
    "supervised",
)
RECORDS = Path(__file__).parent / "records"


def processor() -> str:
    """Return what this machine calls its processor."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor()


def main(names: list[str]) -> None:
    """Run the benchmarks called ``names`` and write their records."""
    for name in names or NAMES:
        print(f"== {name}")
        record = import_module(f"benchmarks.{name}").run()
        record |= {"python": platform.python_version(), "processor": processor()}
        path = RECORDS / f"{name}.json"
        path.write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
        print()


if __name__ == "__main__":
    main(sys.argv[1:])
