"""A game: somebody chooses what happens next, within what the supervisor of a task allows.

A game is a sequence of moves, each the number of an option that there was; what it leads to is found by
playing it again from the start.  So a game has no state of its own, and taking a move back is leaving it out.

Where there is a process, a move is an enabled action; where its outcome is not certain, the next move is one
of its outcomes, so that whoever plays decides what nobody controls, too.  Where there are only plants, a move
is an event: an enabled one, or one that nobody controls and that can happen.

Source: Ramadge, Wonham, "Supervisory control of a class of discrete event processes", SIAM J. Control Optim.
25 (1987): a supervisor does not choose, it only says what may be chosen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from supremal._arrays import NONE
from supremal.errors import ModelError
from supremal.show.play import Moment, Option, tell_apart
from supremal.show.playback import Playback, Step
from supremal.task.findings import Findings
from supremal.task.stage import (
    PlantStage,
    ProcessStage,
    follow,
    followers_of,
    parts_of,
    plant_stage,
    process_stage,
)
from supremal.task.task import Task


@dataclass(frozen=True, slots=True)
class Position:
    """Where a game stands, and what led there.

    Parameters
    ----------
    state
        That of the product, or of the supervisor.
    at
        The state of each rule as it is drawn.
    asked
        The number of the action whose outcome is to be chosen; `NONE`: the next event is.
    action, word, reward
        What was chosen, what happened (None at the start), and what it earned; see `Step`.
    """

    state: int
    at: tuple[int, ...]
    asked: int = NONE
    action: str = ""
    word: tuple[str, ...] | None = None
    reward: float | None = None


class _Ground(Protocol):
    """What a game is played on: which moves there are, where they lead, and what there is to see."""

    def moves(self, here: Position) -> list[int]:
        """Return what can be chosen: actions, outcomes or events, by their numbers in the model."""

    def after(self, here: Position, chosen: int) -> Position:
        """Return where a choice leads."""

    def show(self, here: Position) -> Step:
        """Return what there is to see."""

    def options(self, here: Position) -> tuple[Option, ...]:
        """Return the moves as somebody reads them."""


@dataclass(frozen=True, slots=True, eq=False)
class Game:
    """What is played, and from where.

    Parameters
    ----------
    ground
        The moves, and where they lead.
    start
        Where it begins.
    scene
        The parts that follow, the map and the names of what is told; nothing is played in it.
    rewarded
        Whether steps earn anything.
    seed
        That of chance.
    """

    ground: _Ground
    start: Position
    scene: Playback
    rewarded: bool
    seed: int = 0

    def moment(self, moves: Sequence[int] = ()) -> Moment:
        """Return the moment that ``moves`` lead to, in time linear in their number.

        Parameters
        ----------
        moves
            Each the number, from 0, of an option of the moment that those before it lead to.

        Raises
        ------
        ModelError
            If there is no such option.
        """
        here, history, score = self.start, list[tuple[str, ...]](), 0.0
        for k, move in enumerate(moves):
            choices = self.ground.moves(here)
            if not 0 <= move < len(choices):
                raise ModelError(self._wrong(k, move, here))
            here = self.ground.after(here, choices[move])
            if here.asked == NONE and here.word is not None:
                history.append(here.word)
                score += here.reward or 0.0
        step, options = self.ground.show(here), self.ground.options(here)
        return Moment(
            step,
            options,
            asked=step.chosen,
            chance=self._drawn(moves, options),
            history=tuple(history),
            score=score if self.rewarded else None,
        )

    def _wrong(self, k: int, move: int, here: Position) -> str:
        known = [f"{n} ({option})" for n, option in enumerate(self.ground.options(here))]
        right = f"choose one of {', '.join(known)}" if known else "the game is over before it, leave it out"
        return f"move {k + 1} is {move}, and there is no such option; {right}"

    def _drawn(self, moves: Sequence[int], options: tuple[Option, ...]) -> int:
        """Return the option that chance takes: by its probability, with equal chances where none has one."""
        if not options:
            return NONE
        rng = np.random.default_rng([self.seed, len(moves), *moves])
        weight = np.array([1.0 if o.probability is None else o.probability for o in options])
        return int(rng.choice(len(options), p=weight / weight.sum()))


def game_of(task: Task, findings: Findings, *, seed: int = 0) -> Game | None:
    r"""Return the game of a task under its supervisor, None where the rules cannot be kept.

    Parameters
    ----------
    task
        What there is to do.
    findings
        What `study` found of it.
    seed
        That of the start, where there are several, and of chance.

    Raises
    ------
    MDPError
        If the task has a process, and the rules can only be kept by resting.

    Notes
    -----
    Where there is a process: one more product, and one more synthesis for the reasons.

    Examples
    --------
    >>> from supremal import from_text
    >>> from supremal.rules.rule import Rule
    >>> from supremal.task.findings import study
    >>> lamp = from_text("name lamp \n uncontrollable fuse \n dark -on-> lit \n lit -off, fuse-> dark")
    >>> once = from_text("name once \n uncontrollable fuse \n new -fuse-> burnt")
    >>> task = Task("lamp", lamp.alphabet, (lamp,), rules=(Rule("once", once),))
    >>> game = game_of(task, study(task.plants, (once,), task.options))
    >>> [str(option) for option in game.moment([0]).options]
    ['off', 'fuse']
    >>> game.moment([0, 1]).step.cannot
    (('on', 'fuse can follow, which nobody controls and breaks once'),)
    """
    if findings.verdict == "not_enforceable":
        return None
    ground: _Ground
    stage: PlantStage | ProcessStage
    if task.environment is None:
        start, stage = 0, plant_stage(task, findings)
        ground = _Plants(stage)
    else:
        stage = process_stage(task, task.environment, findings)
        ground, initial = _Process(stage), stage.model.initial
        start = int(np.random.default_rng(seed).choice(len(initial), p=initial / initial.sum()))
    scene = Playback(parts_of(task), (), stage.free, stage.view.board, stage.facts)
    here = Position(start, (0,) * len(task.rules))
    return Game(ground, here, scene, rewarded=task.environment is not None, seed=seed)


@dataclass(frozen=True, slots=True, eq=False)
class _Plants:
    """Plants under their supervisor: a move is an event."""

    stage: PlantStage

    def moves(self, here: Position) -> list[int]:
        """Return the events that can happen, those that nobody controls last."""
        alphabet = self.stage.automaton.alphabet
        events = self.stage.possible(here.state)
        return [alphabet.index(e) for e in sorted(events, key=alphabet.uncontrollable.__contains__)]

    def after(self, here: Position, chosen: int) -> Position:
        """Return where an event leads."""
        automaton = self.stage.automaton
        (event,) = word = automaton.alphabet.spell([chosen])
        at = follow(followers_of(self.stage.task), here.at, word)
        action = "" if event in automaton.alphabet.uncontrollable else event
        return Position(int(automaton.delta[here.state, chosen]), at, action=action, word=word)

    def show(self, here: Position) -> Step:
        """Return what there is to see."""
        return replace(self.stage.step(here.state, here.at), action=here.action, word=here.word)

    def options(self, here: Position) -> tuple[Option, ...]:
        """Return the events."""
        alphabet = self.stage.automaton.alphabet
        return tuple(Option(alphabet.spell([event])) for event in self.moves(here))


@dataclass(frozen=True, slots=True, eq=False)
class _Process:
    """A process under its mask: a move is an action, or which of its outcomes comes."""

    stage: ProcessStage

    def moves(self, here: Position) -> list[int]:
        """Return the enabled actions, or the outcomes of the one that was chosen."""
        model, state = self.stage.model, here.state
        if here.asked != NONE:
            outcomes = model.outcomes(state, here.asked)
            return list(range(outcomes.start, outcomes.stop))
        enabled = self.stage.enabled[state] & ~model.terminal[state]
        return [int(action) for action in np.flatnonzero(enabled)]

    def after(self, here: Position, chosen: int) -> Position:
        """Return where an action leads, or to the question which outcome it has."""
        model = self.stage.model
        action = chosen if here.asked == NONE else here.asked
        outcome = chosen
        if here.asked == NONE:
            outcomes = model.outcomes(here.state, action)
            if outcomes.stop - outcomes.start > 1:
                return replace(here, asked=action)
            outcome = outcomes.start
        word = model.spell(int(model.word[outcome]))
        return Position(
            int(model.next_state[outcome]),
            follow(followers_of(self.stage.task), here.at, word),
            action=model.actions[action],
            word=word,
            reward=float(model.reward[outcome]),
        )

    def show(self, here: Position) -> Step:
        """Return what there is to see; while an outcome is asked for, nothing else can be chosen."""
        step = self.stage.step(here.state, here.at)
        if here.asked != NONE:
            step = replace(step, can=(), may=(), cannot=(), chosen=self.stage.model.actions[here.asked])
        return replace(step, action=here.action, word=here.word, reward=here.reward)

    def options(self, here: Position) -> tuple[Option, ...]:
        """Return the actions, or the outcomes with what tells apart those that have the same word."""
        model, moves = self.stage.model, self.moves(here)
        if here.asked == NONE:
            return tuple(Option((model.actions[action],)) for action in moves)
        words = [model.spell(int(model.word[o])) for o in moves]
        tells = dict.fromkeys(moves, "")
        for word in set(words):
            alike = [o for o, other in zip(moves, words, strict=True) if other == word]
            if len(alike) > 1:
                tells |= zip(alike, self._tell_apart(here, alike), strict=True)
        return tuple(
            Option(word, float(model.prob[o]), tells[o]) for o, word in zip(moves, words, strict=True)
        )

    def _tell_apart(self, here: Position, outcomes: list[int]) -> list[str]:
        """Return how outcomes with the same word differ: in what one sees of them."""
        stage = self.stage
        looks = [stage.look(int(stage.model.next_state[o])) for o in outcomes]
        tokens = [token.name for token in stage.view.board.tokens] if stage.view.board else []
        return tell_apart(stage.look(here.state), looks, facts=stage.facts, tokens=tokens)
