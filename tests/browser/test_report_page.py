"""The report as somebody meets it: in a real browser, clicked, typed at, narrow and wide, light and dark."""

from __future__ import annotations

import base64
import json
from itertools import groupby
from typing import Any

import pytest

ARROW, BACK, HOME, END, SPACE = "\ue014", "\ue012", "\ue011", "\ue010", " "


def css(page: Any, selector: str) -> Any:
    return page.find_element("css selector", selector)


def every(page: Any, selector: str) -> list[Any]:
    return page.find_elements("css selector", selector)


def place(page: Any) -> int:
    return int(css(page, ".place").text.split(" ")[0])


def data(page: Any) -> Any:
    text = page.execute_script("return document.getElementById('playback-data').textContent")
    return json.loads(text)


def press(page: Any, *keys: str, at: str = "#reel .first") -> None:
    """Press keys while the focus is on a button of the player."""
    target = css(page, at)
    page.execute_script("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'})", target)
    page.execute_script("arguments[0].focus()", target)
    page.switch_to.active_element.send_keys(*keys)


def steps_of(page: Any, reel: int = 0, episode: int = 0) -> list[dict[str, Any]]:
    return data(page)["reels"][reel]["episodes"][episode]["steps"]


def shown(page: Any) -> dict[str, Any]:
    """Return what the stage shows, in the names of the page."""
    return page.execute_script("""
        const words = (css) => [...document.querySelectorAll(css)].map((one) => one.textContent);
        return {
            can: words('.can .event'), may: words('.may .event'), not: words('.cannot .event'),
            why: words('.cannot .told'), next: words('.can .next .event'), facts: words('.facts dd'),
            at: words('.stage .state.current title').concat(words('.stage .track .current')),
            marks: document.querySelectorAll('.marks span').length,
        };
    """)


def plain(names: list[str]) -> list[str]:
    return [name.replace("_", "") for name in names]


# --- playback ---------------------------------------------------------------------------------------------


def test_keys_slider_and_buttons_move_through_an_episode(visit: Any) -> None:
    page = visit("grid")
    last = len(steps_of(page)) - 1
    assert css(page, ".place").text == f"0 of {last}"
    press(page, ARROW, ARROW, ARROW, at="#reel .play")
    assert place(page) == 3
    press(page, BACK, at="#reel .play")
    assert place(page) == 2
    press(page, END, at="#reel .play")
    assert place(page) == last
    assert css(page, ".over").is_displayed()
    press(page, HOME, at="#reel .play")
    assert place(page) == 0
    slider = css(page, ".slider")
    slider.send_keys(ARROW, ARROW)
    assert place(page) == 2
    assert slider.get_attribute("aria-valuetext") == f"step 2 of {last}"
    css(page, ".on").click()
    assert place(page) == 3
    css(page, ".first").click()
    assert place(page) == 0
    assert not css(page, ".back").is_enabled()


