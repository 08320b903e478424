"""A supervised environment: its masks against the set-based definition, a monitor, and the exact model."""

from __future__ import annotations

import copy
import pickle
import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st

import book
from stand_ins import MOVES, NO_TWO_UPS, Plays, Scripted
from strategies import SEEDS, plants, specifications
from supremal import (
    Alphabet,
    Automaton,
    MDPError,
    RuleError,
    from_text,
    from_transitions,
    plant_automaton,
    product,
    reward_machine,
    rule_from_safe,
    rule_from_unsafe,
    safe_actions,
    synthesize,
)
from supremal.envs import PickupDelivery, PickupDeliveryEnv, data_file, environment_model
from supremal.envs.supervised import SupervisedEnv
from supremal.formats import read_automaton
from supremal.learning.monitors import _follow
from supremal.rules.patterns import absence
from supremal.rules.rule import Rule

# --- the contract -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", ["correct", "monitor"])
@pytest.mark.parametrize("name", ["CliffWalking-v1", "FrozenLake-v1", "supremal/PickupDelivery-v0"])
def test_gymnasium_finds_no_fault(name: str, mode: Any) -> None:
    env = gymnasium.make(name)
    events = [f"e{a}" for a in range(env.action_space.n)]
    rule = from_text("name r\n0 -e0-> 1\n0 -e1, e2, e3-> 0\n1 -e1, e2, e3-> 0")
    machine = reward_machine(["odd"], [("0", "odd", "1", 1.0), ("1", "!odd", "0", 0.5)])
    wrapped = SupervisedEnv(
        env,
        rules=[rule],
        events=events,
        mode=mode,
        word=lambda action, *_: (events[action],),
        reward_machine=machine,
        labels=lambda seen, _: ["odd"] if np.sum(seen) % 2 else [],
    )
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*is different from the unwrapped version.*")
        check_env(wrapped, skip_render_check=name in ("CliffWalking-v1", "FrozenLake-v1"))  # they need pygame


def test_it_can_be_copied_and_pickled_in_the_middle_of_an_episode() -> None:
    env = SupervisedEnv(Scripted(None, None, None), rules=[from_text("0 -action_0-> 1\n1 -action_1-> 0")])
    env.reset()
    env.step(0)
    for other in (copy.deepcopy(env), pickle.loads(pickle.dumps(env))):  # noqa: S301 - our own bytes
        assert other.action_masks().tolist() == [False, True]
        assert other.step(1)[4]["action_mask"].tolist() == [1, 0]
    assert env.action_masks().tolist() == [False, True]


# --- masks ------------------------------------------------------------------------------------------------


@settings(max_examples=60)
@given(plants(), specifications(), SEEDS, st.booleans())
def test_masks_are_those_of_the_definition_and_of_a_monitor(
    plant: Automaton,
    spec: Automaton,
    seed: int,
    nonblocking: bool,  # noqa: FBT001
) -> None:
    names = sorted({*plant.alphabet, *spec.alphabet} - {"u", "v"})
    inside = book.supcon(book.read(plant), book.read(spec), nonblocking=nonblocking, must_act=True)
    make = {"rules": [spec], "plant": plant, "events": names, "mode": "correct", "nonblocking": nonblocking}
    if not names:
        return
    if inside.initial is None:
        with pytest.raises(RuleError, match="no agent can keep these rules with this plant: "):
            SupervisedEnv(Plays(plant, tuple(names)), **make)
        return
    env = SupervisedEnv(Plays(plant, tuple(names)), **make)
    monitor = synthesize(plant, spec, nonblocking=nonblocking, must_act=True).monitor()
    random, word = np.random.default_rng(seed), []
    try:
        info = env.reset(seed=seed)[1]
        for _ in range(12):
            enabled = [name for name, on in zip(names, info["action_mask"], strict=True) if on]
            assert enabled == [name for name in names if name in monitor.enabled]
            state = book.after(inside, tuple(word))
            assert enabled == [name for name in names if (state, name) in inside.moves]
            info = env.step(int(random.integers(len(names))))[4]
            assert names[info["action"]] in enabled
            assert monitor.observe(info["events"])
            word += info["events"]
    except MDPError as error:
        if "the plant says that none is possible here" not in str(error):
            raise
        monitor.observe(env.unwrapped.word)
        assert not any(name in names for name in monitor.enabled)
    assert (env.counts.violations, env.counts.model_broken) == (0, 0)


