"""The team environment: PettingZoo's own tests, rules counted apart from it, chances, masks and errors."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from supremal import (
    Alphabet,
    MDPError,
    MissingDependencyError,
    TabularMDP,
    evaluate,
    from_outcomes,
    value_iteration,
)
from supremal.envs.team import TeamEnv
from supremal.task.experiment import supervise
from supremal.task.reading import read_task

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs" / "multi-agent.md"
ROBOTS = {f"R{k}": [f"{kind}{k}" for kind in "enwspd"] for k in (1, 2)}
CELL = read_task(ROOT / "examples" / "manufacturing_cell.toml")
MODEL, ENABLED = supervise(CELL.environment, CELL)


def cell(**options: Any) -> TeamEnv:
    return TeamEnv(MODEL, ROBOTS, **{"enabled": ENABLED, "max_steps": 200} | options)


def play(env: TeamEnv, steps: int, seed: int) -> Any:
    """Play uniformly under the masks; yield the word of each step, and None before each episode."""
    random = np.random.default_rng(seed)
    env.reset(seed=seed)
    yield None
    for _ in range(steps):
        agent = env.agent_selection
        observation, _, terminated, truncated, _ = env.last()
        if terminated or truncated:
            env.reset()
            yield None
            continue
        env.step(random.choice(np.flatnonzero(observation["action_mask"])))  # raises where it is empty
        yield env.infos[agent]["events"]


class Counting:
    """Follow plants and rules by their own transitions, and count what they do not have."""

    def __init__(self) -> None:
        self.parts = {
            **{plant.name: plant for plant in CELL.plants},
            **{r.name: r.automaton for r in CELL.rules},
        }
        self.state, self.broken = dict.fromkeys(self.parts, 0), Counter[str]()

    def follow(self, word: tuple[str, ...] | None) -> None:
        if word is None:
            self.state = dict.fromkeys(self.parts, 0)
        for event in word or ():
            for name, part in self.parts.items():
                if event in part.alphabet:
                    to = int(part.delta[self.state[name], part.alphabet.index(event)])
                    self.broken[name] += to < 0
                    self.state[name] = max(to, 0)


# --- the contract -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("options", [{}, {"max_steps": None}, {"enabled": None}], ids=str)
def test_pettingzoo_finds_no_fault(options: dict[str, Any]) -> None:
    with warnings.catch_warnings():
        warnings.filterwarnings(
            "ignore", message="The old environment creation API", category=DeprecationWarning
        )
        from pettingzoo.test import api_test, seed_test  # which warns of itself

        for known in (
            "Observation is not a NumPy array",  # a dictionary with the mask, as in its own board games
            "Observation space for each agent probably should be",
            "Observation numpy array is all zeros",  # the initial state
            "We recommend agents to be named",
            "Environment has not defined a render",
        ):
            warnings.filterwarnings("ignore", message=known)
        api_test(cell(**options), num_cycles=500)
        seed_test(lambda: cell(**options), num_cycles=200)


def test_it_can_be_copied_and_pickled_in_the_middle_of_an_episode() -> None:
    env = cell()
    env.reset(seed=3)
    env.step(1)
    runs = [[*play_on(other)] for other in (copy.deepcopy(env), pickle.loads(pickle.dumps(env)), env)]  # noqa: S301 - our own bytes
    assert runs[0] == runs[1] == runs[2]


def play_on(env: TeamEnv) -> Any:
    for _ in range(50):
        agent = env.agent_selection
        env.step(int(env.observe(agent)["action_mask"].argmax()))
        yield env.infos[agent]["events"]


# --- the rules --------------------------------------------------------------------------------------------


def test_no_rule_breaks_and_nobody_is_stuck() -> None:
    env, count, steps = cell(), Counting(), 0
    for word in play(env, 20_000, seed=1):
        count.follow(word)
        steps += word is not None
        told = MODEL.origin[env.infos["R1"]["state"]]
        assert [count.state[rule.name] for rule in CELL.rules] == told[2:6].tolist()
    assert steps > 19_000
    assert not +count.broken


def test_the_same_count_finds_what_breaks_without_the_mask() -> None:
    env, count, ended = cell(enabled=None), Counting(), 0
    for word in play(env, 5_000, seed=1):
        count.follow(word)
        ended += word is not None and env.terminations["R1"]
    assert +count.broken == {rule: count.broken[rule] for rule in ("buffer", "deadline_R1", "deadline_R2")}
    assert 50 < count.broken.total() == ended  # what breaks a rule ends the episode


# --- turns, chances and rewards ---------------------------------------------------------------------------


def test_who_is_down_is_not_asked() -> None:
    env, works, faults = cell(), True, 0
    for word in play(env, 5_000, seed=2):
        if word is None:
            works = True
        for event in word or ():
            works = {"phi": False, "rho": True}.get(event, works)
        faults += not works
        assert works or env.agent_selection == "R1"
    assert faults > 100


def test_nature_keeps_to_its_chances() -> None:
    env, seen, full, works = cell(), Counter[tuple[bool, str]](), False, True
    for word in play(env, 20_000, seed=3):
        full = False if word is None else full
        for event in word or ():
            if event in {"quiet", "item", "phi"} and works:
                seen[full, event] += 1
            full = (full or event == "item") and event != "p1"
            works = event != "phi" and (works or event == "rho")
        works = word is None or works
    for already, odds in (
        (False, {"quiet": 0.7, "item": 0.25, "phi": 0.05}),
        (True, {"quiet": 0.7, "phi": 0.05}),
    ):
        drawn, total = sum(seen[already, event] for event in odds), sum(odds.values())
        for event, chance in odds.items():
            p = chance / total
            assert abs(seen[already, event] / drawn - p) < 4 * np.sqrt(p * (1 - p) / drawn), event


def test_a_plan_earns_what_it_is_worth() -> None:
    """Play the optimal policy, and compare what it earns with its exact value."""
    gamma, env = 0.9, cell(max_steps=None)
    plan, earned = value_iteration(MODEL, gamma=gamma, enabled=ENABLED), []
    for seed in range(300):
        env.reset(seed=seed)
        total, epoch = 0.0, 0
        while epoch < 150:
            agent = env.agent_selection
            action = MODEL.actions[plan.policy[env.infos[agent]["state"]]]
            env.step(ROBOTS[agent].index(action))
            assert env.rewards["R1"] == env.rewards["R2"]  # the team is paid together
            total += gamma**epoch * env.rewards[agent]  # it is the agent's own event that earns, the first
            epoch += len(env.infos[agent]["events"])
        earned.append(total)
    exact = evaluate(MODEL, plan.policy, gamma=gamma).value
    assert abs(np.mean(earned) - exact) < 4 * np.std(earned) / np.sqrt(len(earned))


def test_masks_of_others_and_at_the_end() -> None:
    env = cell(max_steps=2)
    env.reset(seed=0)
    assert env.agent_selection == "R1"
    assert env.observe("R1")["action_mask"].tolist() == [0, 1, 1, 1, 0, 0]
    assert not env.observe("R2")["action_mask"].any()
    env.step(1)
    env.step(0)
    assert env.truncations == {"R1": True, "R2": True}
    asked = env.agent_selection
    other = ({*ROBOTS} - {asked}).pop()
    assert 0 < env.observe(asked)["action_mask"].sum() < 6  # what the bootstrap needs
    assert env.observe(other)["action_mask"].all()
    for _ in range(2):
        env.step(None)
    assert env.agents == []
    with pytest.raises(MDPError, match="no episode is under way; call reset first"):
        env.step(0)


def test_what_agents_see_can_be_said() -> None:
    view = np.arange(MODEL.n_states)[:, None].repeat(2, axis=1)
    env = cell(observations=view)
    env.reset(seed=0)
    env.step(1)
    state = env.infos["R1"]["state"]
    assert env.state().tolist() == [state, state]
    assert env.observe("R2")["observation"].tolist() == [state, state]


def test_the_seed_settles_a_run_and_no_seed_goes_on() -> None:
    one, two = cell(), cell()
    assert [*play(one, 500, seed=5)] == [*play(two, 500, seed=5)]
    words = []
    for _ in range(2):
        one.reset()
        words.append([*play_on(one)])
    assert words[0] != words[1]


# --- what is refused --------------------------------------------------------------------------------------


def test_an_action_that_is_disabled_is_refused_before_anything_happens() -> None:
    env = cell()
    for word in play(env, 20_000, seed=4):
        at, agent = env.infos["R1"]["state"], env.agent_selection
        columns = [MODEL.actions.index(name) for name in ROBOTS[agent]]
        disabled = np.flatnonzero(MODEL.feasible[at, columns] & ~ENABLED[at, columns])
        if word is not None and disabled.size and not env.truncations[agent]:
            break
    with pytest.raises(
        MDPError, match=rf"action {disabled[0]} .* of {agent}: the supervisor disables it; enabled: "
    ):
        env.step(disabled[0])
    assert env.infos["R1"]["state"] == at


@pytest.mark.parametrize(
    ("action", "said"),
    [
        (0, r"action 0 \('e1'\) of R1: it is not possible there; enabled: n1, w1, s1"),
        (6, "action 6 of R1 is not known; a whole number from 0 to 5 is needed"),
        (-1, "action -1 of R1 is not known"),
        (None, "action None of R1 is not known"),
        (1.0, "action 1.0 of R1 is not known"),
    ],
)
def test_an_action_that_cannot_be(action: Any, said: str) -> None:
    env = cell()
    env.reset(seed=0)
    with pytest.raises(MDPError, match=said):
        env.step(action)


def game(*lines: Any, terminal: tuple[int, ...] = ()) -> TabularMDP:
    sigma = Alphabet(("a", "b", "u"), uncontrollable=frozenset({"u"}))
    return from_outcomes(
        [(s, act, to, 1.0, (word,)) for s, act, to, word in lines], alphabet=sigma, terminal=terminal
    )


TWO = game((0, "a", 1, "a"), (1, "b", 0, "b"))


@pytest.mark.parametrize(
    ("model", "agents", "said"),
    [
        (TWO, {"one": ["a"], "two": ["c"]}, "agent 'two' has the action 'c', which is unknown; known: a, b"),
        (TWO, {"one": ["a", "b"], "two": ["b"]}, "action 'b' is that of 'one' and of 'two'; name it once"),
        (TWO, {"one": ["a"]}, "action 'b' can be chosen, but no agent has it; give it to one"),
        (
            TWO,
            {"one": ["a", "b"], "two": []},
            r"the actions of agent 'two' are \[\]; a list of one name or more",
        ),
        (TWO, {"one": "ab"}, "the actions of agent 'one' are 'ab'; a list"),
        (TWO, {}, "action 'a' can be chosen, but no agent has it"),
        (
            game((0, "a", 1, "a"), (1, "b", 0, "b"), (1, "a", 0, "a")),
            {"one": ["a"], "two": ["b"]},
            "after a it is the turn of one and two; one at a time has to act",
        ),
        (
            game((0, "a", 0, "a"), (0, "wait", 0, "u")),
            {"one": ["a"]},
            r"at the start it is the turn of one and nature \(wait\)",
        ),
        (
            game((0, "a", 1, "a"), (1, "wait", 1, "u")),
            {"one": ["a"]},
            "after a no agent has a turn any more, and nothing is over",
        ),
    ],
)
def test_agents_that_do_not_fit(model: TabularMDP, agents: Any, said: str) -> None:
    with pytest.raises(MDPError, match=said):
        TeamEnv(model, agents)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"max_steps": 0}, "max_steps is 0; a whole number above 0, or None"),
        ({"enabled": np.ones((2, 2), np.bool_)}, "the mask enables 'b' in state 0, where it is not feasible"),
        ({"enabled": np.zeros((2, 2), np.bool_)}, "the mask leaves no action at the start"),
        (
            {"observations": np.zeros((3, 1), np.int64)},
            r"shape \(3, 1\) and type int64; int \(2, K\) is needed",
        ),
        ({"observations": np.zeros((2, 1))}, "type float64; int"),
    ],
    ids=str,
)
def test_settings_that_do_not_fit(options: Any, said: str) -> None:
    with pytest.raises(MDPError, match=said):
        TeamEnv(TWO, {"one": ["a"], "two": ["b"]}, **options)


def test_nature_can_end_the_game() -> None:
    env = TeamEnv(game((0, "a", 1, "a"), (1, "wait", 2, "u"), terminal=(2,)), {"one": ["a"]})
    env.reset(seed=0)
    env.step(0)
    observation, _, terminated, truncated, info = env.last()
    assert (terminated, truncated, info) == (True, False, {"events": ("a", "u"), "state": 2})
    assert observation["action_mask"].tolist() == [1]


def test_without_pettingzoo_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pettingzoo", None)
    for name in ("_pettingzoo", "team"):
        monkeypatch.delitem(sys.modules, f"supremal.envs.{name}")
    with pytest.raises(MissingDependencyError, match=r"needs pettingzoo: pip install 'supremal\[multi\]'"):
        import supremal.envs.team  # noqa: F401 - importing is what fails


# --- the published text -----------------------------------------------------------------------------------


def test_the_page_runs_as_printed(tmp_path: Path) -> None:
    blocks = PAGE.read_text(encoding="utf-8").split("```python multi\n")[1:]
    assert blocks
    script = tmp_path / "page.py"
    script.write_text("\n".join(block.split("```")[0] for block in blocks), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-W", "error", script], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
