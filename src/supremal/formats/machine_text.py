"""Reward machines as text, one edge a line.

::

    0                                           # the initial state
    [2]                                         # the terminal states
    (0,0,'!e&!n',ConstantRewardFunction(0))
    (0,1,'e&!n',ConstantRewardFunction(0))
    (1,1,'!g&!n',ConstantRewardFunction(0))
    (1,2,'g&!n',ConstantRewardFunction(1))

States are whole numbers.  An edge is (from, to, guard, reward); see `supremal.decisions.guards` for the
grammar of a guard, to which ``True`` and ``False`` are added.  White space, line ends and comments may stand
anywhere between the signs.

The program that such files were made for ends the episode in a terminal state, and also, with reward 0,
where no guard of a state is true.  Here the end of an episode is the environment's affair: a terminal state
is never left and earns 0, edges out of it are passed over, and where no guard is true the machine goes to
such a state, "-1".  Returns are the same.  That program takes a proposition for true where its name is a part
of the names that are; here names are whole.

Source: the software that goes with Toro Icarte, Klassen, Valenzano, McIlraith, "Reward machines: exploiting
reward function structure in reinforcement learning", JAIR 73, 2022.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from math import isfinite
from pathlib import PurePath
from typing import Final, NamedTuple, NoReturn

from supremal.decisions.guards import RESERVED, truth_table
from supremal.decisions.reward_machine import Edge, RewardMachine, check_size, none_of, reward_machine
from supremal.errors import FormatError, RuleError
from supremal.formats._page import Page, decode, shown
from supremal.formats.model import MAX_BYTES, Source, read_bytes

LOST: Final = "-1"
"""The state of a machine none of whose guards was true."""

_TOKEN: Final = re.compile(
    r"""(?P<skip> \s++ | \#[^\n]*+ )
      | (?P<number> [+-]?+ (?: [0-9]++ (?:\.[0-9]*+)?+ | \.[0-9]++ ) (?:[eE][+-]?+[0-9]++)?+ (?![\w.]) )
      | (?P<name> [^\W\d]\w*+ )
      | '(?P<single> [^'\n]*+ )' | "(?P<double> [^"\n]*+ )"
      | (?P<sign> [()\[\],] )""",
    re.VERBOSE,
)
_STATE: Final = re.compile(r"[0-9]{1,9}")
_NAME: Final = re.compile(r"\b[A-Za-z_]\w*")
_TRUTH: Final = re.compile(r"\b(True|False)\b")
_REWARD: Final = "ConstantRewardFunction"


def read_machine_text(source: Source, propositions: Sequence[str] | None = None) -> RewardMachine:
    r"""Return the reward machine in a text file; it is called as the file is, without the ending.

    Parameters
    ----------
    source
        The file.
    propositions
        The names that guards may use, in their order; left out: those that occur, sorted.

    Raises
    ------
    FormatError
        If the text is not laid out as above; gives line and column.
    RuleError
        If its edges make no machine (see `reward_machine`); the message begins with the path.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "mail.txt")
    ...     _ = path.write_text("0\n[1]\n(0, 0, '!m', ConstantRewardFunction(-1)) # looks for it\n"
    ...                         "(0, 1, 'm', ConstantRewardFunction(10))\n")
    ...     machine = read_machine_text(path)
    >>> machine, machine.step(0, {"m"})
    (<RewardMachine 'mail': 2 states, 3 edges>, (1, 10.0))
    """
    return read(read_bytes(source, MAX_BYTES), str(source), propositions)


def read(raw: bytes, path: str, propositions: Sequence[str] | None = None) -> RewardMachine:
    """Return the reward machine that a text of these bytes holds."""
    text = _Text(decode(raw, path))
    initial, terminal, rows = text.machine()
    if propositions is None:
        names = {name for row in rows for name in _NAME.findall(row.guard.text)}
        propositions = sorted(names.difference(RESERVED))
    name = PurePath(path).stem
    try:
        states = {state for row in rows for state in (row.source, row.target.text)}
        check_size(name, len(states), [row.guard.text for row in rows], propositions)
        guards = _guards(text.page, rows, propositions)
        for state in (initial, *(row.target for row in rows)):
            if state.text not in guards and state.text not in terminal:
                problem = f"state {state.text} has no edge and is not terminal"
                text.page.fail(f"{problem}; give it one, or list it in the second line", state.where)
        lost = {state: none_of(own, propositions) for state, own in guards.items()}
        edges = [
            *(Edge(row.source, row.guard.text, row.target.text, row.reward) for row in rows),
            *(Edge(state, rest, LOST, 0.0) for state, rest in lost.items() if rest is not None),
            *(Edge(state, "true", state, 0.0) for state in sorted(terminal)),
        ]
        return reward_machine(propositions, edges, initial=initial.text, name=name)
    except RuleError as error:
        message = f"{path}: {error}"
        raise RuleError(message) from None


def _guards(page: Page, rows: Sequence[_Row], propositions: Sequence[str]) -> dict[str, list[str]]:
    """Return the guards out of each state; where one goes wrong, say where that is in the file."""
    guards: dict[str, list[str]] = {}
    for row in rows:
        try:
            truth_table(row.guard.text, propositions)
        except FormatError as error:
            problem = str(error).removeprefix(f"{error.path}:{error.line}:{error.column}: ")
            page.fail(problem, row.guard.where + error.column)
        guards.setdefault(row.source, []).append(row.guard.text)
    return guards


class _Token(NamedTuple):
    kind: str
    text: str
    where: int


class _Row(NamedTuple):
    source: str
    target: _Token
    guard: _Token
    reward: float


class _Text:
    """The tokens of a page, from left to right, and what they are put together to."""

    def __init__(self, page: Page) -> None:
        self.page, self.here = page, 0
        self.next = self.scan()

    def scan(self) -> _Token:
        while self.here < len(self.page.text):
            found = _TOKEN.match(self.page.text, self.here)
            if found is None:
                letter = self.page.text[self.here]
                self.page.fail(f"{letter!r} is no sign here, or opens what is not closed", self.here)
            where, self.here = self.here, found.end()
            kind = str(found.lastgroup)
            if kind != "skip":
                return _Token("guard" if kind in {"single", "double"} else kind, found[kind], where)
        return _Token("end", "", self.here)

    def take(self, kind: str, wanted: str, text: str = "") -> _Token:
        token = self.next
        if token.kind != kind or (text and token.text != text):
            self.wrong(token, wanted)
        self.next = self.scan()
        return token

    def wrong(self, token: _Token, wanted: str) -> NoReturn:
        said = "the file ends" if token.kind == "end" else shown(token.text)
        self.page.fail(f"{said} where {wanted} is needed", token.where)

    def machine(self) -> tuple[_Token, set[str], list[_Row]]:
        initial = self.state("the initial state")
        terminal = {token.text for token in self.states()}
        return initial, terminal, [row for row in self.rows() if row.source not in terminal]

    def sign(self, sign: str) -> None:
        self.take("sign", f"'{sign}'", sign)

    def state(self, what: str = "a state") -> _Token:
        wanted = f"{what}, a whole number from 0 to 999999999,"
        token = self.take("number", wanted)
        if not _STATE.fullmatch(token.text):
            self.wrong(token, wanted)
        return token._replace(text=str(int(token.text)))

    def states(self) -> list[_Token]:
        self.take("sign", "the list of terminal states, like [2] or [],", "[")
        found: list[_Token] = []
        while self.next.text != "]" or self.next.kind != "sign":
            if found:
                self.sign(",")
            found.append(self.state())
        self.sign("]")
        return found

    def rows(self) -> list[_Row]:
        found = []
        while self.next.kind != "end":
            self.take("sign", f"an edge, like (0,1,'a&!b',{_REWARD}(1)),", "(")
            source = self.state().text
            self.sign(",")
            target = self.state()
            self.sign(",")
            guard = self.take("guard", "a guard in quotes")
            guard = guard._replace(text=_TRUTH.sub(lambda truth: truth[0].lower(), guard.text))
            self.sign(",")
            found.append(_Row(source, target, guard, self.reward()))
            self.sign(")")
        return found

    def reward(self) -> float:
        name = self.take("name", f"{_REWARD}(number)")
        if name.text != _REWARD:
            self.page.fail(
                f"reward function {shown(name.text)} cannot be read; {_REWARD}(number) can: others look into "
                "an environment, and a reward machine sees labels only",
                name.where,
            )
        self.sign("(")
        number = self.take("number", "a number")
        if not isfinite(float(number.text)):
            self.wrong(number, "a finite number")
        self.sign(")")
        return float(number.text)
