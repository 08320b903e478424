"""A game in the terminal: what there is to see, and the options by their numbers."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import click

from supremal._arrays import NONE
from supremal.show.board_text import board_text

if TYPE_CHECKING:
    from supremal.show.play import Moment
    from supremal.show.playback import Part, Playback, Step
    from supremal.task.game import Game

_KEYS: Final = "u undo, r start again, q quit"


def ask(game: Game) -> None:
    """Play until somebody quits: by ``q``, by the end of the input or by Ctrl-C."""
    moves: list[int] = []
    seen: list[int] | None = None
    while True:
        moment = game.moment(moves)
        if moves != seen:
            _show(moment, game.scene)
            seen = list(moves)
        answer = _answer(moment)
        if answer == "q":
            click.echo(_farewell(moment))
            return
        moves = _moved(answer, moves, moment)


def _answer(moment: Moment) -> str:
    """Return what somebody types; at the end of the input, and after Ctrl-C, that is ``q``."""
    try:
        answer = input(f"\n{_numbers(moment)}{_KEYS} > ").strip().lower()
    except (EOFError, KeyboardInterrupt):
        click.echo()
        return "q"
    if not sys.stdin.isatty():
        click.echo(answer)  # which nobody has typed there to be seen
    return answer


def _numbers(moment: Moment) -> str:
    """Say what can be chosen."""
    count = len(moment.options)
    return "" if not count else f"{'1' if count == 1 else f'1 to {count}'}, c let chance decide, "


def _moved(answer: str, moves: list[int], moment: Moment) -> list[int]:
    """Return the moves after an answer; one that is none says what would be right."""
    if answer == "r":
        return []
    if answer == "u" and moves:
        return moves[:-1]
    if answer == "c" and moment.chance != NONE:
        click.echo(f"Chance takes {moment.options[moment.chance]}.")
        return [*moves, moment.chance]
    if answer.isdecimal() and 1 <= int(answer) <= len(moment.options):
        return [*moves, int(answer) - 1]
    if answer == "u":
        click.echo("There is nothing to undo.")
        return moves
    click.echo(f"{answer!r} is none of the choices: {_numbers(moment)}{_KEYS}.")
    return moves


def _farewell(moment: Moment) -> str:
    steps = len(moment.history)
    score = "" if moment.score is None else f", score {moment.score:.6g}"
    return f"{steps} step{'' if steps == 1 else 's'} played{score}."


# --- what there is to see ---------------------------------------------------------------------------------


def _show(moment: Moment, scene: Playback) -> None:
    step, look = moment.step, moment.step.look
    if not moment.asked:
        click.secho(f"\n{_came(step, moment.score)}", bold=True)
        if scene.board is not None:
            click.echo(_indented(board_text(scene.board, look.tokens)))
        if look.text:
            click.echo(_indented(look.text.rstrip("\n")))
        told = [f"{name} {fact}" for name, fact in zip(scene.facts, look.facts, strict=True)]
        told += [_where(part, state) for part, state in zip(scene.parts, step.at, strict=True)]
        if told:
            click.echo(_indented("\n".join(told)))
    _offer(moment)


def _came(step: Step, score: float | None) -> str:
    """Say what led here."""
    if step.word is None:
        return "The start."
    word = " ".join(step.word) or "nothing"
    chosen = f"{step.action} was chosen, " if step.action and step.word != (step.action,) else ""
    earned = "" if step.reward is None else f" Reward {step.reward:.6g}, so far {score:.6g}."
    return f"{chosen}{word} happened.{earned}"


def _where(part: Part, state: int) -> str:
    here = "no state: it is broken" if state == NONE else part.states[state] if part.states else state
    return f"{part.name} in {here}" if part.kind == "rule" else f"rewards: {here}"


def _offer(moment: Moment) -> None:
    """Print the options by their numbers, and what is disabled with its reasons."""
    step, first = moment.step, len(moment.step.can)
    if moment.asked:
        _numbered(f"{moment.asked} is chosen. What happens?", moment, range(len(moment.options)))
        return
    _numbered("Enabled", moment, range(first))
    if len(moment.options) > first:
        _numbered("Can happen, nobody controls it", moment, range(first, len(moment.options)))
    elif step.may:
        _titled("Can happen, nobody controls it", [", ".join(step.may)])
    _titled("Disabled", [f"{name}: {reason}" for name, reason in step.cannot])
    if not moment.options:
        end = "Nothing more may happen." if step.cannot else "The game is over: nothing more can happen."
        click.echo(f"  {end}")


def _numbered(title: str, moment: Moment, options: Sequence[int]) -> None:
    _titled(title, [f"{k + 1:2}  {moment.options[k]}" for k in options])


def _titled(title: str, lines: list[str]) -> None:
    if lines:
        click.echo(f"  {title}")
        click.echo(_indented("\n".join(lines), "    "))


def _indented(text: str, by: str = "  ") -> str:
    return "\n".join(by + line for line in text.split("\n"))