@pytest.mark.parametrize("nonblocking", [True, False])
def test_masks_on_a_cliff_are_those_of_its_exact_model(nonblocking: bool) -> None:  # noqa: FBT001
    model = environment_model("CliffWalking-v1", actions=MOVES)
    tabular = product(model, [NO_TWO_UPS])
    masks = safe_actions(tabular, nonblocking=nonblocking)
    number = {(s, q): k for k, (s, q) in enumerate(tabular.origin.tolist()) if not tabular.terminal[k]}
    env = SupervisedEnv(
        gymnasium.make("CliffWalking-v1"),
        rules=[Rule("no_two_ups", NO_TWO_UPS)],
        plant=plant_automaton(model),
        events=MOVES,
        nonblocking=nonblocking,
        mode="correct",
    )
    random = np.random.default_rng(0)
    for seed in range(5):
        seen, info = env.reset(seed=seed)
        rule = 0
        for _ in range(100):
            assert info["action_mask"].tolist() == masks[number[seen["observation"], rule]].tolist()
            seen, _, terminated, _, info = env.step(int(random.integers(4)))
            rule = NO_TWO_UPS.run(info["events"], rule)
            if terminated:
                assert info["action_mask"].all()
                break
    assert env.counts.violations == 0


def test_masks_on_the_grid_are_those_of_its_exact_model() -> None:
    grid = PickupDelivery()
    no_u_turn = rule_from_unsafe(read_automaton(data_file("no_u_turn.json")))
    recovery = rule_from_safe(read_automaton(data_file("recovery.json")))
    model, rules = grid.model(), [no_u_turn, recovery]
    tabular = product(model, rules)
    masks = safe_actions(tabular)
    origin = tabular.origin
    env = SupervisedEnv(
        PickupDeliveryEnv(), rules=rules, plant=plant_automaton(model), events=grid.actions, mode="correct"
    )
    for seed in range(4):
        _, info = env.reset(seed=seed)
        states = [0, 0]
        for _ in range(60):
            row = np.flatnonzero((origin == [info["state"], *states]).all(axis=1))[0]
            assert info["action_mask"].tolist() == masks[row].tolist()
            wish = np.flatnonzero(info["action_mask"][4:])
            _, _, terminated, _, info = env.step(4 + wish[0] if len(wish) else env.action_space.sample())
            states = [
                rule.run([e for e in info["events"] if e in rule.alphabet], q)
                for rule, q in zip(rules, states, strict=True)
            ]
            if terminated:
                break
    assert (env.counts.violations, env.counts.model_broken) == (0, 0)
    assert env.counts.disabled > 0


# --- modes ------------------------------------------------------------------------------------------------


def test_strict_raises_before_the_environment_is_touched() -> None:
    env = SupervisedEnv(
        Scripted(None, None), rules=[from_text("name turns\n0 -action_0-> 1\n1 -action_1-> 0")]
    )
    env.reset()
    with pytest.raises(MDPError) as caught:
        env.step(1)
    assert str(caught.value) == (
        "action 1 ('action_1') is disabled (turns in 0): it breaks turns in its state 0; enabled: action_0"
    )
    assert env.unwrapped.taken == []
    env.step(0)
    assert env.unwrapped.taken == [0]


def test_strict_says_what_the_plant_rules_out() -> None:
    plant = from_text("closed -open-> ajar\najar -close-> closed")
    env = SupervisedEnv(Scripted(None), plant=plant, events=["open", "close"])
    env.reset()
    with pytest.raises(
        MDPError, match=r"'close'.* \(plant 1 in closed\): the plant says that close is not possible"
    ):
        env.step(1)


def test_correct_replaces_and_says_so() -> None:
    rule = from_text("0 -b, c-> 0\nevents a, b, c", alphabet=Alphabet(("a", "b", "c")))
    make = {"rules": [rule], "events": ["a", "b", "c"], "mode": "correct"}
    first = SupervisedEnv(Scripted(*[None] * 40, actions=3, start=5), replace="first", **make)
    first.reset(seed=0)
    info = first.step(5)[4]
    assert (info["action"], info["disabled"], info["events"]) == (6, True, ("b",))
    info = first.step(7)[4]
    assert (info["action"], info["disabled"], first.counts.disabled) == (7, False, 1)
    drawn = []
    for _ in range(2):
        env = SupervisedEnv(Scripted(*[None] * 40, actions=3), **make)
        env.reset(seed=3)
        drawn.append([env.step(0)[4]["action"] for _ in range(40)])
    assert drawn[0] == drawn[1]
    assert set(drawn[0]) == {1, 2}


