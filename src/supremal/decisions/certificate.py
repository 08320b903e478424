"""Making a certificate: what was learned, with all that is needed to check it by hand.

The hard questions are answered here, with solvers; what is written down is easy to check.  The states are
those that enabled actions reach; a state's *rank* is the least number of steps to an end or a marked state;
and the bounds are *inductive*: with V the value of the policy, W that of the best, ρ how far one sweep may
move either, and

    c = ρ / (1 - γ),    lower = V - c,    upper = W + c    (both 0 at an end),

a step gives E[r + γ lower(s')] ≥ V(s) - ρ - γ c = lower(s), and likewise for upper.  So two vectors prove
what took a solver to find, and `supremal.verifier`, which knows nothing of solvers, can tell.

Source: McConnell, Mehlhorn, Näher, Schweitzer, "Certifying algorithms", Computer Science Review 5 (2011);
Puterman, *Markov Decision Processes*, theorem 6.2.2, for bounds by sub- and supersolutions.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any, Final

import numpy as np

from supremal import verifier
from supremal._arrays import NONE, Bools, Floats, Ints
from supremal._graph import reverse, search
from supremal.automata.automaton import Automaton
from supremal.automata.reduce import mark_all
from supremal.decisions.chains import largest, rounding
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.planning import enabled_choices, value_iteration
from supremal.decisions.product import MAX_STATES, broken_states, product
from supremal.decisions.reward_machine import RewardMachine
from supremal.decisions.safety import enabled_graph, reachable_states, safe_actions
from supremal.errors import MDPError, RuleError
from supremal.rules.rule import Rule

_ROUNDS: Final = 40


def certify(
    environment: TabularMDP,
    rules: Sequence[Rule | Automaton],
    reward_machine: RewardMachine | None,
    policy: Ints | None = None,
    *,
    gamma: float,
    nonblocking: bool = True,
    max_states: int = MAX_STATES,
    name: str = "",
    made_by: str = "supremal",
) -> dict[str, Any]:
    """Return the certificate of a policy under the greatest safe mask.

    Parameters
    ----------
    environment, rules, reward_machine
        What the product is made of.
    policy
        ``int [S]`` over that product: an enabled action wherever there is one.  Left out: the best.
    gamma
        The discount factor, in [0, 1).
    nonblocking
        Whether what is owed has to be given, and an end or a marked state has to stay reachable.
    max_states
        The most states of the product.
    name, made_by
        What the certificate calls the task, and the program.

    Returns
    -------
    dict
        The document, which `supremal.verifier.verify` finds valid; ``docs/certificate.md`` has its format.

    Raises
    ------
    MDPError
        If the rules cannot be kept, the policy is not one for this product, or γ is out of its range.
    RuleError
        If the text of a rule cannot be checked: it is too large, or not that of its automaton.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes
    >>> walk = from_outcomes([(0, "go", 1, 1.0, ("go",), 5.0)], alphabet=Alphabet(("go",)), terminal=[1])
    >>> document = certify(walk, [], None, gamma=0.5)
    >>> verifier.verify(document).verdict, round(document["claims"]["value_at_least"], 9)
    ('valid', 5.0)
    """
    said = [
        Rule(rule.name or f"rule {k}", rule) if isinstance(rule, Automaton) else rule
        for k, rule in enumerate(rules, 1)
    ]
    numbered = replace(environment, origin=np.arange(environment.n_states, dtype=np.int32)[:, None])
    automata = [rule.automaton if nonblocking else mark_all(rule.automaton) for rule in said]
    model = product(numbered, automata, reward_machine, max_states=max_states)
    enabled = safe_actions(model, nonblocking=nonblocking)
    reached = np.flatnonzero(reachable_states(model, enabled))
    if not (enabled.any(axis=1) | model.terminal & ~broken_states(model))[reached].all():
        message = f"the rules of {name!r} cannot be kept, so there is nothing to certify; check them first"
        raise MDPError(message)
    plan = value_iteration(model, gamma=gamma, enabled=enabled)
    chosen = plan.policy if policy is None else _checked(policy, model, enabled)
    alone = enabled & (np.arange(model.n_actions) == chosen[:, None])
    own = value_iteration(model, gamma=gamma, enabled=alone).value
    residual = max(_residual(model, alone, own, gamma), _residual(model, enabled, plan.value, gamma))

    at = model.origin[reached]
    met, at[:, 0] = np.unique(at[:, 0], return_inverse=True)
    machine_state = [] if reward_machine else [0]
    ranks = _ranks(model, enabled)[reached].tolist() if nonblocking else [NONE] * len(reached)
    document = {
        "format": verifier.FORMAT,
        "version": verifier.VERSION,
        "made_by": made_by,
        "task": name,
        "gamma": gamma,
        "nonblocking": nonblocking,
        "rules": [_rule(rule) for rule in said],
        "reward_machine": _machine(reward_machine),
        **_environment(environment, met),
        "states": [
            [row + machine_state, np.flatnonzero(enabled[i]).tolist(), int(chosen[i]), rank, 0.0, 0.0]
            for i, row, rank in zip(reached.tolist(), at.tolist(), ranks, strict=True)
        ],
    }
    start = model.initial[reached]
    _bound(document, own[reached], plan.value[reached], start, residual)
    return document


def certificate_text(document: Mapping[str, Any]) -> str:
    """Return a certificate as JSON, with a line for each state.

    Examples
    --------
    >>> print(certificate_text({"gamma": 0.5, "states": [[[0], [1]], [[1], []]]}))
    {
    "gamma": 0.5,
    "states": [
    [[0],[1]],
    [[1],[]]
    ]
    }
    """
    parts = []
    for key, value in document.items():
        said = _dump(value)
        if isinstance(value, list) and any(isinstance(row, list | dict) for row in value):
            said = "[\n" + ",\n".join(map(_dump, value)) + "\n]"
        parts.append(f"{_dump(key)}: {said}")
    return "{\n" + ",\n".join(parts) + "\n}"


def _dump(value: object) -> str:
    return json.dumps(value, separators=(",", ":"), allow_nan=False, ensure_ascii=False)


# --- what is written down ---------------------------------------------------------------------------------


def _rule(rule: Rule) -> dict[str, Any]:
    automaton = rule.automaton
    return {
        "name": rule.name,
        "form": rule.form,
        "text": rule.text,
        "events": list(automaton.alphabet),
        "delta": automaton.delta.tolist(),
        "marked": np.flatnonzero(automaton.marked).tolist(),
    }


def _machine(machine: RewardMachine | None) -> dict[str, Any] | None:
    if machine is None:
        return None
    return {
        "states": list(machine.states),
        "propositions": list(machine.propositions),
        "edges": [[*edge] for edge in machine.edges],
    }


def _environment(mdp: TabularMDP, met: Ints) -> dict[str, Any]:
    """Return the states ``met`` of a process, numbered anew, with all their actions and outcomes."""
    number = np.full(mdp.n_states, NONE, np.int64)
    number[met] = np.arange(len(met))
    columns = (mdp.prob.tolist(), number[mdp.next_state].tolist(), mdp.reward.tolist(), mdp.word.tolist())
    outcomes = [[*outcome] for outcome in zip(*columns, strict=True)]
    states = []
    for s in met.tolist():
        rows = [(a, outcomes[mdp.outcomes(s, a)]) for a in range(mdp.n_actions)]
        choices = [[a, row] for a, row in rows if row]
        states.append([bool(mdp.terminal[s]), bool(mdp.marked[s]), int(mdp.label[s]), choices])
    return {
        "events": list(mdp.alphabet),
        "uncontrollable": sorted(mdp.alphabet.uncontrollable),
        "actions": list(mdp.actions),
        "propositions": list(mdp.propositions),
        "words": [list(mdp.spell(w)) for w in range(len(mdp.words))],
        "initial": [[int(number[s]), float(mdp.initial[s])] for s in np.flatnonzero(mdp.initial)],
        "environment": states,
    }


# --- what proves it ---------------------------------------------------------------------------------------


def _checked(policy: Ints, model: TabularMDP, enabled: Bools) -> Ints:
    """Return ``policy`` if it is one for ``model`` under its mask."""
    taken = np.asarray(policy)
    if taken.shape != (model.n_states,) or taken.dtype.kind not in "iu":
        message = (
            f"the policy has shape {taken.shape} and type {taken.dtype}; int ({model.n_states},) is needed"
        )
        raise MDPError(message)
    known = (taken >= 0) & (taken < model.n_actions)
    allowed = known & enabled[np.arange(model.n_states), np.where(known, taken, 0)]
    wrong = np.flatnonzero(reachable_states(model, enabled) & ~model.terminal & ~allowed)
    if wrong.size:
        state = wrong[0]
        message = (
            f"the policy takes {taken[state]} in state {state} of the product, where "
            f"{np.flatnonzero(enabled[state]).tolist()} are enabled; was it learned for another task?"
        )
        raise MDPError(message)
    return np.where(model.terminal, NONE, taken).astype(np.int32)


def _ranks(model: TabularMDP, enabled: Bools) -> Ints:
    """Return the least number of steps to an end or a marked state, ``int [S]``."""
    back, source = reverse(*enabled_graph(model, enabled))
    goals = (model.terminal | model.marked) & ~broken_states(model)
    order, via = search(back, source, goals, np.ones(model.n_states, np.bool_))
    rank = np.zeros(model.n_states, np.int32)
    targets = np.repeat(np.arange(model.n_states), np.diff(back))
    for s in order[via[order] != NONE].tolist():
        rank[s] = rank[targets[via[s]]] + 1
    return rank


def _residual(model: TabularMDP, mask: Bools, value: Floats, gamma: float) -> float:
    """Return how far one sweep may move ``value``, with what rounding can hide."""
    choices = enabled_choices(model, mask)
    slack = 2 * rounding(choices.fan, largest(choices.reward), largest(value))
    if not choices.action.size:
        return slack
    first = choices.outcome[:-1]
    gained = choices.prob * (choices.reward + gamma * value[choices.target])
    worth = np.add.reduceat(gained, first) / np.add.reduceat(choices.prob, first)
    acting = np.flatnonzero(np.diff(choices.choice))
    after = np.maximum.reduceat(worth, choices.choice[acting])
    return largest(after - value[acting]) + slack


def _bound(document: dict[str, Any], own: Floats, best: Floats, start: Floats, residual: float) -> None:
    """Write bounds that are inductive, and what follows from them; make them wider until they are.

    Raises
    ------
    MDPError, RuleError
        If the verifier finds something else that is wrong.
    """
    ends = np.array([document["environment"][row[0][0]][0] for row in document["states"]])
    for _ in range(_ROUNDS):
        margin = residual / (1 - document["gamma"])
        lower, upper = np.where(ends, 0.0, own - margin), np.where(ends, 0.0, best + margin)
        for row, *bounds in zip(document["states"], lower.tolist(), upper.tolist(), strict=True):
            row[4:] = bounds
        low, high = _rounded(_mean(start, lower), -np.inf), _rounded(_mean(start, upper), np.inf)
        gap = _rounded(_decimal(high) - _decimal(low), np.inf)
        document["claims"] = {"value_at_least": low, "optimum_at_most": high, "gap_at_most": gap}
        document["claims"]["words"] = verifier.claims_in_words(document)
        document["sha256"] = verifier.digest(document)
        report = verifier.verify(document)
        if report.verdict == "valid":
            return
        if {statement for statement, _, _ in report.failures} != {"bounds"}:
            break
        residual *= 2
    problem = report.unreadable or ": ".join(report.failures[0])
    message = f"no certificate for {document['task']!r}: {problem}"
    raise (RuleError if problem.startswith("rules: ") else MDPError)(message)


def _decimal(number: float) -> Fraction:
    return Fraction(repr(float(number)))


def _mean(weights: Floats, values: Floats) -> Fraction:
    """Return the mean of ``values``, as the verifier computes it."""
    pairs = [(_decimal(weights[i]), _decimal(values[i])) for i in np.flatnonzero(weights)]
    return sum((p * v for p, v in pairs), Fraction(0)) / sum((p for p, _ in pairs), Fraction(0))


def _rounded(exact: Fraction, towards: float) -> float:
    """Return a double whose decimal is ``exact``, or the next one on the way to an infinity."""
    near = float(exact)
    beyond = _decimal(near) >= exact if towards > 0 else _decimal(near) <= exact
    return near if beyond else float(np.nextafter(near, towards))
