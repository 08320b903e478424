"""Safe actions: the supremal supervisor of a decision process.

An agent has to choose at every epoch, so a state is *safe* iff it is terminal (and no sink) or has an enabled
action, and an action is *enabled* iff every outcome of positive probability keeps every rule and leads to a
safe state.  With ``nonblocking`` a terminal or marked state must also stay reachable through enabled actions;
in a finite process that is to say that some policy under the mask reaches one with probability 1.  The
greatest such mask is unique: it is the least fixpoint of taking away, reached in any order.

In a `product` no rule is owed anything in such a state: where an episode ends with something owed there is a
sink, and marked is only where all rules are.  So what is owed can always still be given.

The paper's own supervisor looks one step ahead: it disables an action iff that leads to s_a at once, and so
can walk into a state from which every way leads to s_a.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from supremal._arrays import NONE, Bools
from supremal._graph import coreachable_to, path_to, reachable_from, reverse, search
from supremal.decisions import _kernels
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.product import broken_states
from supremal.errors import MDPError

Lookahead = Literal["full", "one_step"]


def safe_actions(mdp: TabularMDP, *, nonblocking: bool = True, lookahead: Lookahead = "full") -> Bools:
    r"""Return the greatest safe mask of a product, ``bool [S, A]``.

    Parameters
    ----------
    mdp
        A `product` of an environment and its rules.
    nonblocking
        Whether a terminal or marked state must stay reachable.
    lookahead
        "one_step" gives the paper's supervisor, which may walk into dead ends (see `find_dead_end`).

    Returns
    -------
    bool [S, A]
        Row s is empty where s is terminal or not safe.  If the initial state's is, no policy keeps the rules.

    Notes
    -----
    Linear in the outcomes for each round of nonblocking, usually one or two.  Without it
    this is the safety game that the agent plays against chance; with it, almost-sure reaching (Baier, Katoen,
    *Principles of Model Checking*, section 10.6.3).

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes, from_text, product, safe_actions
    >>> fork = from_outcomes(
    ...     [
    ...         (0, "left", 1, 1.0, ("left",)),
    ...         (0, "right", 2, 1.0, ("right",)),
    ...         (1, "left", 2, 1.0, ("left",)),
    ...     ],
    ...     alphabet=Alphabet(("left", "right")),
    ...     terminal=[2],
    ... )
    >>> never_twice = from_text("0 -right-> 0 \n 0 -left-> 1 \n 1 -right-> 0", alphabet=fork.alphabet)
    >>> p = product(fork, [never_twice])
    >>> safe_actions(p)[0].tolist(), safe_actions(p, lookahead="one_step")[0].tolist()
    ([False, True], [True, True])
    """
    if lookahead not in ("full", "one_step"):
        message = f"lookahead is {lookahead!r}; 'full' or 'one_step' is needed"
        raise MDPError(message)
    broken = broken_states(mdp)
    enabled = mdp.feasible & ~mdp.terminal[:, None]
    if lookahead == "one_step":
        hits = np.add.reduceat(np.append(broken[mdp.next_state], False), mdp.row[:-1])
        harmless: Bools = enabled & (hits.reshape(enabled.shape) == 0)
        return harmless

    flat = enabled.reshape(-1)
    left = enabled.sum(axis=1, dtype=np.int32)
    safe = ~broken & (mdp.terminal | (left > 0))
    into, slot = reverse(mdp.row, mdp.next_state)
    gone = np.flatnonzero(~safe)
    while True:
        safe[gone] = False
        fresh = np.empty(mdp.n_states, np.int32)
        fresh[: gone.size] = gone
        _kernels.disable(into, slot, flat, left, mdp.terminal, safe, fresh, gone.size)
        goals = (mdp.terminal | mdp.marked) & safe
        gone = np.flatnonzero(safe & ~coreachable_to(*enabled_graph(mdp, enabled), goals))
        if not (nonblocking and gone.size):
            break
    enabled &= safe[:, None]
    return enabled


def enabled_graph(mdp: TabularMDP, enabled: Bools | None) -> tuple[np.ndarray, np.ndarray]:
    """Return the graph of states whose edges are the outcomes of enabled actions."""
    start = mdp.row[:: mdp.n_actions]
    if enabled is None:
        return start, mdp.next_state
    kept = np.repeat(enabled.reshape(-1), np.diff(mdp.row))
    return start, np.where(kept, mdp.next_state, np.int32(NONE))


def reachable_states(mdp: TabularMDP, enabled: Bools | None = None) -> Bools:
    """Return the states that enabled actions can lead to from the start, ``bool [S]``."""
    return reachable_from(*enabled_graph(mdp, enabled), mdp.initial > 0)


def find_dead_end(mdp: TabularMDP, enabled: Bools) -> tuple[str, ...] | None:
    """Return a shortest word of events to a state that is not terminal and has no enabled action.

    Words are shortest in epochs.  None where every reachable state can go on.
    """
    start, target = enabled_graph(mdp, enabled)
    order, via = search(start, target, mdp.initial > 0, np.ones(mdp.n_states, np.bool_))
    stuck = ~enabled.any(axis=1) & ~mdp.terminal
    found = order[stuck[order]]
    if not found.size:
        return None
    outcomes = path_to(int(found[0]), via, start)
    return tuple(name for o in outcomes for name in mdp.spell(int(mdp.word[o])))


def check_mask(mdp: TabularMDP, enabled: Bools) -> None:
    """Raise an `MDPError` if ``enabled`` cannot be a supervisor of ``mdp``.

    It has to be ``bool [S, A]``, to enable feasible actions only, and to leave every state that it can lead
    to an action.
    """
    shape = (mdp.n_states, mdp.n_actions)
    if enabled.shape != shape or enabled.dtype != np.bool_:
        message = f"the mask has shape {enabled.shape} and type {enabled.dtype}; bool {shape} is needed"
        raise MDPError(message)
    extra = np.argwhere(enabled & ~mdp.feasible)
    if extra.size:
        s, a = extra[0]
        message = (
            f"the mask enables {mdp.actions[a]!r} in state {s}, where it is not feasible; "
            "enable feasible actions only"
        )
        raise MDPError(message)
    word = find_dead_end(mdp, enabled)
    if word is not None:
        after = f"after {' '.join(word)}" if word else "at the start"
        message = (
            f"the mask leaves no action {after}; enable one there, or use safe_actions, which looks ahead"
        )
        raise MDPError(message)
