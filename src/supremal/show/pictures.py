"""Pictures as files: SVG that stands alone, PNG, and DOT for Graphviz."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from secrets import token_hex
from typing import Any, Final

from supremal.automata.automaton import Automaton
from supremal.decisions.reward_machine import RewardMachine
from supremal.errors import FormatError
from supremal.formats import Model, dot
from supremal.show._scene import Scene, svg_of
from supremal.show.diagram import automaton_scene, machine_scene
from supremal.show.supervised import supervisor_scene
from supremal.synthesis.supervisor import Supervisor

ENDINGS: Final = (".svg", ".png", ".dot")
"""The endings of the files that `save_picture` writes."""


def save_picture(
    path: str | PathLike[str],
    model: Automaton | Supervisor | RewardMachine,
    **options: Any,  # noqa: ANN401 - those of the model's own function
) -> Path:
    r"""Write a picture of ``model`` to a ``.svg``, ``.png`` or ``.dot`` file; one that is there is replaced.

    Parameters
    ----------
    path
        Where to.  A picture stands on white, in colours of its own, whatever shows it; DOT is the whole model
        for Graphviz to draw.
    model
        What to draw.
    options
        Those of `automaton_svg`, `supervisor_svg` or `reward_machine_svg`; a ``legend`` is drawn if nothing
        else is said.  DOT takes none of them.

    Raises
    ------
    FormatError
        If the path has another ending.
    MissingDependencyError
        For a PNG, if matplotlib is not installed.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from supremal import from_text
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_picture(f"{folder}/lamp.svg", from_text("dark -on-> lit \n lit -off-> dark")).name
    'lamp.svg'
    """
    target = Path(path)
    ending = target.suffix.lower()
    if ending not in ENDINGS:
        message = f"pictures end in {', '.join(ENDINGS)}, not in {ending!r}"
        raise FormatError(message, path=str(path))
    if ending == ".dot":
        raw = dot_of(model).encode(errors="replace")
    elif ending == ".svg":
        raw = (svg_of(scene_of(model, **{"legend": True} | options), alone=True) + "\n").encode()
    else:
        from supremal.show._raster import png_of

        raw = png_of(scene_of(model, **{"legend": True} | options))
    work = target.with_name(f".{target.name}.{token_hex(4)}")
    try:
        work.write_bytes(raw)
        work.replace(target)
    finally:
        work.unlink(missing_ok=True)
    return target


def dot_of(model: Automaton | Supervisor | RewardMachine) -> str:
    """Return a model in Graphviz's language; of a supervisor the supervised behaviour."""
    if isinstance(model, RewardMachine):
        return dot.write_machine(model)
    automaton = model.automaton if isinstance(model, Supervisor) else model
    return dot.write(Model((automaton,), ()))


def scene_of(model: Automaton | Supervisor | RewardMachine, **options: Any) -> Scene:  # noqa: ANN401
    """Return the picture of a model as marks."""
    match model:
        case Supervisor():
            return supervisor_scene(model, **options)
        case RewardMachine():
            return machine_scene(model, **options)
        case _:
            return automaton_scene(model, **options)
