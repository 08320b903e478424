"""How large reports are and how long they take: made by supremal, and opened in a browser.

Opening is measured by the browser itself (Navigation Timing, from the start of the navigation to the end of
the load event, scripts run), the best of several times.  The large one is a transfer line whose supervisor
has more than 10⁵ states.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from time import perf_counter
from typing import Any

from selenium import webdriver
from selenium.webdriver.chrome.service import Service

from benchmarks.learning import EXAMPLES
from supremal.task import experiment
from supremal.task.findings import plants_of, study
from supremal.task.page import checked, page_of
from supremal.task.reading import read_task
from supremal.task.summary import summary
from supremal.task.task import Task

REPEATS = 5
TIMED = (
    "const t = performance.getEntriesByType('navigation')[0]; return (t.loadEventEnd - t.startTime) / 1000"
)


_MACHINE = """
[[plant]]
name = "M{i}"
transitions = '''
    uncontrollable f{i}, b{i}
    marked idle
    idle -s{i}-> busy
    busy -f{i}-> idle
    busy -b{i}-> down
    down -r{i}-> idle
'''"""
_BUFFER = """
[[rule]]
name = "B{i}"
pattern = "counter"
up = "f{i}"
down = "s{after}"
maximum = {capacity}"""


def line(machines: int, capacity: int) -> str:
    """Return a task file: machines that break down, with buffers between them (see `benchmarks.models`)."""
    parts = [_MACHINE.format(i=i) for i in range(machines)]
    parts += [_BUFFER.format(i=i, after=i + 1, capacity=capacity) for i in range(machines - 1)]
    return "\n".join(parts) + "\n"


def page_of_task(task: Task) -> tuple[str, dict[str, Any]]:
    """Return the report of a task that nothing is learned of, and how large its supervisor is."""
    rules = tuple(rule.automaton for rule in task.rules)
    findings = study(plants_of(task), rules, task.options)
    began = perf_counter()
    page = page_of(task, findings, checked(task, findings))
    return page, {"states": findings.supervisor.automaton.n_states, "seconds": perf_counter() - began}


def page_of_run(task: Task) -> tuple[str, dict[str, Any]]:
    """Return the report of a run, and how long its page took beside the run."""
    done = experiment.run(task, experiment.check(task))
    result = summary(done)
    began = perf_counter()
    page = page_of(task, done.findings, result, done.results[0].policy)
    states = done.findings.supervisor.automaton.n_states
    return page, {"states": states, "seconds": perf_counter() - began}


def opened(browser: webdriver.Chrome, page: Path) -> float:
    """Return the best time in which the browser opens ``page``."""
    times = []
    for _ in range(REPEATS):
        browser.get(page.as_uri())
        times.append(float(browser.execute_script(TIMED)))
    return min(times)


def measured(browser: webdriver.Chrome, folder: Path) -> dict[str, Any]:
    """Print the measures of each report and return them."""
    record: dict[str, Any] = {}
    (folder / "line.toml").write_text(line(5, 5), encoding="utf-8")
    for name, task, make in (
        ("pickup_delivery", read_task(EXAMPLES / "pickup_delivery.toml"), page_of_run),
        ("manufacturing_cell", read_task(EXAMPLES / "manufacturing_cell.toml"), page_of_run),
        ("line", read_task(folder / "line.toml"), page_of_task),
    ):
        page, measures = make(task)
        place = folder / f"{name}.html"
        place.write_text(page, encoding="utf-8")
        measures |= {"kilobytes": place.stat().st_size / 1000, "opened_seconds": opened(browser, place)}
        record[name] = measures
        print(
            f"{name:20} supervisor {measures['states']:>9,} states  {measures['kilobytes']:7.0f} kB  "
            f"made in {measures['seconds']:.2f} s  opened in {measures['opened_seconds']:.2f} s"
        )
    return record


def run() -> dict[str, Any]:
    """Open a browser for the measures."""
    options = webdriver.ChromeOptions()
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage"):
        options.add_argument(argument)
    options.binary_location = shutil.which("chromium") or shutil.which("google-chrome") or ""
    browser = webdriver.Chrome(options, Service(executable_path=shutil.which("chromedriver")))
    try:
        with tempfile.TemporaryDirectory() as folder:
            return measured(browser, Path(folder))
    finally:
        browser.quit()