@pytest.mark.parametrize("name", ["grid", "cell", "lamp"])
def test_every_step_shows_what_is_in_the_data(visit: Any, name: str) -> None:
    page = visit(name)
    scene = data(page)
    names = plain(scene["names"])
    steps = steps_of(page)
    automata = every(page, "[data-automaton]")
    for k in {0, 1, len(steps) // 2, len(steps) - 1}:
        page.execute_script(
            "const s = document.querySelector('.slider'); s.value = arguments[0];"
            "s.dispatchEvent(new Event('input'))",
            k,
        )
        step, seen = steps[k], shown(page)
        assert seen["can"] == [names[n] for n in step["can"]]
        assert seen["may"] == [names[n] for n in step["may"]]
        assert sorted(seen["not"]) == sorted(names[n] for n, _ in step["not"])
        assert set(seen["why"]) == {scene["texts"][why] for _, why in step["not"]}
        assert seen["next"] == ([names[step["next"]]] if step.get("next") in step["can"] else [])
        assert seen["facts"] == [scene["texts"][fact] for fact in step.get("facts", [])]
        live = [part["states"][at] for part, at in zip(scene["parts"], step["at"], strict=True)]
        assert sorted(plain(seen["at"])) == sorted(plain(live))
        assert len(automata) == sum(part["kind"] == "rule" for part in scene["parts"])


def test_tokens_stand_where_the_step_says(visit: Any) -> None:
    page = visit("grid")
    css(page, ".last").click()
    end = steps_of(page)[-1]["tokens"]
    board = css(page, ".sm-board").rect
    for token, (x, y, *_) in zip(every(page, ".sm-board .token"), end, strict=True):
        box = token.rect
        across = (box["x"] + box["width"] / 2 - board["x"]) / board["width"]
        down = (box["y"] + box["height"] / 2 - board["y"]) / board["height"]
        assert across == pytest.approx((x + 0.35) / 10.95, abs=0.02)
        assert down == pytest.approx((y + 0.35) / 7.7, abs=0.03)


def test_the_second_tab_plays_the_worst_case(visit: Any) -> None:
    page = visit("grid")
    first, second = every(page, "[role=tab]")
    first.send_keys(ARROW)
    assert second.get_attribute("aria-selected") == "true"
    assert page.switch_to.active_element == second
    assert first.get_attribute("tabindex") == "-1"
    assert css(page, "[role=tabpanel]").get_attribute("aria-labelledby") == second.get_attribute("id")
    assert css(page, ".title").text.startswith("The worst case: ")
    assert "No episode of it can earn less" in css(page, ".note").text
    worst, typical = steps_of(page, 1), steps_of(page, 0)
    assert sum(s.get("reward", 0) for s in worst) <= sum(s.get("reward", 0) for s in typical)
    free = set(data(page)["free"])
    assert shown(page)["marks"] == sum(bool(free & set(step.get("word", []))) for step in worst) > 0
    second.send_keys(HOME)
    assert first.get_attribute("aria-selected") == "true"


def test_episodes_can_be_chosen_and_played(visit: Any) -> None:
    from selenium.webdriver.support.ui import Select, WebDriverWait

    page = visit("grid")
    Select(css(page, ".chooser")).select_by_index(1)
    assert css(page, ".place").text == f"0 of {len(steps_of(page, 0, 1)) - 1}"
    press(page, SPACE, at="#reel .slider")
    assert css(page, ".play").text == "Pause"
    WebDriverWait(page, 5, 0.05).until(lambda _: place(page) >= 2)
    css(page, ".play").click()
    assert css(page, ".play").text == "Play"
    stopped = place(page)
    css(page, ".last").click()
    css(page, ".play").click()  # from the end it begins again
    assert place(page) < stopped
    press(page, END, at="#reel .back")
    assert css(page, ".play").get_attribute("aria-pressed") == "false"


def test_each_step_is_said_to_who_does_not_see_it(visit: Any) -> None:
    page = visit("grid")
    css(page, ".on").click()
    live = css(page, ".live")
    assert live.get_attribute("aria-live") == "polite"
    said = live.get_attribute("textContent")
    step, names = steps_of(page)[1], data(page)["names"]
    assert said.startswith(f"Step 1 of {len(steps_of(page)) - 1}. ")
    assert f"{names[step['did']]} was chosen, {names[step['word'][0]]} happened" in said
    assert "Enabled: " in said


def test_labels_that_nobody_could_read_are_left_out_beside_the_stage(visit: Any) -> None:
    ask = """
        return [...document.querySelectorAll('.followers figure')].map((figure) => {
            const [state, label] = ['.state', '.label'].map((css) => figure.querySelector(css));
            return [figure.querySelector('b').textContent, state.getBoundingClientRect().height,
                    label ? label.getBoundingClientRect().height : 0];
        });
    """
    found = {name: (state, label) for name, state, label in visit("cell").execute_script(ask)}
    assert found["deadline_R1"][1] == 0
    assert found["buffer"][1] > 0
    assert all(state > 12 and (label == 0 or label > 8) for state, label in found.values())
    assert "deadline_R1" in css(visit("cell"), "#rules").text  # where all of it is drawn


def test_tab_reaches_what_can_be_used_and_shows_where_it_is(visit: Any) -> None:
    page, seen = visit("grid"), []
    for _ in range(16):
        page.switch_to.active_element.send_keys("\ue004")
        seen.append(
            page.execute_script("""
            const one = document.activeElement;
            return [one.id || one.className, getComputedStyle(one).outlineStyle];
        """)
        )
    assert seen[0][0] == "skip"
    order = [name for name, _ in seen if name in ("reel-0", "play", "slider", "chooser", "search")]
    assert order == ["reel-0", "play", "slider", "chooser", "search"]
    assert all(outline != "none" for _, outline in seen)


# --- the rest of the page ---------------------------------------------------------------------------------


def test_the_search_finds_rules_events_and_reasons(visit: Any) -> None:
    page = visit("cell")
    rows = every(page, "#disabled-rows > tr")
    search = css(page, "#search")
    search.send_keys("deadline_r1 phi")
    left = [row for row in rows if row.is_displayed()]
    assert 0 < len(left) < len(rows)
    texts = [row.get_attribute("textContent") for row in left]
    assert all("deadline_R1" in text and "phi" in text for text in texts)
    assert css(page, "#found").text == f"{len(left)} of {len(rows)} rows"
    search.send_keys(" nothing like it")
    assert not any(row.is_displayed() for row in rows)


@pytest.mark.parametrize("name", ["grid", "cell", "lamp"])
@pytest.mark.parametrize("width", [1280, 400])
def test_nothing_is_wider_than_the_page(visit: Any, name: str, width: int) -> None:
    page = visit(name, width)
    assert page.execute_script("return document.documentElement.scrollWidth") <= width


def test_dark_and_light_differ_and_can_be_read(visit: Any) -> None:
    """Text and ground differ in lightness by far more than the 4.5 to 1 that WCAG asks for."""
    ask = """
        const of = (css, what) =>
            getComputedStyle(document.querySelector(css))[what].match(/[\\d.]+/g).map(Number);
        return [of('body', 'backgroundColor'), of('body', 'color'),
                of('.stage', 'backgroundColor'), of('.came', 'color')];
    """
    grounds = []
    for scheme in ("light", "dark"):
        ground, ink, stage, said = visit("grid", prefers_color_scheme=scheme).execute_script(ask)
        assert contrast(ground, ink) > 10
        assert contrast(stage, said) > 10
        grounds.append(sum(ground[:3]))
    assert grounds[0] > 600
    assert grounds[1] < 150


def contrast(one: list[float], two: list[float]) -> float:
    def luminance(colour: list[float]) -> float:
        parts = [c / 255 for c in colour[:3]]
        linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    low, high = sorted((luminance(one), luminance(two)))
    return (high + 0.05) / (low + 0.05)


def test_who_wants_less_motion_gets_none(visit: Any) -> None:
    ask = "return getComputedStyle(document.querySelector('.token')).transitionDuration"
    assert visit("grid", prefers_reduced_motion="reduce").execute_script(ask) == "0s"
    assert visit("grid", prefers_reduced_motion="no-preference").execute_script(ask) != "0s"


def test_without_scripts_the_page_still_reads(visit: Any) -> None:
    page = visit("grid", scripts=False)
    text = css(page, "body").text
    assert "The playback needs JavaScript. These are the episodes as words:" in text
    assert "Seed 0: " in text
    events = [data(page)["names"][event] for step in steps_of(page) for event in step.get("word", ())]
    runs = [(event, len(list(run))) for event, run in groupby(events)]
    assert max(times for _, times in runs) > 1
    assert " ".join(event if n == 1 else f"{event} ×{n}" for event, n in runs) in text.replace("\xa0", " ")
    assert "After a drop: put down 2 and 3" in text
    assert not css(page, ".player").is_displayed()
    assert not css(page, "#search").is_displayed()


def test_it_prints(visit: Any) -> None:
    page = visit("grid")
    printed = page.execute_cdp_cmd("Page.printToPDF", {"printBackground": False})
    assert base64.b64decode(printed["data"]).startswith(b"%PDF")
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    assert not css(page, ".play").is_displayed()
    assert css(page, ".sm-board").is_displayed()


@pytest.mark.parametrize("name", ["grid", "cell", "lamp"])
def test_nothing_is_loaded_and_it_opens_at_once(visit: Any, name: str) -> None:
    page = visit(name)
    assert page.execute_script("return performance.getEntriesByType('resource').length") == 0
    timing = "const t = performance.getEntriesByType('navigation')[0]; return t.loadEventEnd - t.startTime"
    assert page.execute_script(timing) < 2000


def test_names_are_text_whatever_they_are(visit: Any) -> None:
    page = visit("lamp")
    assert "<b>never</b> & again" in css(page, "#rules").text
    assert "<b>never</b> & again" in css(page, ".followers").text
    assert every(page, "#rules b") == []
    assert [tab.text for tab in every(page, "[role=tab]")] == ["Anything allowed"]
