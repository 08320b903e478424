"""Rewards made out of what is there already: a rule that pays, and a machine that pays earlier.

**Rules.**  A reward machine reads labels, a rule reads words.  `label_with_rule` lets a process carry a rule
along as a listener, and adds a proposition that is true where the rule is satisfied; every reward machine can
then read it, together with all others.  `machine_from_rule` is the machine that reads nothing else.

**Shaping.**  For any potential Φ over the states u of a machine, the rewards

    r' = r + γ Φ(u') - Φ(u),  with Φ = 0 where an episode has ended,

leave every optimal policy as it is, and the values are V'(s, u) = V(s, u) - Φ(u).  A good potential is what
the machine itself is worth, v*(u): the best discounted return over all sequences of labels, as if the agent
could make true whatever it likes.  What is left to learn is V - v*, mostly below 0: a table of zeros is then
optimistic, and makes a learner look around.  The end of an episode is the process's affair, and can come in
any state of the machine; so a shaped machine reads one more proposition, which `label_end` makes true there.

Source: Ng, Harada, Russell, "Policy invariance under reward transformations", ICML 1999; Toro Icarte,
Klassen, Valenzano, McIlraith, "Reward machines: exploiting reward function structure in reinforcement
learning", JAIR 73, 2022, on automated reward shaping.  They take Φ = -v*, which promises the same but is not
optimistic; that is ``potential=-potentials(machine, gamma)``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from supremal._arrays import Bools, Floats
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.automata.reduce import add_trap, mark_all
from supremal.decisions.guards import check_propositions, truth_table
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.planning import value_iteration
from supremal.decisions.product import product
from supremal.decisions.reward_machine import Edge, RewardMachine, none_of, reward_machine
from supremal.errors import MDPError, RuleError


def label_with_rule(mdp: TabularMDP, rule: Automaton, *, proposition: str = "") -> TabularMDP:
    r"""Return ``mdp`` with a new proposition that is true where ``rule`` is satisfied.

    That is in its marked states.  The rule only listens: where it breaks nothing ends, and from then on it
    is not satisfied.

    Parameters
    ----------
    mdp
        The process.
    rule
        What words are followed in.
    proposition
        What to call the proposition; left out: the rule's name.

    Returns
    -------
    TabularMDP
        The reachable pairs of a state and a state of the rule; ``origin`` has one more column, with Q, the
        number of the rule's states, where it is broken.

    Raises
    ------
    RuleError
        If the proposition is no name that a guard could have.
    MDPError
        If ``mdp`` has such a proposition.

    Notes
    -----
    A label is read at the end of an epoch: a rule that is satisfied in the middle of a word only is not seen.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes, from_text
    >>> walk = from_outcomes(
    ...     [(0, "go", 1, 1.0, ("go",)), (1, "go", 2, 1.0, ("go",))], alphabet=Alphabet(("go",)), terminal=[2]
    ... )
    >>> once = from_text("name once\nmarked gone\nfresh -go-> gone", alphabet=walk.alphabet)
    >>> labelled = label_with_rule(walk, once)
    >>> labelled.propositions, labelled.label.tolist(), labelled.origin.tolist()
    (('once',), [0, 1, 0], [[0, 0], [1, 1], [2, 2]])
    """
    listener = add_trap(rule)
    carried = product(mdp, [mark_all(listener)])
    return _labelled(carried, _proposition(rule, proposition), listener.marked[carried.origin[:, -1]])


def machine_from_rule(rule: Automaton, *, reward: float = 1.0, proposition: str = "") -> RewardMachine:
    r"""Return the machine that pays ``reward`` whenever ``rule`` becomes satisfied, and 0 else.

    It reads the proposition that `label_with_rule` adds.  Where the rule is satisfied from the start, nothing
    is paid for that.

    Raises
    ------
    RuleError
        If the proposition, or the rule's name in its place, is no name that a guard could have.

    Examples
    --------
    >>> from supremal import from_text
    >>> once = machine_from_rule(from_text("name once\nmarked gone\nfresh -go-> gone"), reward=5.0)
    >>> once.step(0, {"once"}), once.step(1, {"once"}), once.step(1, set())
    ((1, 5.0), (1, 0.0), (0, 0.0))
    """
    name = _proposition(rule, proposition)
    edges = [
        ("owed", name, "satisfied", reward),
        ("owed", f"!{name}", "owed", 0.0),
        ("satisfied", name, "satisfied", 0.0),
        ("satisfied", f"!{name}", "owed", 0.0),
    ]
    initial = "satisfied" if rule.marked[:1].any() else "owed"
    return reward_machine([name], edges, initial=initial, name=rule.name)


def label_end(mdp: TabularMDP, *, proposition: str = "over") -> TabularMDP:
    """Return ``mdp`` with a new proposition that is true in its terminal states.

    Errors are those of `label_with_rule`.
    """
    return _labelled(mdp, proposition, mdp.terminal)


def potentials(machine: RewardMachine, gamma: float) -> Floats:
    """Return v*, the most that ``machine`` can still pay in each state, discounted; ``float64 [U]``.

    Raises
    ------
    MDPError
        If γ is not in [0, 1).

    Notes
    -----
    Linear in U · 2ⁿ, then value iteration on at most U² steps.

    Examples
    --------
    >>> from supremal import reward_machine
    >>> coffee = reward_machine(["c", "o"], [("start", "c", "carrying", 0.0), ("carrying", "o", "done", 1.0)])
    >>> potentials(coffee, 0.5).tolist()
    [0.5, 1.0, 0.0]
    """
    size = len(machine.states)
    best = np.full((size, size), -np.inf)
    np.maximum.at(best, (np.arange(size)[:, None], machine.delta), machine.reward)
    possible = best > -np.inf
    steps = np.count_nonzero(possible)
    alone = TabularMDP(
        actions=machine.states,  # to go there
        alphabet=Alphabet(()),
        propositions=(),
        words=((),),
        row=np.append(0, np.cumsum(possible)),
        next_state=np.nonzero(possible)[1].astype(np.int32),
        prob=np.ones(steps),
        reward=best[possible],
        word=np.zeros(steps, np.int32),
        terminal=np.zeros(size, np.bool_),
        marked=np.zeros(size, np.bool_),
        label=np.zeros(size, np.int64),
        initial=np.arange(size) == 0,
    )
    return value_iteration(alone, gamma=gamma).value


def shaped(
    machine: RewardMachine, gamma: float, *, potential: ArrayLike | None = None, over: str | None = "over"
) -> RewardMachine:
    """Return ``machine`` with the rewards r + γ Φ(u') - Φ(u): the same optimal policies, told earlier.

    Parameters
    ----------
    machine
        The machine.
    gamma
        The discount factor that the agent learns or plans with, in [0, 1).
    potential
        Φ, ``float64 [U]``; left out: `potentials`.
    over
        The proposition that says that the episode has ended (see `label_end`), where Φ counts as 0.  None, if
        episodes end only where the machine has nothing more to pay and Φ is 0.

    Raises
    ------
    MDPError
        If γ or the potential is out of its range.
    RuleError
        If the machine cannot read one more proposition.

    Notes
    -----
    The promise is about policies that break no rule: a word that breaks one ends the episode too, and
    no proposition says so.

    Examples
    --------
    >>> from supremal import reward_machine
    >>> coffee = reward_machine(["c", "o"], [("start", "c", "carrying", 0.0), ("carrying", "o", "done", 1.0)])
    >>> earlier = shaped(coffee, 0.5, potential=[0.0, 4.0, 0.0])
    >>> earlier.step(0, {"c"}), earlier.step(1, set()), earlier.step(1, {"o", "over"})
    ((1, 2.0), (1, -2.0), (2, -3.0))
    """
    worth = potentials(machine, gamma)
    if potential is not None:
        worth = np.asarray(potential, np.float64)
        if worth.shape != (len(machine.states),) or not np.isfinite(worth).all():
            message = f"the potential is {potential!r}; {len(machine.states)} finite numbers are needed"
            raise MDPError(message)
    phi = dict(zip(machine.states, worth.tolist(), strict=True))
    names = machine.propositions if over is None else tuple(dict.fromkeys((*machine.propositions, over)))
    edges = []
    for source, guard, target, reward in (*machine.edges, *_idle(machine)):
        paid, kept = reward - phi[source], gamma * phi[target]
        if over is None or not kept:
            edges.append(Edge(source, guard, target, paid + kept))
        else:
            edges.append(Edge(source, f"({guard}) & !{over}", target, paid + kept))
            edges.append(Edge(source, f"({guard}) & {over}", target, paid))
    return reward_machine(names, edges, initial=machine.states[0], name=machine.name)


def _idle(machine: RewardMachine) -> Iterator[Edge]:
    """Give the loops that nobody wrote: where no guard of a state is true, the machine stays."""
    guards: dict[str, list[str]] = {state: [] for state in machine.states}
    for edge in machine.edges:
        guards[edge.source].append(edge.guard)
    for u, (state, own) in enumerate(guards.items()):
        rest = none_of(own, machine.propositions)
        if rest is not None:
            label = int(truth_table(rest, machine.propositions).argmax())
            yield Edge(state, rest, state, float(machine.reward[u, label]))


def _proposition(rule: Automaton, name: str) -> str:
    """Return ``name``, or that of ``rule`` in its place, if a guard can have it."""
    chosen = name or rule.name
    if not chosen:
        message = "the rule has no name; say proposition=..."
        raise RuleError(message)
    check_propositions([chosen])
    return chosen


def _labelled(mdp: TabularMDP, proposition: str, true: Bools) -> TabularMDP:
    """Return ``mdp`` with one more proposition, which is true in the states of a mask."""
    check_propositions([proposition])
    if proposition in mdp.propositions:
        message = f"the process has a proposition {proposition!r} already; give the new one another name"
        raise MDPError(message)
    return replace(
        mdp,
        propositions=(*mdp.propositions, proposition),
        label=mdp.label | true.astype(np.int64) << len(mdp.propositions),
    )
