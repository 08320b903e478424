"""How notebooks show values: methods that `supremal.show` writes, given to classes that know nothing of it.

Jupyter and its relatives ask a value for ``_repr_html_`` and ``_repr_svg_``.  The nouns of the lower rooms
draw nothing, so the methods come from above; what they need is imported when a notebook asks.
"""

from __future__ import annotations

from typing import Any, Final

from supremal.automata.automaton import Automaton
from supremal.decisions.evaluation import Evaluation
from supremal.decisions.horizon import HorizonPlan
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.optimum import Optimum
from supremal.decisions.planning import Plan
from supremal.decisions.reward_machine import RewardMachine
from supremal.learning.q_learning import QResult
from supremal.learning.tables import TableResult
from supremal.rules.rule import Rule
from supremal.synthesis.explain import Disabled
from supremal.synthesis.given_up import GivenUp, Guilty
from supremal.synthesis.modular import Modular
from supremal.synthesis.observation import Confusion
from supremal.synthesis.reasons import Reason
from supremal.synthesis.supervisor import Monitor, Supervisor
from supremal.synthesis.verify import Violation

DRAWN: Final[tuple[Any, ...]] = (Automaton, Monitor, RewardMachine, Rule, Supervisor)
"""The classes that have a picture."""

TABLED: Final[tuple[Any, ...]] = (
    Confusion, Disabled, Evaluation, GivenUp, Guilty, HorizonPlan, Modular, Optimum, Plan, QResult, Reason,
    TableResult, TabularMDP, Violation,
)  # fmt: skip
"""The classes that have a table."""


def attach() -> None:
    """Give the classes their methods; this imports nothing that draws."""
    for kind in DRAWN:
        kind._repr_svg_ = _svg
    for kind in (*DRAWN, *TABLED):
        kind._repr_html_ = _html


def _svg(self: object) -> str:
    from supremal.show.notebook import svg_of

    return svg_of(self)


def _html(self: object) -> str:
    from supremal.show.notebook import html_of

    return html_of(self)
