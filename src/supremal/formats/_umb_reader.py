"""Reading UMB: an index that is checked, and the arrays that it speaks of.

Nothing is unpacked to disk, and no array is made that the archive does not hold, but for the defaults of what
may be left out, which are bounded.
"""

from __future__ import annotations

import lzma
import tarfile
import zlib
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from supremal._arrays import Bools, Floats, Ints, Longs
from supremal.errors import FormatError
from supremal.formats import _json
from supremal.formats._explicit import INIT, REWARD, ROUNDED, Explicit
from supremal.formats.model import MAX_STATES, read_bytes, too_large
from supremal.formats.umb import ORIGIN, OUTCOMES, VERSION

MAX_BYTES: Final = 1 << 30
"""The largest archive that is read, compressed or not: 1 GiB."""

_MAX_INDEX: Final = 1 << 20
_MAX_FILES: Final = 10_000
_XZ_MEMORY: Final = 1 << 28
_COUNTS: Final = (
    "#states", "#choices", "#branches", "#choice-actions", "#branch-actions", "#players", "#observations"
)  # fmt: skip
_ACTIONS: Final = {"choices": "#choice-actions", "branches": "#branch-actions"}
_ENTITIES: Final = ("states", "choices", "branches")


def read(path: Path) -> Explicit:
    """Return the model in an archive."""
    try:
        return _Archive(path).explicit()
    except _json.WrongError as error:
        raise FormatError(str(error), path=str(path)) from None