def test_monitor_lets_everything_pass_and_counts_as_monitors_do() -> None:
    owes = from_text("name owes\nmarked 0\n0 -left-> 1\n1 -right-> 0\n1 -left-> 1")
    rules = [NO_TWO_UPS, owes]
    actions = np.random.default_rng(1).integers(4, size=200).tolist()
    env = SupervisedEnv(
        Scripted(*[None] * 200, actions=4), rules=rules, events=MOVES, mode="monitor", nonblocking=False
    )
    _, info = env.reset()
    states, total = (0, 0), 0
    for action in actions:
        assert info["action_mask"].tolist() == [1, 1, 1, 1]
        seen, _, terminated, _, info = env.step(action)
        states, broken = _follow(rules, states, (MOVES[action],))
        broken += int(terminated and not owes.marked[states[1]])
        assert info["violations"] == broken
        assert info["action"] == action
        total += broken
    assert env.counts.violations == total > 0
    assert env.counts.disabled > 0
    assert env.counts.model_broken == 0
    assert seen["supervisor"] <= env.observation_space["supervisor"].n - 1


# --- what the plant said could not happen -----------------------------------------------------------------


def broken_model(*words: Any, **options: Any) -> SupervisedEnv:
    plant = from_text(
        "name calm\nuncontrollable storm\nevents sail, moor, storm\nat_sea -sail, moor-> at_sea"
    )
    rule = from_text(
        "name rest\nuncontrollable storm\n0 -sail-> 1\n0 -moor-> 0\n1 -moor-> 0\n0 -storm-> 0\n"
        "1 -storm-> 2\n2 -moor-> 2"
    )
    return SupervisedEnv(Scripted(*words), rules=[rule], plant=plant, events=["sail", "moor"], **options)


def test_a_broken_model_is_reported_and_the_rules_alone_go_on() -> None:
    env = broken_model(("sail", "storm"), None, None, None)
    env.reset()
    seen, _, _, _, info = env.step(0)
    assert (info["model_broken"], info["violations"], info["action_mask"].tolist()) == (True, 0, [0, 1])
    assert seen["supervisor"] == env.observation_space["supervisor"].n - 1
    with pytest.raises(
        MDPError, match=r"\(calm in no state, rest in 2\): it breaks a rule at once; enabled: moor"
    ):
        env.step(0)
    assert env.step(1)[4]["model_broken"]
    assert env.counts.model_broken == 1
    _, info = env.reset()
    assert not info["model_broken"]
    assert info["action_mask"].tolist() == [1, 1]


def test_safe_actions_are_the_users_word_for_it() -> None:
    env = broken_model(("sail", "storm"), None, safe_actions=[1])
    env.reset()
    assert env.step(0)[4]["action_mask"].tolist() == [0, 1]
    with pytest.raises(MDPError, match="it is not one of safe_actions; enabled: moor"):
        env.step(0)


def test_where_no_action_is_left_in_safe_mode_that_is_said() -> None:
    plant = from_text("uncontrollable u\nevents a, u\n0 -a-> 0")
    rule = from_text("name r\nuncontrollable u\n0 -a-> 0\n0 -u-> 1")
    env = SupervisedEnv(Scripted(("u",), None, actions=1), rules=[rule], plant=plant, events=["a"])
    env.reset()
    with pytest.raises(MDPError, match="r in 1.*every action breaks a rule at once; give safe_actions"):
        env.step(0)


def test_a_disabled_event_that_nobody_chose_breaks_the_model_until_the_supervisor_knows_its_place() -> None:
    rule = from_text("name r\n0 -a-> 0\n0 -b-> 1\n1 -a-> 0\n1 -c-> 1", alphabet=Alphabet(("a", "b", "c")))
    env = SupervisedEnv(Scripted(("c",), ("a",), ("a",), actions=3), rules=[rule], events=["a", "b", "c"])
    env.reset()
    seen, _, _, _, info = env.step(0)
    assert (info["model_broken"], info["violations"], seen["supervisor"]) == (True, 1, 0)
    assert env.step(0)[0]["supervisor"] == 0


