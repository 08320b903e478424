"""What a notebook shows of a value: a picture of what can be drawn, a small table of what was found.

Everything is escaped, and of what is long the beginning is shown.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import singledispatch
from itertools import islice
from typing import Final

import numpy as np

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
from supremal.show._scale import number
from supremal.show._text import escape
from supremal.show.diagram import MAX_STATES, automaton_svg, reward_machine_svg
from supremal.show.supervised import supervisor_svg
from supremal.show.tables import facts_of, html_table
from supremal.synthesis.explain import Disabled
from supremal.synthesis.given_up import GivenUp, Guilty
from supremal.synthesis.modular import Modular
from supremal.synthesis.observation import Confusion
from supremal.synthesis.reasons import Reason
from supremal.synthesis.supervisor import Monitor, Supervisor
from supremal.synthesis.verify import Violation

_REASONS: Final = 5
_LAST: Final = 0.1  # the part of the episodes that "at the end" means


# --- pictures ---------------------------------------------------------------------------------------------


@singledispatch
def svg_of(model: object) -> str:
    """Return the picture of an automaton, a supervisor, a monitor, a reward machine or a rule, with a legend.

    Of an automaton with more than 60 states it is what lies around the initial state.

    Raises
    ------
    TypeError
        For anything else.
    """
    message = f"there is no picture of a {type(model).__name__}"
    raise TypeError(message)


@svg_of.register
def _(model: Automaton) -> str:
    return automaton_svg(model, legend=True, around=0 if model.n_states > MAX_STATES else None)


@svg_of.register
def _(model: Supervisor) -> str:
    large = model.automaton.n_states > MAX_STATES
    return supervisor_svg(model, legend=True, around=0 if large else None)


@svg_of.register
def _(model: Monitor) -> str:
    large = model.supervisor.automaton.n_states > MAX_STATES
    state = model.state if model.state >= 0 else None
    around = (state or 0) if large else None
    return supervisor_svg(model.supervisor, title="Monitor", current=state, legend=True, around=around)


@svg_of.register
def _(model: RewardMachine) -> str:
    return reward_machine_svg(model, legend=True)


@svg_of.register
def _(model: Rule) -> str:
    return svg_of(model.drawn or model.automaton)


# --- pictures and tables ----------------------------------------------------------------------------------


@singledispatch
def html_of(value: object) -> str:
    """Return what a notebook shows of a value, as HTML.

    Examples
    --------
    >>> from supremal import Violation
    >>> html_of(Violation(("start",), "<fault>", "busy", "1"))[:62]
    '<table><tbody><tr><td>after</td><td>start</td></tr><tr><td>eve'
    """
    return f"<pre>{escape(repr(value))}</pre>"


def _table(*rows: tuple[str, object]) -> str:
    return html_table((), rows)


def _word(events: Sequence[str]) -> str:
    return " ".join(events) or "ε"


def _drawn(model: Automaton | Supervisor | Monitor | RewardMachine | Rule, said: str) -> str:
    return f'<div style="overflow-x:auto">{svg_of(model)}</div><div>{escape(said)}</div>'


def _facts(model: Automaton | RewardMachine) -> str:
    return "; ".join(f"{key}: {value}" for key, value in facts_of(model).items())


@html_of.register(Automaton)
@html_of.register(RewardMachine)
def _(value: Automaton | RewardMachine) -> str:
    return _drawn(value, _facts(value))


@html_of.register
def _(value: Supervisor) -> str:
    return _drawn(value, _facts(value.automaton) if value.automaton.n_states else "nothing can be enforced")


@html_of.register
def _(value: Monitor) -> str:
    lost = f"lost at {value.lost_at}; " if value.lost_at else ""
    return _drawn(value, f"{lost}enabled: {', '.join(value.enabled) or 'nothing'}")


@html_of.register
def _(value: Rule) -> str:
    return _drawn(value, f"{value.name}: {value.sentence or value.text or value.form}")


@html_of.register(QResult)
@html_of.register(TableResult)
def _(value: QResult | TableResult) -> str:
    episodes = len(value.returns)
    last = slice(episodes - max(1, round(_LAST * episodes)), None)
    ends = [("–", "–")] if not episodes else []
    if episodes:
        ends = [(number(float(value.returns[last].mean())), f"{value.completed[last].mean():.2%}")]
    (score, completed), steps = ends[0], int(value.lengths.sum())
    return _table(
        ("episodes", f"{episodes:,}{'' if value.finished else ' (stopped)'}"),
        ("steps", f"{steps:,}"),
        ("rules broken while learning", f"{int(value.violations.sum()):,}"),
        ("average score, last tenth", score),
        ("tasks completed, last tenth", completed),
        ("states × actions", f"{value.q.shape[0]:,} × {value.q.shape[1]:,}"),
        ("seed", value.seed),
        ("final ε", f"{value.epsilon:.4g}"),
        ("seconds", f"{value.seconds:.2f}"),
    )


@html_of.register
def _(value: Plan) -> str:
    return _table(
        *_values(value.value), ("γ", value.gamma), ("no further from the exact than", f"{value.bound:.1e}")
    )


@html_of.register
def _(value: HorizonPlan) -> str:
    epochs = len(value.policy)
    return _table(
        ("epochs", f"{epochs:,}"),
        *_values(value.value[epochs]),
        ("no further from the exact than", f"{value.bound:.1e}"),
    )


@html_of.register
def _(value: Optimum) -> str:
    with np.errstate(invalid="ignore"):  # inf - inf, where both ends are infinite
        width = np.nan_to_num(value.upper - value.lower)
    return _table(
        *_values(value.value), ("between bounds that are apart by", f"{width.max(initial=0.0):.1e}")
    )


def _values(values: np.ndarray) -> list[tuple[str, object]]:
    if not len(values):
        return [("states", 0)]
    return [
        ("states", f"{len(values):,}"),
        ("value of state 0", number(float(values[0]))),
        ("smallest and largest", f"{number(float(values.min()))} and {number(float(values.max()))}"),
    ]


@html_of.register
def _(value: Evaluation) -> str:
    within = value.completion_within
    return _table(
        ("value", f"{value.value:.9g} ± {value.bound:.1e}"),
        ("expected return", f"{value.expected_return:.9g}"),
        ("expected steps", f"{value.expected_steps:.9g}"),
        (f"completes within {len(within) - 1:,} steps", f"{within[-1]:.4%}"),
        ("ever completes", f"{value.completion:.4%}"),
        ("ever breaks a rule", f"{value.violation:.4%}"),
    )


@html_of.register
def _(value: TabularMDP) -> str:
    return _table(
        ("states", f"{value.n_states:,}"),
        ("actions", f"{value.n_actions:,}: {', '.join(islice(value.actions, 12))}"),
        ("outcomes", f"{len(value.prob):,}"),
        ("terminal, marked", f"{int(value.terminal.sum()):,}, {int(value.marked.sum()):,}"),
        ("events", f"{len(value.alphabet):,}"),
        ("propositions", ", ".join(islice(value.propositions, 12)) or "none"),
    )


@html_of.register
def _(value: Modular) -> str:
    rows = [
        (k + 1, f"{one.automaton.n_states:,}", ", ".join(str(plant + 1) for plant in group) or "none")
        for k, (one, group) in enumerate(zip(value.supervisors, value.groups, strict=True))
    ]
    said = "no conflict" if value.conflict is None else f"in conflict after {_word(value.conflict)}"
    return html_table(("specification", "states of its supervisor", "plants it looks at"), rows, caption=said)


@html_of.register
def _(value: Disabled) -> str:
    rows = [(event, f"{off:,}", f"{on:,}") for event, (off, on) in value.counts().items()]
    why = [(_word(reason.word), reason.event, str(reason)) for reason in islice(value, _REASONS)]
    counted = html_table(("event", "states in which it is disabled", "enabled"), rows)
    return counted + (html_table(("after", "is disabled", "because"), why) if why else "")


@html_of.register
def _(value: Violation) -> str:
    return _table(
        ("after", _word(value.word)),
        ("event", f"{value.event}, which nobody controls"),
        ("state of the plant", value.plant_state),
        ("state of the specification, which forbids it", value.spec_state),
    )


@html_of.register
def _(value: Confusion) -> str:
    return _table(
        ("event", value.event), ("is allowed after", _word(value.word)), ("and not after", _word(value.other))
    )


@html_of.register
def _(value: Reason) -> str:
    return _table(("after", _word(value.word)), ("event", value.event or "–"), ("because", str(value)))


@html_of.register(GivenUp)
@html_of.register(Guilty)
def _(value: GivenUp | Guilty) -> str:
    return _table(("given up" if isinstance(value, GivenUp) else "guilty", str(value)))