class _Archive:
    """The files of an archive, and what its index says of them."""

    def __init__(self, path: Path) -> None:
        raw = read_bytes(path, MAX_BYTES)
        if len(raw) > MAX_BYTES:
            _json.fail(too_large(MAX_BYTES))
        self.files = _files(_uncompressed(raw))
        if "index.json" not in self.files:
            _json.fail("the archive has no file index.json")
        index = _json.parse(self.files["index.json"], f"{path}/index.json", _MAX_INDEX)
        if _entry(index, "format-version", int) > VERSION:
            _json.fail(f"format-version is {index['format-version']}; versions up to {VERSION} are read")
        system = _entry(index, "transition-system", dict)
        self.count = {name: _entry(system, name, int) for name in _COUNTS}
        self.annotations = _entry(index, "annotations", dict) if "annotations" in index else {}
        if min(self.count.values()) < 0 or not self.count["#states"]:
            _json.fail("the index has a number below 0, or no state")
        if system.get("time") != "discrete" or self.count["#players"] > 1 or self.count["#observations"]:
            _json.fail("the model has another time, players or observations; MDPs and Markov chains are read")
        _check_type(system.get("branch-probability-type"), "double", "branch-probability-type")

    def explicit(self) -> Explicit:
        """Return the model."""
        chain, choices, branches = not self.count["#players"], self.count["#choices"], self.count["#branches"]
        choice = self.intervals("state-to-choices.bin", self.count["#states"], choices)
        branch = self.intervals("choice-to-branches.bin", choices, branches)
        actions, action = self.strings("choices", choices)
        words, word = self.words(branches)
        target = self.array("branch-to-target.bin", branches, "<u8", below=self.count["#states"])
        prob = self.array("branch-to-probability.bin", branches, "<f8")
        if not ((prob > 0) & (prob <= 1 + ROUNDED)).all():
            _json.fail("branch-to-probability.bin has to hold numbers above 0, up to 1")
        return Explicit(
            chain=chain,
            actions=actions,
            words=words,
            choice=choice,
            branch=branch,
            action=action,
            target=target.astype(np.int32),
            prob=prob,
            reward=self.rewards(choice, branch),
            word=word,
            labels=self.labels(),
            origin=self.origin(),
        )

    def array(self, name: str, size: int, kind: str, *, below: int = 0) -> NDArray[Any]:
        """Return the numbers in a file, zeros where it is left out; ``below`` bounds them."""
        raw, width = self.files.get(name), np.dtype(kind).itemsize
        if raw is None:
            return np.zeros(_bounded(size, name), kind)
        if len(raw) != size * width:
            _json.fail(f"{name} has {len(raw):,} bytes; {size:,} numbers of {width} are needed")
        values = np.frombuffer(raw, kind)
        if below and size and values.max() >= below:
            _json.fail(f"{name} holds {values.max()}; numbers below {below} are needed")
        return values

    def intervals(self, name: str, size: int, last: int) -> Longs:
        """Return where intervals begin, each of one where the file is left out; none may be empty."""
        if name in self.files:
            starts = self.array(name, size + 1, "<u8").astype(np.int64)
        else:
            starts = np.arange(_bounded(size, name) + 1)
        if starts[0] != 0 or starts[-1] != last or not (np.diff(starts) > 0).all():
            _json.fail(f"{name} has to rise from 0 to {last:,}, with no interval empty")
        return starts

    def bits(self, name: str, size: int) -> Bools:
        """Return the truth values in a file, all false where it is left out."""
        raw = self.files.get(name)
        if raw is None:
            return np.zeros(_bounded(size, name), np.bool_)
        if len(raw) != -(-size // 64) * 8:
            _json.fail(f"{name} has {len(raw):,} bytes; {-(-size // 64) * 8:,} are needed")
        return np.unpackbits(np.frombuffer(raw, np.uint8), count=size, bitorder="little").astype(np.bool_)

    def strings(self, entity: str, size: int) -> tuple[tuple[str, ...], Ints]:
        """Return the names of actions, none where there are no names, and the action of each entity."""
        folder, count = f"actions/{entity}", self.count[_ACTIONS[entity]]
        if not count:
            return ("",), np.zeros(size, np.int32)
        values = self.array(f"{folder}/values.bin", size, "<u4", below=count).astype(np.int32)
        raw, at = self.files.get(f"{folder}/strings.bin"), f"{folder}/string-mapping.bin"
        if raw is None or at not in self.files:
            return tuple(f"a{k}" for k in range(_bounded(count, f"{folder}/strings.bin"))), values
        ends = self.array(at, count + 1, "<u8").astype(np.int64)
        if ends[0] != 0 or ends[-1] != len(raw) or (np.diff(ends) < 0).any():
            _json.fail(f"{at} has to rise from 0 to {len(raw)}, the bytes of the names")
        try:
            return tuple(raw[i:j].decode() for i, j in pairwise(ends.tolist())), values
        except UnicodeDecodeError:
            _json.fail(f"{folder}/strings.bin holds a name that is not UTF-8")

    def words(self, branches: int) -> tuple[tuple[tuple[str, ...], ...], Ints]:
        """Return the words that branches are named by, and that of each branch; none without names."""
        if "actions/branches/strings.bin" not in self.files:
            return (), np.zeros(0, np.int32)
        names, word = self.strings("branches", branches)
        return tuple(tuple(name.split()) for name in names), word

    def labels(self) -> dict[str, Bools]:
        """Return the labels of states."""
        states = self.count["#states"]
        labels = {INIT: self.bits("state-is-initial.bin", states)}
        for key, name, about in self.group("aps"):
            _check_type(about.get("type"), "bool", f"label {name!r}")
            if name in labels:
                _json.fail(f"two labels are called {name!r}; name each once")
            labels[name] = self.bits(f"annotations/aps/{key}/states/values.bin", states)
        return labels

    def rewards(self, choice: Longs, branch: Longs) -> Floats:
        """Return the reward of each branch: that of the outcomes, if the file has them, or of all parts."""
        total = np.zeros(self.count["#branches"])
        exact = f"annotations/{OUTCOMES}/{REWARD}/branches/values.bin"
        if exact in self.files:
            return self.array(exact, total.size, "<f8")
        rewards = self.group("rewards")
        if len(rewards) > 1:
            named = ", ".join(name for _, name, _ in rewards)
            _json.fail(f"the file has the rewards {named}, and one is read; leave out the others")
        for key, name, about in rewards:
            _check_type(about.get("type"), "double", f"reward {name!r}")
            for entity in _ENTITIES:
                file = f"annotations/rewards/{key}/{entity}/values.bin"
                if file in self.files:
                    part = self.array(file, self.count[f"#{entity}"], "<f8")
                    if entity == "states":
                        part = np.repeat(part, np.diff(choice))
                    if entity != "branches":
                        part = np.repeat(part, np.diff(branch))
                    total += part
        return total

    def origin(self) -> Ints | None:
        """Return the parts that states are made of, if the file has them."""
        columns = []
        for key, name, about in self.group(ORIGIN):
            _check_type(about.get("type"), "int", name)
            part = self.array(f"annotations/{ORIGIN}/{key}/states/values.bin", self.count["#states"], "<i8")
            if not np.array_equal(part, part.astype(np.int32)):
                _json.fail(f"{name} holds {part.min()} to {part.max()}; 32 bits are read")
            columns.append(part.astype(np.int32))
        return np.stack(columns, axis=1) if columns else None

    def group(self, name: str) -> list[tuple[str, str, dict[str, Any]]]:
        """Return key, name and description of the annotations of a group."""
        found = self.annotations.get(name, {})
        if not isinstance(found, dict) or not all(isinstance(about, dict) for about in found.values()):
            _json.fail(f"the annotations {name!r} are no object of objects")
        return [
            (key, _json.text_of(about.get("alias", key), "an alias"), about) for key, about in found.items()
        ]


def _entry(table: Any, key: str, kind: type) -> Any:  # noqa: ANN401 - JSON may hold anything
    """Return what stands under ``key``, which has to be of one kind."""
    value = table.get(key) if isinstance(table, dict) else None
    if not isinstance(value, kind) or isinstance(value, bool):
        _json.fail(f"index.json has {_json.shown(value)} for {key!r}; of another kind is what is needed")
    return value


def _check_type(about: object, needed: str, what: str) -> None:
    if not isinstance(about, dict) or about.get("type") != needed:
        _json.fail(f"{what} is of type {_json.shown(about)}; {needed} is needed")


def _bounded(size: int, name: str) -> int:
    if size > MAX_STATES:
        _json.fail(f"{name} is left out, and {size:,} entries are too many for that")
    return size


def _uncompressed(raw: bytes) -> bytes:
    """Return an archive as it is without compression."""
    if raw.startswith(b"\x1f\x8b"):
        tool: Any = zlib.decompressobj(wbits=31)
    elif raw.startswith(b"\xfd7zXZ\0"):
        tool = lzma.LZMADecompressor(memlimit=_XZ_MEMORY)
    else:
        return raw
    try:
        raw = tool.decompress(raw, MAX_BYTES + 1)
    except (zlib.error, lzma.LZMAError) as error:
        _json.fail(f"the archive cannot be decompressed: {error}")
    if len(raw) > MAX_BYTES:
        _json.fail(too_large(MAX_BYTES))
    if not tool.eof:
        _json.fail("the archive is cut off")
    return raw


def _files(raw: bytes) -> dict[str, bytes]:
    """Return the plain files of a tar archive."""
    files: dict[str, bytes] = {}
    try:
        with tarfile.open(fileobj=BytesIO(raw), mode="r:") as archive:
            for member in archive:
                name = member.name.removeprefix("./")
                if name in files or len(files) >= _MAX_FILES:
                    _json.fail(f"the archive holds {name!r} twice, or more than {_MAX_FILES:,} files")
                if member.isdir():
                    continue
                content = archive.extractfile(member) if member.isreg() and not member.issparse() else None
                if content is None or member.size > len(raw):
                    _json.fail(f"{name!r} in the archive is no plain file")
                files[name] = content.read()
    except (tarfile.TarError, EOFError, ValueError, OverflowError) as error:
        _json.fail(f"this is no tar archive: {error}")
    return files
