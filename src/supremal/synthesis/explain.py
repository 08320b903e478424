r"""Why: violations, blocking and disabled events, in words.

A supervisor disables a controllable event σ after a word s for one of four reasons:

1. sσ breaks a rule at once;
2. sσ can be followed by a word of Σu*, which nobody controls, that breaks a rule;
3. after such a word no marked state can be reached any more, or only in ways that come to the same;
4. where the agent has to act: after such a word every choice breaks a rule or comes to the same.

Each is told with a shortest word.  Where the way on is not forced (every choice, every way to a marked state
has to be ruled out) the word stands for all: no other choice goes wrong later, no other way sooner.

Source: Wonham, Ramadge, "On the supremal controllable sublanguage of a given language", SIAM J. Control
Optim. 25 (1987), for what has to be disabled; the words are read off `supremal.synthesis.causes`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from supremal._arrays import NONE, Ints, Longs
from supremal.errors import ModelError
from supremal.synthesis import _kernels, _why
from supremal.synthesis.causes import Break, Causes, Parts, find_causes, supervisor_of
from supremal.synthesis.reasons import End, How, Reason, Step
from supremal.synthesis.supervisor import Supervisor

_HOW: Final[dict[int, How]] = {
    _kernels.FORCED: "uncontrollable",
    _kernels.STUCK: "choice",
    _kernels.BLOCKED: "way",
}


@dataclass(frozen=True, slots=True, eq=False)
class Disabled:
    """The events that a supervisor disables, each explained when it is asked for.

    Iterating gives the `Reason` of every pair of a state and a controllable event that the plants can follow
    there and the supervisor does not enable, the states with the shortest words first.

    Parameters
    ----------
    causes
        Why states of the product have to go.
    supervisor
        What is left.
    state
        ``int32 [S]``: the state of the product in each state of the supervisor.
    pairs
        ``int64 [N, 2]``: the supervisor's state and the event.
    parent, last
        ``int32 [S]``: the state before each state of the supervisor on a shortest word to it, and the event
        between them; `NONE` for the initial one.
    """

    causes: Causes
    supervisor: Supervisor
    state: Ints
    pairs: Longs
    parent: Ints
    last: Ints

    def __len__(self) -> int:
        return len(self.pairs)

    def __iter__(self) -> Iterator[Reason]:
        names = self.causes.product.graph.alphabet.names
        return (self.why(s, names[e]) for s, e in self.pairs.tolist())

    def counts(self) -> dict[str, tuple[int, int]]:
        """Return in how many states each event that is disabled somewhere is so, and in how many enabled."""
        names = self.causes.product.graph.alphabet.names
        off = np.bincount(self.pairs[:, 1], minlength=len(names)).tolist()
        on = np.count_nonzero(self.supervisor.automaton.delta != NONE, axis=0).tolist()
        return {name: (off[e], on[e]) for e, name in enumerate(names) if off[e]}

    def word(self, state: int) -> tuple[str, ...]:
        """Return a shortest word to ``state`` of the supervisor."""
        events = []
        while self.parent[state] != NONE:
            events.append(int(self.last[state]))
            state = int(self.parent[state])
        return self.causes.product.graph.alphabet.spell(reversed(events))

    def why(self, state: int, event: str) -> Reason:
        """Return why ``event`` is disabled in ``state`` of the supervisor, in time linear in the answer.

        Raises
        ------
        ModelError
            If it is not disabled there, or the plants cannot follow it.
        """
        product, here = self.causes.product, int(self.state[state])
        e = product.graph.alphabet.index(event)
        leads = product.events(here)
        if event not in leads or self.supervisor.enabled[state, e]:
            what = "is enabled" if event in leads else "is not possible in the plants"
            message = (
                f"{event!r} {what} in state {state} of the supervisor; only what is disabled has a reason"
            )
            raise ModelError(message)
        word = self.word(state)
        if leads[event] == NONE:
            return Reason(word, event, (), "break", product.broken(here, event))
        return Reason(word, event, *_end(self.causes, leads[event]))


def explain_disabled(
    plants: Parts,
    specs: Parts,
    supervisor: Supervisor | None = None,
    *,
    nonblocking: bool = True,
    must_act: bool = False,
    max_states: int | None = None,
) -> Disabled:
    r"""Return the events that a supervisor disables, with reasons.

    Parameters
    ----------
    plants, specs, nonblocking, must_act, max_states
        What the supervisor was synthesized from, and how.
    supervisor
        What `synthesize` returned for them; left out: it is built.

    Raises
    ------
    ModelError
        If ``supervisor`` is not the one of these plants and specifications.

    Notes
    -----
    One more synthesis; then each reason is linear in its length.

    Examples
    --------
    >>> from supremal import from_text
    >>> plant = from_text("uncontrollable fault \n idle -start-> busy \n busy -fault, stop-> idle")
    >>> spec = from_text("name calm \n uncontrollable fault \n ready -start-> going \n going -stop-> ready")
    >>> for reason in explain_disabled(plant, spec):
    ...     print(reason)
    start is disabled: after it fault can happen, which nobody controls: it breaks calm in its state going
    """
    causes = find_causes(plants, specs, nonblocking=nonblocking, must_act=must_act, max_states=max_states)
    own, state = supervisor_of(causes)
    if supervisor is not None:
        state = _beside(supervisor, own, state)
    return disabled_in(causes, supervisor or own, state)


def disabled_in(causes: Causes, supervisor: Supervisor, state: Ints) -> Disabled:
    """Return what `explain_disabled` does, from what `find_causes` and `supervisor_of` returned."""
    pairs = np.argwhere(causes.product.possible(state) & ~supervisor.enabled)
    parent, last = _why.parents(supervisor.automaton.delta)
    return Disabled(causes, supervisor, state, pairs, parent, last)


def _beside(supervisor: Supervisor, own: Supervisor, state: Ints) -> Ints:
    """Return the states of the product beside those of ``supervisor``, which has to behave as ``own``."""
    there, here = supervisor.automaton, own.automaton
    image = np.empty(0, np.int32)
    if there.alphabet == here.alphabet and there.delta.shape == here.delta.shape:
        start = np.arange(here.n_states + 1, dtype=np.int64) * len(here.alphabet)
        event = np.tile(np.arange(len(here.alphabet), dtype=np.int32), here.n_states)
        image = _why.follow(there.delta, start, event, here.delta.reshape(-1))
    if (
        len(image) != there.n_states
        or NONE in image
        or not np.array_equal(_renamed(there.delta, image), here.delta[image])
    ):
        message = (
            f"the supervisor has {there.n_states} states and is not the one of these plants and "
            f"specifications, which has {here.n_states}; give those, and the options, that it was made with"
        )
        raise ModelError(message)
    found: Ints = state[image]
    return found


def _renamed(delta: Ints, image: Ints) -> Ints:
    renamed: Ints = np.append(image, np.int32(NONE))[delta]
    return renamed


def explain_empty(causes: Causes) -> Reason | None:
    r"""Return why nothing can be enforced, None if something can.

    Examples
    --------
    >>> from supremal import from_text
    >>> plant = from_text("uncontrollable fault \n on -fault-> on")
    >>> never = from_text("name never \n events fault \n uncontrollable fault \n initial calm")
    >>> print(explain_empty(find_causes(plant, never)))
    nothing can be enforced: fault can happen, which nobody controls: it breaks never in its state calm
    """
    if not causes.cause.size:
        product = causes.product
        parts = [*product.plants, *(rule.closure for rule in product.rules)]
        return Reason((), "", (), "nothing", tuple(Break("", p.name, "") for p in parts if not p.n_states))
    return None if causes.cause[0] == _kernels.KEPT else Reason((), "", *_end(causes, 0))


def _end(causes: Causes, state: int) -> tuple[tuple[Step, ...], End, tuple[Break, ...]]:
    """Follow the causes from a state that has gone to where they end."""
    product = causes.product
    steps: list[Step] = []
    uncontrollable = product.graph.alphabet.uncontrollable
    while True:
        cause, after = int(causes.cause[state]), int(causes.after[state])
        if cause == _kernels.ESCAPES:
            return tuple(steps), "break", product.escaping(state)
        leads = product.events(state)
        choices = tuple(event for event in leads if event not in uncontrollable)
        if after == NONE:
            stuck = cause == _kernels.STUCK
            goes_on = any(to != NONE for to in leads.values())
            tried = choices if stuck else () if goes_on else tuple(leads)
            breaks = tuple(b for event in tried for b in product.broken(state, event))
            return tuple(steps), "stuck" if stuck else "trapped" if goes_on else "dead", breaks
        how = _HOW[cause]
        event = next(
            event
            for event, to in leads.items()
            if to == after and (how == "way" or (event in uncontrollable) == (how == "uncontrollable"))
        )
        steps.append(Step(event, how, choices if how == "choice" else ()))
        state = after