def test_events_that_nobody_knows_touch_nothing() -> None:
    env = SupervisedEnv(
        Scripted(("sparrow", "action_0"), None), rules=[from_text("0 -action_0-> 1\n1 -action_1-> 0")]
    )
    env.reset()
    assert env.step(0)[4]["action_mask"].tolist() == [0, 1]


# --- empty masks ------------------------------------------------------------------------------------------


def test_a_plant_that_offers_nothing_is_an_error_that_names_its_state() -> None:
    plant = from_text("name drill\nuncontrollable done\nidle -go-> busy\nbusy -done-> idle")
    env = SupervisedEnv(Scripted(("go",), None, actions=1), plant=plant, events=["go"])
    env.reset()
    with pytest.raises(
        MDPError, match=r"\(drill in busy\): the plant says that none is possible here; .*waiting"
    ):
        env.step(0)


@pytest.mark.parametrize("mode", ["strict", "monitor"])
def test_the_environments_own_mask_can_count_too(mode: Any) -> None:
    rule = from_text("name r\n0 -a, b-> 0", alphabet=Alphabet(("a", "b", "c")))
    env = Scripted(None, None, actions=3, action_mask=np.array([1, 0, 1], np.int8))
    wrapped = SupervisedEnv(env, rules=[rule], events=["a", "b", "c"], own_mask=True, mode=mode)
    assert wrapped.reset()[1]["action_mask"].tolist() == ([1, 0, 0] if mode == "strict" else [1, 0, 1])
    if mode == "strict":
        with pytest.raises(MDPError, match="'b'.* the environment's own mask does not enable it; enabled: a"):
            wrapped.step(1)
    env.info["action_mask"] = np.array([0, 0, 1], np.int8)
    if mode == "strict":
        with pytest.raises(MDPError, match="own mask enables none of those that the supervisor does"):
            wrapped.reset()
    env.info["action_mask"] = np.zeros(3, np.int8)
    with pytest.raises(MDPError, match="own mask enables nothing"):
        wrapped.reset()
    env.info["action_mask"] = np.ones(2, np.int8)
    with pytest.raises(
        MDPError, match=r"own_mask needs info\['action_mask'\] with 3 entries .*it has shape \(2,\)"
    ):
        wrapped.reset()
    del env.info["action_mask"]
    with pytest.raises(MDPError, match="there is none"):
        wrapped.reset()


def test_a_taxi_keeps_its_own_mask_and_the_rules() -> None:
    rule = absence(of="west", alphabet=Alphabet(("south", "north", "east", "west", "pickup", "dropoff")))
    taxi = gymnasium.make(max(name for name in gymnasium.registry if name.startswith("Taxi-")))
    env = SupervisedEnv(taxi, rules=[Rule("no_west", rule)], events=rule.alphabet.names, own_mask=True)
    _, info = env.reset(seed=2)
    for _ in range(50):
        own = taxi.unwrapped.action_mask(taxi.unwrapped.s)
        own[3] = 0
        assert info["action_mask"].tolist() == own.tolist()
        info = env.step(env.action_space.sample(info["action_mask"]))[4]


# --- words and rewards ------------------------------------------------------------------------------------


def test_a_word_function_reads_the_whole_transition() -> None:
    asked = []

    def word(*transition: Any) -> list[str]:
        asked.append(transition)
        return ["action_0", "splash"]

    rule = from_text("name r\nuncontrollable splash\n0 -action_0-> 0\n0 -splash-> 1\n1 -action_1, splash-> 1")
    env = SupervisedEnv(Scripted(None, None, colour="red"), rules=[rule], word=word)
    env.reset()
    info = env.step(0)[4]
    assert asked == [(0, 0, 1.0, False, False, {"colour": "red"})]
    assert (info["events"], info["action_mask"].tolist()) == (("action_0", "splash"), [0, 1])


@pytest.mark.parametrize("word", ["splash", 7, None])
def test_a_word_that_is_none(word: Any) -> None:
    env = SupervisedEnv(Scripted(None), word=lambda *_: word)
    env.reset()
    with pytest.raises(MDPError, match=f"the word of a step is {word!r}; a tuple of event names is needed"):
        env.step(0)


