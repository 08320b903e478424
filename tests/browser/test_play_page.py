"""The game as somebody plays it: in a real browser, by mouse and by keys, narrow and wide."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from served import LAMP, served

EXAMPLES = Path(__file__).parents[2] / "examples"
BACKSPACE, ENTER, TAB = "\ue003", "\ue007", "\ue004"


def css(page: Any, selector: str) -> Any:
    return page.find_element("css selector", selector)


def texts(page: Any, selector: str) -> list[str]:
    return page.execute_script(
        "return [...document.querySelectorAll(arguments[0])].map((one) => one.textContent)", selector
    )


def wait(page: Any, condition: Callable[[Any], Any]) -> None:
    from selenium.webdriver.support.ui import WebDriverWait

    WebDriverWait(page, 5, 0.02).until(condition)


def past(page: Any, *words: str) -> None:
    """Wait until this has happened, and nothing else."""
    wait(page, lambda _: texts(page, ".past li") == list(words))


def press(page: Any, key: str) -> None:
    page.switch_to.active_element.send_keys(key)


def choose(page: Any, name: str) -> None:
    named = f"//button[contains(@class, 'event')][contains(., '{name}')]"
    page.find_element("xpath", named).click()


@pytest.fixture(scope="module")
def games(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """The addresses of the games."""
    lamp = tmp_path_factory.mktemp("play") / "lamp.toml"
    lamp.write_text(LAMP, encoding="utf-8")
    files = {"lamp": lamp} | {
        name: EXAMPLES / f"{name}.toml" for name in ("frozen_lake", "manufacturing_cell")
    }
    with ExitStack() as stack:
        yield {name: stack.enter_context(served(path)).url for name, path in files.items()}


@pytest.fixture
def play(browser: Any, games: dict[str, str]) -> Iterator[Callable[..., Any]]:
    """Open a game at a width; at the end the console has to be clean."""

    def go(name: str, width: int = 1280, moves: str = "", **features: str) -> Any:
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        features.setdefault("prefers_reduced_motion", "reduce")
        chosen = [{"name": key.replace("_", "-"), "value": value} for key, value in features.items()]
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": chosen})
        browser.get("about:blank")  # as another fragment alone would load nothing
        browser.get(games[name] + moves)
        wait(browser, lambda page: css(page, ".came").text)
        return browser

    yield go
    assert [line["message"] for line in browser.get_log("browser")] == []


def test_three_moves_and_back(play: Any) -> None:
    page = play("lamp")
    assert css(page, ".happened").text == "The start."
    assert texts(page, "button.event") == ["1on"]
    assert not css(page, ".undo").is_enabled()
    for name, word in (("on", ["on"]), ("off", ["on", "off"]), ("on", ["on", "off", "on"])):
        choose(page, name)
        past(page, *word)
    assert texts(page, ".can button") == ["1off"]
    assert texts(page, ".may button") == ["2fuse"]
    assert texts(page, ".track .current, .facts dd") == ["lit"]
    choose(page, "fuse")
    past(page, "on", "off", "on", "fuse")
    assert texts(page, "button.event") == []  # what is disabled cannot be chosen
    assert texts(page, ".cannot .event, .cannot .told") == [
        "on",
        "fuse can follow, which nobody controls and breaks once",
    ]
    assert css(page, ".over").text == "Nothing more may happen."
    assert texts(page, ".followers .state.current title") == ["1"]
    assert not css(page, ".draw").is_enabled()
    css(page, ".undo").click()
    past(page, "on", "off", "on")
    assert texts(page, ".followers .state.current title") == ["0"]
    assert css(page, ".place").text == "3 steps"
    css(page, ".restart").click()
    past(page)
    assert css(page, ".happened").text == "The start."
    assert not css(page, ".always").is_displayed()


def test_keys_choose_and_take_back(play: Any) -> None:
    page = play("lamp")
    press(page, "1")
    past(page, "on")
    heard = "on was chosen, on happened. Enabled: off. Can happen, and nobody controls it: fuse. "
    assert texts(page, ".live") == [heard]
    press(page, "2")
    past(page, "on", "fuse")
    press(page, "1")  # there is no such option
    press(page, BACKSPACE)
    past(page, "on")
    press(page, BACKSPACE)
    past(page)
    press(page, "c")
    past(page, "on")
    page.execute_script("document.querySelector('.can button').focus()")
    press(page, ENTER)
    past(page, "on", "off")
    focused = page.switch_to.active_element
    assert focused.get_attribute("textContent") == "1on"  # it goes on there
    assert texts(page, ".live") == ["off was chosen, off happened. Enabled: on. "]


def test_who_plays_decides_what_nobody_controls(play: Any) -> None:
    page = play("frozen_lake")
    assert css(page, ".always").is_displayed()
    choose(page, "right")
    wait(page, lambda _: css(page, ".asks").is_displayed())
    assert css(page, ".asks h4").text == "right is chosen. What happens?"
    assert texts(page, ".outcomes .told") == [
        "the agent stays",
        "the agent moves right",
        "the agent moves down",
    ]
    assert texts(page, ".outcomes .share") == ["33.33\u00a0%"] * 3
    assert texts(page, ".can button") == []
    assert not css(page, ".over").is_displayed()
    before = css(page, ".token").rect["x"]
    choose(page, "moves right")
    past(page, "right")
    assert css(page, ".token").rect["x"] > before + 20
    assert not css(page, ".asks").is_displayed()
    assert "it breaks no dithering" in texts(page, ".cannot .told")
    css(page, ".undo").click()  # back to the question
    past(page)
    assert css(page, ".asks").is_displayed()


def test_chance_can_always_decide(play: Any) -> None:
    page = play("frozen_lake")
    css(page, ".auto").click()
    choose(page, "down")
    past(page, "down")
    assert not css(page, ".asks").is_displayed()
    css(page, ".undo").click()  # the choice, too, that chance had answered
    past(page)
    assert css(page, ".happened").text == "The start."
    choose(page, "down")
    past(page, "down")


def test_a_page_loaded_again_goes_on(play: Any) -> None:
    page = play("lamp", moves="#0,0,0")
    past(page, "on", "off", "on")
    choose(page, "fuse")
    past(page, "on", "off", "on", "fuse")
    page.refresh()
    past(page, "on", "off", "on", "fuse")
    assert page.current_url.endswith("#0,0,0,1")


def test_an_address_with_no_game_starts_one(play: Any) -> None:
    page = play("lamp", moves="#9,x")
    past(page)
    wait(page, lambda _: css(page, ".happened").text == "The start.")
    assert not css(page, ".trouble").is_displayed()
    assert all("400" in line["message"] for line in page.get_log("browser"))  # which the browser tells


def test_a_server_that_has_ended_is_told(play: Any) -> None:
    page = play("lamp")
    away = {"offline": True, "latency": 0, "downloadThroughput": -1, "uploadThroughput": -1}
    page.execute_cdp_cmd("Network.enable", {})
    page.execute_cdp_cmd("Network.emulateNetworkConditions", away)
    choose(page, "on")
    wait(page, lambda _: css(page, ".trouble").is_displayed())
    assert css(page, ".trouble").text == "Nobody answers: is supremal play still running?"
    page.execute_cdp_cmd("Network.emulateNetworkConditions", away | {"offline": False})
    choose(page, "on")
    past(page, "on")
    assert not css(page, ".trouble").is_displayed()
    assert all("ERR_INTERNET" in line["message"] for line in page.get_log("browser"))


@pytest.mark.parametrize("name", ["lamp", "frozen_lake", "manufacturing_cell"])
@pytest.mark.parametrize("width", [1280, 400])
def test_it_fits_and_can_be_pressed(play: Any, name: str, width: int) -> None:
    page = play(name, width, prefers_color_scheme="dark" if width == 400 else "light")
    assert page.execute_script("return document.documentElement.scrollWidth") <= width
    boxes = [one.rect for one in page.find_elements("css selector", "button.event")]
    assert boxes
    assert all(box["height"] >= 36 and box["width"] >= 36 for box in boxes)
    assert all(box["x"] >= 0 and box["x"] + box["width"] <= width for box in boxes)
    if width == 1280:
        assert boxes[0]["y"] < 500  # without scrolling
    resources = "return performance.getEntriesByType('resource').map((one) => new URL(one.name).pathname)"
    assert set(page.execute_script(resources)) == {"/moment"}


def test_tab_reaches_every_choice(play: Any) -> None:
    page, seen = play("manufacturing_cell"), []
    for _ in range(12):
        press(page, TAB)
        seen.append(page.execute_script("return document.activeElement.textContent.trim()"))
    choices = texts(page, "button.event")
    assert [said for said in seen if said in choices] == choices
