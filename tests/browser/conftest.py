"""One headless browser for all tests, and the pages that they open.

Where there is no browser these tests are skipped; in CI (``CI=true``) that is a failure.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from supremal.task.experiment import check, run
from supremal.task.findings import plants_of, study
from supremal.task.page import checked, page_of
from supremal.task.reading import read_task
from supremal.task.summary import summary

EXAMPLES = Path(__file__).parents[2] / "examples"


def missing(what: str) -> None:
    if os.environ.get("CI") == "true":
        pytest.fail(f"{what} is missing, and CI has to test in a browser")
    pytest.skip(f"{what} is missing")


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """A headless Chromium that logs what its console says."""
    try:
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service
    except ImportError:
        missing("selenium")
    program = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    driver = shutil.which("chromedriver")
    if program is None or driver is None:
        missing("a Chromium with its chromedriver")
    options = webdriver.ChromeOptions()
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars"):
        options.add_argument(argument)
    options.binary_location = program
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    opened = webdriver.Chrome(options, Service(executable_path=driver))
    opened.set_script_timeout(10)
    try:
        yield opened
    finally:
        opened.quit()


def learned(name: str, episodes: int) -> str:
    """Return the report of an example, learned for some episodes."""
    task = read_task(EXAMPLES / f"{name}.toml")
    task = replace(task, settings=replace(task.settings, episodes=episodes), interval=episodes // 4)
    done = run(task, check(task))
    return page_of(task, done.findings, summary(done), done.results[0].policy)


def unlearned(text: str, folder: Path) -> str:
    """Return the report of a task that nothing is learned of."""
    path = folder / "task.toml"
    path.write_text(text, encoding="utf-8")
    task = read_task(path)
    findings = study(plants_of(task), tuple(rule.automaton for rule in task.rules), task.options)
    return page_of(task, findings, checked(task, findings))


LAMP = """
title = "A lamp that burns out </script><script>console.error('broken out')</script>"
[[plant]]
name = "lamp"
transitions = \"""
    uncontrollable fuse
    dark -on-> lit
    lit -off, fuse-> dark
\"""
[[rule]]
name = "<b>never</b> & again"
pattern = "at_most"
of = "fuse"
times = 1
"""


@pytest.fixture(scope="session")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The addresses of the pages."""
    folder = tmp_path_factory.mktemp("pages")
    made = {
        "grid": learned("pickup_delivery", 20_000),
        "cell": learned("manufacturing_cell", 200),
        "lamp": unlearned(LAMP, folder),
    }
    for name, page in made.items():
        (folder / f"{name}.html").write_text(page, encoding="utf-8")
    return {name: (folder / f"{name}.html").as_uri() for name in made}


@pytest.fixture
def visit(browser: Any, pages: dict[str, str]) -> Iterator[Callable[..., Any]]:
    """Open a page at a width, in a colour scheme; at the end the console has to be clean."""

    def go(name: str, width: int = 1280, *, scripts: bool = True, **features: str) -> Any:
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        features.setdefault("prefers_reduced_motion", "reduce")  # no smooth scrolling while a test clicks
        chosen = [{"name": key.replace("_", "-"), "value": value} for key, value in features.items()]
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": chosen})
        browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": not scripts})
        browser.get(pages[name])
        return browser

    yield go
    browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
    assert [line["message"] for line in browser.get_log("browser")] == []
