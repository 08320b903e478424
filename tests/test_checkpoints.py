"""Checkpoints: a learner that is killed and goes on is the one that never was."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from contextlib import suppress
from dataclasses import fields, replace
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as examples
from hypothesis import strategies as st

from processes import random_process, random_rule
from supremal import FormatError, MDPError, QResult, Settings, TabularMDP, product, q_learning
from supremal.learning.checkpoints import LearnerState, load_state, save_state
from supremal.learning.schedules import Schedule

pytestmark = pytest.mark.engine
ENVIRONMENT = random_process(5)
MODEL = product(ENVIRONMENT, [random_rule(8)])
SETTINGS = Settings(
    episodes=300,
    episode_steps=9,
    alpha=Schedule.visits(0.7),
    epsilon=Schedule.linear(1.0, 0.1, episodes=200),
    counterfactual=True,
)
RULES = [random_rule(8), random_rule(9)]


def learn(model: TabularMDP = MODEL, settings: Settings = SETTINGS, **options: object) -> QResult:
    return q_learning(model, rules=RULES, settings=settings, seed=3, environment=ENVIRONMENT, **options)


def state_after(episodes: int, settings: Settings = SETTINGS) -> LearnerState:
    kept: list[LearnerState] = []
    learn(settings=replace(settings, episodes=episodes), on_state=kept.append)
    return kept[-1]


def same(one: object, other: object, *, but: tuple[str, ...] = ("seconds",)) -> bool:
    """Tell whether all fields but some are equal to the bit."""
    pairs = [(getattr(one, f.name), getattr(other, f.name)) for f in fields(one) if f.name not in but]
    return all(
        (a.dtype == b.dtype and a.tobytes() == b.tobytes()) if isinstance(a, np.ndarray) else a == b
        for a, b in pairs
    )


OTHERS = [
    Settings(),
    Settings(algorithm="double_q_learning", alpha=Schedule.visits()),
    Settings(algorithm="sarsa", alpha=Schedule.visits(), epsilon=0.6),
    Settings(algorithm="expected_sarsa", counterfactual=True, precision="float32", epsilon=0.4),
]


@pytest.mark.parametrize("settings", [SETTINGS, *OTHERS], ids=range(1 + len(OTHERS)))
def test_a_learner_goes_on_bit_for_bit(settings: Settings, tmp_path: Path) -> None:
    settings = replace(settings, episodes=60)
    path = tmp_path / "learner.npz"
    save_state(path, state_after(23, settings))
    on = learn(settings=settings, resume=load_state(path))
    assert same(on, learn(settings=settings))
    assert [p.name for p in tmp_path.iterdir()] == ["learner.npz"]


def test_a_state_survives_the_file(tmp_path: Path) -> None:
    state = state_after(20)
    save_state(tmp_path / "learner.npz", state)
    assert same(load_state(str(tmp_path / "learner.npz")), state, but=())


def go_on(path: Path) -> None:
    """Learn from the checkpoint to the end, in a process of its own."""
    learn(
        resume=load_state(path) if path.exists() else None,
        on_state=lambda state: save_state(path, state),
        checkpoint_every=1,
    )


@pytest.mark.skipif(not hasattr(os, "fork"), reason="a process is killed that was forked")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")  # the child starts no thread
def test_sigkill_at_any_moment_loses_nothing(tmp_path: Path) -> None:
    path, rng, killed = tmp_path / "learner.npz", np.random.default_rng(0), 0
    (whole,) = [state_after(SETTINGS.episodes)]  # and the kernel is compiled
    fork = multiprocessing.get_context("fork")
    while True:
        child = fork.Process(target=go_on, args=(path,))
        child.start()
        before = path.stat().st_mtime_ns if path.exists() else 0
        limit = time.monotonic() + 60
        while child.is_alive() and (path.stat().st_mtime_ns if path.exists() else 0) == before:
            assert time.monotonic() < limit  # it gets on in every life
            time.sleep(0.001)
        child.join(rng.uniform(0.0, 0.02) if killed < 12 else limit)
        if child.is_alive():
            os.kill(child.pid, signal.SIGKILL)
            child.join()
        killed += child.exitcode == -signal.SIGKILL
        state = load_state(path)
        if state.episodes == SETTINGS.episodes:
            break
    assert killed >= 3
    assert same(state, whole)


def test_ctrl_c_keeps_what_was_learned() -> None:
    kept: list[LearnerState] = []

    def interrupt(episodes: int) -> None:
        if episodes >= 100:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        learn(on_state=kept.append, on_episodes=interrupt, checkpoint_every=40)
    assert [state.episodes for state in kept] == [40, 80, 120]
    assert same(learn(resume=kept[-1]), learn())


def test_when_states_are_given(monkeypatch: pytest.MonkeyPatch) -> None:
    def given_at(every: int | timedelta | None) -> list[int]:
        kept: list[int] = []
        learn(on_state=lambda state: kept.append(state.episodes), checkpoint_every=every)
        return kept

    assert given_at(None) == [300]
    assert given_at(120) == [120, 240, 300]
    monkeypatch.setattr("supremal.learning._run._EPISODES", 90)
    assert given_at(timedelta(0)) == [90, 180, 270, 300]
    assert given_at(timedelta(hours=1)) == [300]
    for wrong in (0, timedelta(seconds=-1)):
        with pytest.raises(MDPError, match="checkpoint_every is .*a whole number from 1, or a time"):
            given_at(wrong)


def test_a_state_belongs_to_its_model_settings_and_seed() -> None:
    state = state_after(20)
    dearer = replace(MODEL, reward=MODEL.reward + 1)
    for message, model, said in (
        ("another model, mask or set of rules", dearer, {}),
        ("with gamma 0.9, not 0.8", MODEL, {"gamma": 0.8}),
        ("with alpha Schedule.*, not 0.1", MODEL, {"alpha": 0.1}),
        ("has run 20 episodes; ask for at least as many, not 19", MODEL, {"episodes": 19}),
    ):
        with pytest.raises(MDPError, match=message):
            learn(model, replace(SETTINGS, **said), resume=state)
    with pytest.raises(MDPError, match="another model, mask or set of rules"):
        q_learning(MODEL, settings=SETTINGS, seed=3, resume=state)  # whose rules nobody counts
    with pytest.raises(MDPError, match="with seed 7, not 3"):
        learn(resume=replace(state, seed=7))
    for name in ("visits", "returns", "progress"):
        with pytest.raises(MDPError, match=f"{name} has .* entries, .* are needed"):
            replace(state, **{name: getattr(state, name)[:1]})


def test_files_that_are_no_checkpoint(tmp_path: Path) -> None:
    path = tmp_path / "learner.npz"
    with pytest.raises(FormatError, match="learner.npz: cannot read it: No such file"):
        load_state(path)
    np.savez(path, q=np.zeros(3))
    with pytest.raises(FormatError, match="no checkpoint of a learner .*about"):
        load_state(path)
    for content in (b"", b"words", np.arange(3).tobytes()):
        path.write_bytes(content)
        with pytest.raises(FormatError, match="no checkpoint of a learner"):
            load_state(path)
    with path.open("wb") as file:
        np.save(file, np.arange(3))
    with pytest.raises(FormatError, match="no checkpoint of a learner"):
        load_state(path)
    with path.open("wb") as file:
        np.savez(file, about=np.array([{"runs": "code"}], object))
    with pytest.raises(FormatError, match="no checkpoint of a learner"):
        load_state(path)


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, bytes, LearnerState]:
    path, state = tmp_path_factory.mktemp("saved") / "learner.npz", state_after(20)
    save_state(path, state)
    return path, path.read_bytes(), state


@given(place=st.floats(0, 1, exclude_max=True), bit=st.integers(0, 7), cut=st.booleans())
@examples(max_examples=150)
def test_damage_is_seen_or_harmless(
    saved: tuple[Path, bytes, LearnerState],
    place: float,
    bit: int,
    cut: bool,  # noqa: FBT001
) -> None:
    path, content, state = saved
    at = int(place * len(content))
    path.write_bytes(
        content[:at] if cut else content[:at] + bytes([content[at] ^ 1 << bit]) + content[at + 1 :]
    )
    with suppress(FormatError):
        assert same(load_state(path), state, but=())
