"""Model files: one table says which format an ending stands for.

A format that has one automaton a file (``.ads``, ``.fsm``) keeps a model of several in a folder of the same
ending: its files, and those in ``plants``, are plants, those in ``specs`` are specifications, in the order of
their names.

What is written is written beside its place first, and moved there whole.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from importlib.resources.abc import Traversable
from os import PathLike
from pathlib import Path
from typing import Final, NamedTuple

from supremal.errors import FormatError, ModelError
from supremal.formats import desuma, documents, dot, hoa, libfaudes, supremica, tct, waters
from supremal.formats._names import part_names, unique
from supremal.formats.model import MAX_BYTES, Model, Source, opened, read_bytes


class Format(NamedTuple):
    """A format of model files.

    ``write`` gives one text, or one for each automaton where ``single`` says that a file has one; ``lacks``
    says what of a model the format cannot hold.
    """

    about: str
    read: Callable[[bytes, str], Model] | None
    write: Callable[[Model], str | list[str]]
    lacks: Callable[[Model], list[str]]
    single: bool = False


FORMATS: Final = {
    ".json": Format("supremal's own documents", documents.read, documents.write, documents.lacks),
    ".wmod": Format("modules of Supremica (Waters)", waters.read, waters.write, waters.lacks),
    ".xml": Format("the older automata of Supremica", supremica.read, supremica.write, supremica.lacks),
    ".gen": Format("generators of libFAUDES", libfaudes.read, libfaudes.write, libfaudes.lacks),
    ".ads": Format("automata of TCT", tct.read, tct.write, tct.lacks, single=True),
    ".fsm": Format("automata of DESUMA and UMDES", desuma.read, desuma.write, desuma.lacks, single=True),
    ".hoa": Format("the Hanoi omega-automata format, version 1", hoa.read, hoa.write, hoa.lacks),
    ".dot": Format("pictures for Graphviz, which are only written", None, dot.write, dot.lacks),
}
"""The formats, by the endings of their files."""

_GROUPS: Final = ("plants", "specs")
_PLAIN: Final = re.compile(r"[^0-9A-Za-z_.+-]+|^[.]+")
_DIGITS: Final = re.compile(r"([0-9]+)")
_MAX_STEM: Final = 100


def read_model(source: Source, *, form: str | None = None) -> Model:
    r"""Return the plants and specifications in a file, or in a folder of files with one automaton each.

    Parameters
    ----------
    source
        The file.  Its ending says what format it has.
    form
        The ending of another format that it has, like ``"wmod"``.

    Raises
    ------
    FormatError
        If the ending is not known, or the file does not parse; gives line and column where there are any.
    ModelError
        If what the file says makes no model; the message begins with the path.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from supremal import from_text
    >>> light = from_text("name light\ndark -on-> lit\nlit -off-> dark")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_model(Path(folder, "light.fsm"), Model((light,), ()))
    ...     read_model(Path(folder, "light.fsm")).plants
    (<Automaton 'light': 2 states, 2 transitions, 2 events>,)
    """
    path = str(source)
    ending = find_ending(path, form)
    read, file = FORMATS[ending].read, opened(source)
    if read is None:
        message = f"{ending} files are pictures: they are written, and not read"
        raise FormatError(message, path=path)
    if not file.is_dir():
        return _checked(read, read_bytes(source, MAX_BYTES), path)
    if not FORMATS[ending].single:
        message = f"this is a folder, but one {ending} file holds all automata of a model"
        raise FormatError(message, path=path)
    groups = []
    for group in _GROUPS:
        places = [file, file / group] if group == "plants" else [file / group]
        found = [inner for place in places if place.is_dir() for inner in _files(place, ending)]
        models = [_checked(read, read_bytes(inner, MAX_BYTES), str(inner)) for inner in found]
        groups.append(tuple(part for model in models for part in (*model.plants, *model.specs)))
    if not any(groups):
        message = f"the folder has no {ending} files, nor have plants and specs in it"
        raise FormatError(message, path=path)
    return Model(*groups)


def write_model(path: str | PathLike[str], model: Model, *, form: str | None = None) -> None:
    """Write ``model`` to a file, or to a folder where the format has one automaton a file and there are more.

    Parameters
    ----------
    path
        The file; one that is there is replaced.  Its ending says what format to write.
    model
        What to write.
    form
        The ending of another format to write.

    Raises
    ------
    FormatError
        If the ending is not known, the format cannot hold the model, or a folder is there that holds
        anything but what would be written to it.
    AlphabetError
        If an event is controllable (observable) in one automaton and not in another.
    OSError
        If the file cannot be written.
    """
    from secrets import token_hex

    target = Path(path)
    ending = find_ending(str(path), form)
    try:
        written = FORMATS[ending].write(model)
        texts = [written] if isinstance(written, str) else written
        raw = [text.encode() for text in texts]
    except FormatError as error:
        raise FormatError(str(error).removeprefix("<model>: "), path=str(path)) from None
    except UnicodeEncodeError:
        message = "a name holds half a character, which UTF-8 has not"
        raise FormatError(message, path=str(path)) from None
    work = target.with_name(f".{target.name}.{token_hex(4)}")
    one_file = isinstance(written, str) or (len(model.plants) == 1 and not model.specs)
    _check_place(target, ending, is_file=one_file)
    try:
        if one_file:
            work.write_bytes(raw[0])
        else:
            _write_folder(work, ending, model, raw)
        _move(work, target)
    finally:
        if work.is_dir():
            shutil.rmtree(work, ignore_errors=True)
        else:
            work.unlink(missing_ok=True)


def find_ending(path: str, form: str | None = None) -> str:
    """Return the key of `FORMATS` for the ending of ``path``, or for ``form`` in its place.

    Raises
    ------
    FormatError
        If there is none.

    Examples
    --------
    >>> find_ending("MACH1.ADS"), find_ending("factory", "wmod")
    ('.ads', '.wmod')
    """
    ending = Path(path).suffix.lower() if form is None else f".{form.lower().removeprefix('.')}"
    if ending in FORMATS:
        return ending
    what = f"{ending!r} is no ending of a model file" if ending else "the file has no ending"
    message = f"{what}; known: {', '.join(FORMATS)}"
    raise FormatError(message, path=path)


def find_losses(path: str, model: Model, form: str | None = None) -> str:
    """Say in a line what of ``model`` the format cannot hold; nothing where it holds it all."""
    ending = find_ending(path, form)
    lacking = FORMATS[ending].lacks(model)
    return f"{ending} cannot hold {', '.join(lacking)}" if lacking else ""


def _checked(read: Callable[[bytes, str], Model], raw: bytes, path: str) -> Model:
    try:
        return read(raw, path)
    except ModelError as error:
        if str(error).startswith(path):
            raise
        message = f"{path}: {error}"
        raise type(error)(message) from None


def _files(folder: Traversable, ending: str) -> list[Traversable]:
    """Return the files of ``folder`` with this ending, ordered as people count: a2 before a10."""
    found = [file for file in folder.iterdir() if file.is_file() and file.name.lower().endswith(ending)]
    return sorted(found, key=lambda file: [part.zfill(12) for part in _DIGITS.split(file.name.lower())])


def _write_folder(work: Path, ending: str, model: Model, raw: list[bytes]) -> None:
    for group, parts in zip(_GROUPS, model, strict=True):
        stems = [_PLAIN.sub("_", name)[:_MAX_STEM] for name in part_names(parts, group.removesuffix("s"))]
        tails = (name[len(stem) :] for name, stem in zip(unique(map(str.lower, stems)), stems, strict=True))
        (work / group).mkdir(parents=True)
        for stem, tail in zip(stems, tails, strict=True):
            (work / group / f"{stem}{tail}{ending}").write_bytes(raw.pop(0))


def _check_place(target: Path, ending: str, *, is_file: bool) -> None:
    """Check that nothing is lost where ``target`` is replaced: a folder may hold what is written, no more."""
    if not target.is_dir():
        return
    if is_file:
        message = "this is a folder, and one file is to be written; remove it first"
        raise FormatError(message, path=str(target))
    for inner in target.rglob("*"):
        is_group = inner.is_dir() and not inner.is_symlink() and inner.name in _GROUPS
        if not (is_group or (inner.is_file() and inner.name.lower().endswith(ending))):
            message = (
                f"the folder holds {inner.name!r}, which is no {ending} file; choose another, or remove it"
            )
            raise FormatError(message, path=str(target))


def _move(work: Path, target: Path) -> None:
    """Put ``work`` in the place of ``target``."""
    if not work.is_dir() or not (target.exists() or target.is_symlink()):
        work.replace(target)
        return
    aside = work.with_name(f"{work.name}.old")
    target.rename(aside)
    work.rename(target)
    if aside.is_dir() and not aside.is_symlink():
        shutil.rmtree(aside, ignore_errors=True)
    else:
        aside.unlink()
