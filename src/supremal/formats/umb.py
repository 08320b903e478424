"""Models in the unified Markov binary format, ``.umb``: arrays in a tar archive, with an index in JSON.

It holds a process whole.  Branches are the outcomes, their actions the words; ``rewards/reward`` has the
expected reward of each choice, which Storm and PRISM compute with.  Two groups of annotations of our own
have what is left, where something is: ``outcomes/reward`` the reward of each branch, and ``origin/part-k``
the parts that states are made of.  Programs pass over groups that they do not know.

Read are MDPs and Markov chains in doubles, with at most one reward; archives may be compressed by gzip or xz.

Source: the UMB specification, version 1 (January 2026), github.com/pmc-tools/umb.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from tarfile import USTAR_FORMAT, TarInfo
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from supremal._arrays import Bools, Ints
from supremal.formats._explicit import INIT, REWARD, Explicit

VERSION: Final = 1
OUTCOMES: Final = "outcomes"
ORIGIN: Final = "origin"

_BLOCK: Final = 512
_DOUBLE: Final = {"type": "double", "size": 64}
_BOOL: Final = {"type": "bool", "size": 1}
_INT: Final = {"type": "int", "size": 64}


def write(model: Explicit) -> dict[str, Iterator[bytes]]:
    """Return the bytes of the archive, in pieces; it takes about 24 of them a branch and 36 a choice."""
    return {".umb": _archive(model)}


def _archive(model: Explicit) -> Iterator[bytes]:
    index = json.dumps(_index(model), ensure_ascii=False, indent=2).encode()
    for name, content in [("index.json", index), *_files(model)]:
        info = TarInfo(name)
        info.size = len(content)
        yield info.tobuf(USTAR_FORMAT)
        yield content
        yield bytes(-len(content) % _BLOCK)
    yield bytes(2 * _BLOCK)


def _index(model: Explicit) -> Mapping[str, Any]:
    aps = [name for name in model.labels if name != INIT]
    annotations: dict[str, dict[str, Any]] = {
        "rewards": {REWARD: _annotation(REWARD, "choices", _DOUBLE)},
        "aps": {f"label-{i}": _annotation(name, "states", _BOOL) for i, name in enumerate(aps)},
    }
    if _differ(model):
        annotations[OUTCOMES] = {REWARD: _annotation(REWARD, "branches", _DOUBLE)}
    if _parts(model):
        annotations[ORIGIN] = {
            f"part-{k}": _annotation(f"part {k}", "states", _INT) for k in range(len(_parts(model)))
        }
    return {
        "format-version": VERSION,
        "format-revision": 0,
        "file-data": {"tool": "supremal"},
        "transition-system": {
            "time": "discrete",
            "#players": 0 if model.chain else 1,
            "#states": model.n_states,
            "#initial-states": int(model.labels[INIT].sum()),
            "#choices": len(model.action),
            "#choice-actions": 0 if model.chain else len(model.actions),
            "#branches": len(model.target),
            "#branch-actions": len(model.words),
            "#observations": 0,
            "branch-probability-type": _DOUBLE,
        },
        "annotations": annotations,
    }


def _differ(model: Explicit) -> bool:
    """Tell whether a choice has branches with different rewards."""
    return not np.array_equal(model.reward, model.gain[model.choice_of])


def _parts(model: Explicit) -> list[Ints]:
    """Return the parts that states are made of, none where each is its own."""
    origin = model.origin
    return [] if origin is None or origin.shape[1] < 2 else list(origin.T)


def _annotation(alias: str, entity: str, kind: Mapping[str, Any]) -> Mapping[str, Any]:
    return {"alias": alias, "applies-to": [entity], "type": kind}


def _files(model: Explicit) -> Iterator[tuple[str, bytes]]:
    yield "state-is-initial.bin", _bits(model.labels[INIT])
    yield "state-to-choices.bin", _numbers(model.choice, "<u8")
    yield "choice-to-branches.bin", _numbers(model.branch, "<u8")
    yield "branch-to-target.bin", _numbers(model.target, "<u8")
    yield "branch-to-probability.bin", _numbers(model.prob, "<f8")
    if not model.chain:
        yield from _strings("actions/choices", model.action, model.actions)
    yield from _strings("actions/branches", model.word, tuple(map(" ".join, model.words)))
    yield f"annotations/rewards/{REWARD}/choices/values.bin", _numbers(model.gain, "<f8")
    aps = [held for name, held in model.labels.items() if name != INIT]
    for i, held in enumerate(aps):
        yield f"annotations/aps/label-{i}/states/values.bin", _bits(held)
    if _differ(model):
        yield f"annotations/{OUTCOMES}/{REWARD}/branches/values.bin", _numbers(model.reward, "<f8")
    for k, part in enumerate(_parts(model)):
        yield f"annotations/{ORIGIN}/part-{k}/states/values.bin", _numbers(part, "<i8")


def _strings(folder: str, values: NDArray[Any], names: tuple[str, ...]) -> Iterator[tuple[str, bytes]]:
    texts = [name.encode() for name in names]
    yield f"{folder}/values.bin", _numbers(values, "<u4")
    yield f"{folder}/string-mapping.bin", _numbers(np.cumsum([0, *map(len, texts)]), "<u8")
    yield f"{folder}/strings.bin", b"".join(texts)


def _numbers(values: ArrayLike, kind: DTypeLike) -> bytes:
    return np.asarray(values).astype(kind).tobytes()


def _bits(held: Bools) -> bytes:
    """Return a bit a state, in whole words of 64."""
    packed = np.packbits(held, bitorder="little").tobytes()
    return packed + bytes(-len(packed) % 8)