def test_a_reward_machine_pays_what_the_environments_own_does() -> None:
    grid = PickupDelivery()
    env = SupervisedEnv(PickupDeliveryEnv(), events=grid.actions, reward_machine=grid.reward_machine())
    for seed in range(3):
        seen, info = env.reset(seed=seed)
        twin = PickupDeliveryEnv()
        twin.reset(seed=seed)
        for _ in range(80):
            moves = [a for a in np.flatnonzero(info["action_mask"]) if twin._mask[twin._state][a]]
            action = moves[-1] if moves[-1] > 3 else env.np_random.choice(moves)
            twin.np_random = copy.deepcopy(env.np_random)
            seen, reward, terminated, _, info = env.step(action)
            other, paid, *_ = twin.step(action)
            assert (reward, seen["machine"]) == (paid, other[-1])
            if terminated:
                break


@pytest.mark.parametrize(("labels", "got"), [(None, "it got nothing"), (lambda *_: "ab", "the string 'ab'")])
def test_a_reward_machine_has_to_be_told_what_is_true(labels: Any, got: str) -> None:
    machine = reward_machine(["a"], [("0", "a", "1", 1.0)])
    env = SupervisedEnv(Scripted(None), reward_machine=machine, labels=labels)
    env.reset()
    with pytest.raises(MDPError, match=f"the reward machine needs .*{got}.*: give labels="):
        env.step(0)


# --- what cannot be made ----------------------------------------------------------------------------------


def test_rules_that_nobody_can_keep_are_refused_with_the_reason() -> None:
    rule = from_text("name calm\nuncontrollable gust\n0 -action_0, action_1-> 0\nevents gust")
    with pytest.raises(RuleError) as caught:
        SupervisedEnv(Scripted(None), rules=[rule])
    assert str(caught.value) == (
        "no agent can keep these rules if anything may happen at any time; give plant= to say what can: gust "
        "can happen, which nobody controls: it breaks calm in its state 0"
    )
    with pytest.raises(RuleError) as caught:
        SupervisedEnv(Scripted(None), rules=[rule], plant=from_text("uncontrollable gust\n0 -gust-> 0"))
    assert str(caught.value) == (
        "no agent can keep these rules with this plant: gust can happen, which nobody controls: it breaks "
        "calm in its state 0"
    )


BAD = [
    ({"mode": "strikt"}, MDPError, "mode is 'strikt'; did you mean 'strict'"),
    ({"replace": "last"}, MDPError, "replace is 'last'; known: random, first"),
    ({"events": ["go"]}, RuleError, "events names 1 actions; the environment has 2: name the event of each"),
    ({"events": "ab"}, RuleError, "events names 2 actions"),
    (
        {"rules": ["~(.* left left .*)"]},
        RuleError,
        r"a Rule or an Automaton is needed; write rule_from_regex\(text, Alphabet\(events\)\)",
    ),
    ({"rules": [3]}, RuleError, "a rule is a int; a Rule or an Automaton is needed$"),
    (
        {"rules": [from_text("0 -actoin_0-> 0")]},
        RuleError,
        r"event 'actoin_0' is controllable, but no action is called so \(did you mean 'action_0'\?\); name",
    ),
    (
        {"rules": [from_text("uncontrollable action_1\n0 -action_1-> 0")]},
        RuleError,
        "action 1 is called 'action_1', which is declared uncontrollable",
    ),
    ({"safe_actions": [0, 2]}, MDPError, "action 2 is not known; a whole number from 0 to 1 is needed"),
]


@pytest.mark.parametrize(("options", "kind", "message"), BAD, ids=[str(b[2])[:20] for b in BAD])
def test_what_is_refused_and_why(options: Any, kind: type[Exception], message: str) -> None:
    with pytest.raises(kind, match=message):
        SupervisedEnv(Scripted(None), **options)


def test_only_discrete_actions() -> None:
    env = Scripted(None)
    env.action_space = Box(0, 1)
    with pytest.raises(
        MDPError, match=r"the environment's actions are Box.*; a Discrete space of actions is needed"
    ):
        SupervisedEnv(env)


@pytest.mark.parametrize("action", [2, -1, 0.5, "left", None])
def test_an_unknown_action(action: Any) -> None:
    env = SupervisedEnv(Scripted(None))
    env.reset()
    with pytest.raises(
        MDPError, match=f"action {action!r} is not known; a whole number from 0 to 1 is needed"
    ):
        env.step(action)


def test_events_may_be_a_function() -> None:
    rule = from_transitions(Alphabet(("e0", "e1")), [("0", "e1", "0")])
    env = SupervisedEnv(Scripted(None), rules=[rule], events="e{}".format)
    assert env.reset()[1]["action_mask"].tolist() == [0, 1]
