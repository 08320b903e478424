"""Counterfactual experience: one step teaches every state that it could have been taken from.

In a product the environment's state s, an action and what the environment answers (the word, and s') do not
depend on where the rules and the reward machine are.  So one step of the environment says what would have
happened in every product state (s, q₁, …, qₙ, u) in which that action is enabled: its successor there follows
from the word and the labels of s'.  An outcome of the product belongs to an outcome of the environment by the
environment's state, the action, and its place among the action's outcomes, of which `product` keeps the
order.  All outcomes that belong to the same one are a *lesson*: where one occurs, all of them are taught.

Each choice still sees its outcomes with their own probabilities, so that what an off-policy learner converges
to remains the same.

Source: Toro Icarte, Klassen, Valenzano, McIlraith, "Reward machines: exploiting reward function structure in
reinforcement learning", JAIR 73 (2022), section 4.2 (CRM), with rules in the place of the machine.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from supremal._arrays import NONE, Ints, Longs
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.planning import Choices
from supremal.errors import MDPError


@dataclass(frozen=True, slots=True, eq=False)
class Lessons:
    """The O outcomes of a process in G groups.

    Parameters
    ----------
    group
        ``int64 [O]``: the group of each outcome.
    bound
        ``int64 [G + 1]``: group g has the outcomes ``member[bound[g] : bound[g + 1]]``.
    member
        ``int64 [O]``: outcomes, in ascending order within a group.
    owner
        ``int32 [O]``: the choice that each outcome is one of.
    """

    group: Longs
    bound: Longs
    member: Longs
    owner: Ints

    def __post_init__(self) -> None:
        for field in fields(self):
            getattr(self, field.name).flags.writeable = False


def no_lessons() -> Lessons:
    """Return no group at all, for a learner that learns from what it does only."""
    none = np.zeros(0, np.int64)
    return Lessons(none, none, none, np.zeros(0, np.int32))


def lessons_of(mdp: TabularMDP, choices: Choices, environment: TabularMDP | None) -> Lessons:
    """Return which outcomes of ``choices`` teach each other.

    Parameters
    ----------
    mdp
        A `product`.
    choices
        Its choices under a mask.
    environment
        What it is a product of; left out: a process of one column of ``origin``.

    Raises
    ------
    MDPError
        If the columns of ``origin`` that the environment has do not say what an action leads to.

    Notes
    -----
    Sorts the outcomes once: O log O.
    """
    columns = 1 if environment is None else environment.origin.shape[1]
    origin = mdp.origin[:, :columns]
    state = np.unique(origin, axis=0, return_inverse=True)[1].reshape(-1)
    taken = state[choices.state].astype(np.int64) * mdp.n_actions + choices.action
    count = np.diff(choices.outcome)
    owner = np.repeat(np.arange(count.size, dtype=np.int32), count)
    place = np.arange(owner.size) - choices.outcome[owner]
    member = np.lexsort((place, taken[owner]))  # stable: outcomes ascend within a group
    key = np.stack([taken[owner], place])[:, member]
    begins = np.append(True, (np.diff(key) != 0).any(axis=0))[: member.size]
    group = np.empty(member.size, np.int64)
    group[member] = np.cumsum(begins) - 1
    lessons = Lessons(group, np.append(np.flatnonzero(begins), member.size), member, owner)
    _check(mdp, choices, lessons, count, np.where((origin == NONE).any(axis=1), NONE, state))
    return lessons


def _check(mdp: TabularMDP, choices: Choices, lessons: Lessons, count: Ints, state: Longs) -> None:
    """Raise an `MDPError` if outcomes of a group differ; a sink does not say which state it stands for."""
    first = lessons.member[lessons.bound[:-1]][lessons.group]  # of each outcome's group
    to = state[choices.target]
    differs = (
        (count[lessons.owner] != count[lessons.owner[first]])
        | (choices.prob != choices.prob[first])
        | (choices.word != choices.word[first])
        | ((to != to[first]) & (to != NONE) & (to[first] != NONE))
    )
    if differs.any():
        o = int(np.flatnonzero(differs)[0])
        here, there = lessons.owner[o], lessons.owner[first[o]]
        message = (
            f"action {mdp.actions[choices.action[here]]!r} has other outcomes in state {choices.state[here]} "
            f"than in state {choices.state[there]}, though the environment's part of both is the same: "
            f"{mdp.origin[choices.state[here]].tolist()} and {mdp.origin[choices.state[there]].tolist()}; "
            "give the environment that this process is a product of"
        )
        raise MDPError(message)
