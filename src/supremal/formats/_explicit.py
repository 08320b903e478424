"""Decision processes as model checkers store them: states have choices, and choices have branches.

The two differ at the edges.  In a model checker every state has a choice, so that one where an episode ends,
or where nothing is left to choose, gets a choice that stays there at no reward; labels tell the two apart.
There is one state to start from, so that where several are possible a fresh one comes last, whose only choice
leads to them, at no reward, an epoch earlier.  And an action is a label of choices rather than a column.

A policy leaves one choice a state, the branches of which are those of the actions it takes: a Markov chain.

Source: Hensel et al., *The probabilistic model checker Storm*, STTT 24, 2022, section 4.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from supremal._arrays import NONE, Bools, Floats, Ints, Longs
from supremal.decisions.evaluation import policy_weights
from supremal.decisions.mdp import TabularMDP, restrict
from supremal.decisions.product import broken_states
from supremal.decisions.safety import check_mask, find_dead_end
from supremal.errors import MDPError
from supremal.formats._names import unique

INIT: Final = "init"
GOAL: Final = "goal"
TERMINAL: Final = "terminal"
DEADLOCK: Final = "deadlock"
BROKEN: Final = "broken"
RESERVED: Final = (INIT, GOAL, TERMINAL, DEADLOCK, BROKEN)
"""The labels with a meaning: where it starts, is marked, ends, is stuck, and has broken a rule."""

REWARD: Final = "reward"
"""What the reward is called, where a format has several."""

ROUNDED: Final = 1e-5
"""How far from 1 the sum of probabilities may be in a file, where numbers may have few digits."""

_STAY: Final = "stay"
_START: Final = "start"
_SUM_TOLERANCE: Final = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Explicit:
    """A model with S states, C choices and B branches.

    Parameters
    ----------
    chain
        Whether it is a Markov chain, with one choice a state and no actions.
    actions, words
        The names of actions; the words that occur, as names of events.  Without words each branch has its
        action as its word.
    choice, branch
        ``int64 [S + 1]`` and ``[C + 1]``: where the choices of states and the branches of choices begin.
    action
        ``int32 [C]``, which counts in ``actions``.
    target, prob, reward, word
        ``[B]``; ``word`` counts in ``words``.
    labels
        ``bool [S]`` by the name of each label.
    origin
        ``int32 [S, K]``, as that of a `TabularMDP`; none where it is not known.
    """

    chain: bool
    actions: tuple[str, ...]
    words: tuple[tuple[str, ...], ...]
    choice: Longs
    branch: Longs
    action: Ints
    target: Ints
    prob: Floats
    reward: Floats
    word: Ints
    labels: dict[str, Bools]
    origin: Ints | None

    @property
    def n_states(self) -> int:
        """The number of states, S."""
        return len(self.choice) - 1

    @property
    def state_of(self) -> Longs:
        """The state of each choice, ``int64 [C]``."""
        return np.repeat(np.arange(self.n_states), np.diff(self.choice))

    @property
    def choice_of(self) -> Longs:
        """The choice of each branch, ``int64 [B]``."""
        return np.repeat(np.arange(len(self.branch) - 1), np.diff(self.branch))

    @property
    def gain(self) -> Floats:
        """The expected reward of each choice, ``float64 [C]``."""
        return _means(self.branch[:-1], self.prob, self.reward)


def lay_out(mdp: TabularMDP, enabled: Bools | None, policy: Ints | Floats | None) -> Explicit:
    """Return ``mdp`` under a mask or a policy; states keep their numbers.

    Linear in the states times the actions and the outcomes.

    Raises
    ------
    MDPError
        If the mask is no supervisor of ``mdp``, or the policy leaves a state that it reaches without an
        enabled action.
    """
    if enabled is not None:
        check_mask(mdp, enabled)
    allowed = (mdp.feasible if enabled is None else enabled) & ~mdp.terminal[:, None]
    weights = allowed.astype(np.float64) if policy is None else _weights(mdp, policy, allowed)
    return _with_one_start(_choices(mdp, weights, chain=policy is not None), mdp)


def merged(model: Explicit) -> Explicit:
    """Return ``model`` with the branches of a choice ordered by their targets, those with the same made one.

    The reward of such a branch is the expected one of its parts; words are forgotten.
    """
    size = model.n_states
    key = model.choice_of * size + model.target
    order = np.argsort(key, kind="stable")
    key = key[order]
    start = np.flatnonzero(np.append(True, np.diff(key) > 0))
    prob, reward = model.prob[order], model.reward[order]
    return replace(
        model,
        words=(),
        branch=np.searchsorted(key[start], np.arange(len(model.branch)) * size),
        target=(key[start] % size).astype(np.int32),
        prob=np.add.reduceat(prob, start),
        reward=_means(start, prob, reward),
        word=np.zeros(0, np.int32),
    )


def _means(start: Longs, prob: Floats, reward: Floats) -> Floats:
    """Return the expected reward of each group of branches, to the last bit where all are the same."""
    low = np.minimum.reduceat(reward, start)
    same = low == np.maximum.reduceat(reward, start)
    means: Floats = np.where(same, low, np.add.reduceat(prob * reward, start) / np.add.reduceat(prob, start))
    return means


def _weights(mdp: TabularMDP, policy: Ints | Floats, allowed: Bools) -> Floats:
    """Return the probability of each allowed action, ``[S, A]``; none in states that have no policy."""
    given = policy_weights(mdp, policy)
    weights: Floats = np.where(allowed & (given > 0), given, 0.0)
    weights[~(np.abs(weights.sum(axis=1) - 1) <= _SUM_TOLERANCE)] = 0.0
    word = find_dead_end(mdp, weights > 0)
    if word is not None:
        after = f"after {' '.join(word)}" if word else "at the start"
        message = f"{after} the policy does not give enabled actions probabilities that sum to 1"
        raise MDPError(message)
    return weights


def _choices(mdp: TabularMDP, weights: Floats, *, chain: bool) -> Explicit:
    """Return the actions with a weight as choices, each state without one with a choice that stays there."""
    states, actions = weights.shape
    mask = weights > 0
    kept = restrict(mdp, mask)
    still: Bools = np.logical_not(mask.any(axis=1))
    staying = np.flatnonzero(still)
    ends = kept.row[np.arange(1, states + 1) * actions][staying]
    words, silent = mdp.words, len(mdp.words)
    if () in words:
        silent = words.index(())
    else:
        words = (*words, ())
    counts = np.hstack([np.diff(kept.row).reshape(states, actions), still[:, None]])
    prob = np.insert(kept.prob, ends, 1.0)
    filled = counts > 0
    choice = np.append(0, np.cumsum(filled.sum(axis=1)))
    branch = np.append(0, np.cumsum(counts[filled]))
    action = np.nonzero(filled)[1].astype(np.int32)
    if chain:
        prob = prob * np.repeat(np.hstack([weights, still[:, None]])[filled], counts[filled])
        choice, branch, action = np.arange(states + 1), branch[choice], np.zeros(states, np.int32)
    return Explicit(
        chain=chain,
        actions=("",) if chain else tuple(unique([*mdp.actions, _STAY])),
        words=tuple(mdp.alphabet.spell(word) for word in words),
        choice=choice,
        branch=branch,
        action=action,
        target=np.insert(kept.next_state, ends, staying),
        prob=prob,
        reward=np.insert(kept.reward, ends, 0.0),
        word=np.insert(kept.word, ends, silent),
        labels=_labels(mdp, still),
        origin=mdp.origin,
    )


def _labels(mdp: TabularMDP, still: Bools) -> dict[str, Bools]:
    """Return what is true in which state; a proposition with a name that is taken gets a number behind it."""
    own = [mdp.label >> i & 1 == 1 for i in range(len(mdp.propositions))]
    fixed = (mdp.initial > 0, mdp.marked, mdp.terminal, still & ~mdp.terminal, broken_states(mdp))
    return dict(zip(unique([*RESERVED, *mdp.propositions]), [*fixed, *own], strict=True))


def _with_one_start(model: Explicit, mdp: TabularMDP) -> Explicit:
    """Return ``model`` with a fresh state that starts it, where it has several."""
    starts = np.flatnonzero(mdp.initial > 0)
    if starts.size == 1:
        return model
    labels = {name: np.append(held, False) for name, held in model.labels.items()}
    labels[INIT] = np.arange(model.n_states + 1) == model.n_states
    actions = model.actions if model.chain else tuple(unique([*model.actions, _START]))
    columns = mdp.origin.shape[1]
    return replace(
        model,
        actions=actions,
        choice=np.append(model.choice, model.choice[-1] + 1),
        branch=np.append(model.branch, model.branch[-1] + starts.size),
        action=np.append(model.action, np.int32(len(actions) - 1)),
        target=np.append(model.target, starts.astype(np.int32)),
        prob=np.append(model.prob, mdp.initial[starts]),
        reward=np.append(model.reward, np.zeros(starts.size)),
        word=np.append(model.word, np.full(starts.size, model.words.index(()), np.int32)),
        labels=labels,
        origin=np.vstack([mdp.origin, np.full((1, columns), NONE - 1, np.int32)]),
    )
