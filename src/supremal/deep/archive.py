"""A bundle in one file: `save` and `load`.

The file is a zip archive of

- ``bundle.json``: the version, the events, what an observation is made of, the layers, the `Layout`;
- ``masks``: ``int8 [S, A]``, and for each layer k ``weight_k``, ``float32 [to, from]``, and ``bias_k``: the
  numbers alone, in C order and little-endian, not compressed.

Nothing in it is run: no pickle, no code.  Each array has to be as long as ``bundle.json`` says, to the byte.
"""

from __future__ import annotations

import json
import struct
from pathlib import Path
from secrets import token_hex
from typing import Any, Final
from zipfile import ZIP_STORED, BadZipFile, ZipFile, ZipInfo

import numpy as np
from numpy.typing import NDArray

from supremal.deep.bundle import Bundle
from supremal.deep.network import Input, Network
from supremal.envs.layout import Layout, layout_from
from supremal.errors import FormatError, MDPError, ModelError
from supremal.formats._json import WrongError, check_keys, fail, list_of, parse, shown, text_of

VERSION: Final = 1
_FORMAT: Final = "supremal bundle"
_KEYS: Final = ("format", "version", "learner", "scores", "events", "inputs", "layers", "layout")
_MAX_TEXT: Final = 64 << 20
_SINCE: Final = (1980, 1, 1, 0, 0, 0)  # the same bundle is the same bytes
_NO_BUNDLE: Final = (BadZipFile, EOFError, NotImplementedError, RuntimeError, struct.error, ValueError)
"""What zipfile raises of a file that is none."""


def save(path: str | Path, model: Any, env: Any = None) -> None:  # noqa: ANN401 - a learner of Stable-Baselines3
    """Write what ``model`` learned, and the supervisor that it learned under, to a file.

    What was in it before is replaced in one step.

    Parameters
    ----------
    path
        Of the file.
    model
        `MaskablePPO`, `MaskedDQN`, or another learner of Stable-Baselines3 with one of their policies.
    env
        The `SupervisedEnv`, wrapped or vectorised as you like; left out: the one that ``model`` learned in.

    Raises
    ------
    MDPError
        If there is no supervised environment, or the policy is not one that a bundle can hold.
    OSError
        If the file cannot be written.
    """
    bundle = bundle_of(model, env)
    layers = zip(bundle.network.weights, bundle.network.biases, strict=True)
    arrays: dict[str, NDArray[Any]] = {"masks": bundle.masks}
    for k, (weight, bias) in enumerate(layers):
        arrays |= {f"weight_{k}": weight, f"bias_{k}": bias}
    place = Path(path)
    work = place.with_name(f".{place.name}.{token_hex(4)}")
    try:
        with ZipFile(work, "w", ZIP_STORED) as archive:
            text = json.dumps(_document(bundle), indent=2, ensure_ascii=False)
            archive.writestr(ZipInfo("bundle.json", _SINCE), text)
            for name, array in arrays.items():
                archive.writestr(ZipInfo(name, _SINCE), array.astype(array.dtype.newbyteorder("<")).tobytes())
        work.replace(place)
    finally:
        work.unlink(missing_ok=True)


def bundle_of(model: Any, env: Any = None) -> Bundle:  # noqa: ANN401 - as in save
    """Return what `save` would write; parameters and errors are its."""
    from supremal.deep._policies import network_of  # torch: whoever loads a bundle needs none

    scores, network = network_of(model)
    env = model.get_env() if env is None else env
    layout, supervised = _attribute(env, "layout"), _attribute(env, "model")
    if not isinstance(layout, Layout) or layout.space != model.observation_space:
        message = (
            f"the environment is {env!r:.60}; a SupervisedEnv is needed, whose observations are those of the "
            "model: give env=, and let wrappers that change observations stand beneath it"
        )
        raise MDPError(message)
    return Bundle(supervised.events, layout, supervised.masks, network, scores, type(model).__name__)  # type: ignore[arg-type] # one of the two


def _attribute(env: Any, name: str) -> Any:  # noqa: ANN401 - an environment, alone or a vector of them
    """Return an attribute from within the wrappers of ``env``; None where there is none."""
    try:
        return env.get_attr(name, 0)[0] if hasattr(env, "get_attr") else env.get_wrapper_attr(name)
    except AttributeError:
        return None


def _document(bundle: Bundle) -> dict[str, Any]:
    """Return all but the arrays as plain data."""
    network = bundle.network
    inputs = [
        {"key": part.key, "numbers": part.numbers, "choices": list(part.choices)} for part in network.inputs
    ]
    layers = [
        {"size": len(bias), "activation": activation}
        for bias, activation in zip(network.biases, network.activations, strict=True)
    ]
    return {
        "format": _FORMAT,
        "version": VERSION,
        "learner": bundle.learner,
        "scores": bundle.scores,
        "events": list(bundle.events),
        "inputs": inputs,
        "layers": layers,
        "layout": bundle.layout.document(),
    }


def load(path: str | Path) -> Bundle:
    """Return the bundle that `save` wrote to a file.

    Raises
    ------
    FormatError
        If it cannot be read, is no such file, is damaged, or was written by a newer supremal.
    """
    try:
        with ZipFile(path) as archive:
            return _read(archive, str(path))
    except WrongError as error:
        message = str(error)
    except FormatError:
        raise
    except ModelError as error:
        message = f"it does not hold together: {error}"
    except _NO_BUNDLE as error:
        message = f"it is no bundle, or a damaged one ({error}); give one that supremal.deep.save wrote"
    except OSError as error:
        message = f"cannot read it: {error.strerror or error}; give the path of a bundle"
    raise FormatError(message, path=str(path))


def _read(archive: ZipFile, path: str) -> Bundle:
    """Return the bundle in an archive."""
    document = parse(_member(archive, "bundle.json"), path, _MAX_TEXT)
    if not isinstance(document, dict) or document.get("format") != _FORMAT:
        fail("bundle.json is no document of a bundle; give a file that supremal.deep.save wrote")
    version = document.get("version")
    if type(version) is int and version > VERSION:
        fail(f"it has version {version}, and this supremal reads {VERSION}; a newer one wrote it")
    if version != VERSION:
        fail(f"'version' is {shown(version)}; {VERSION} is needed")
    check_keys(document, "bundle.json", _KEYS, ())
    inputs = tuple(_read_input(part) for part in list_of(document["inputs"], "'inputs'"))
    layout = layout_from(document["layout"])
    events = tuple(text_of(name, "an event") for name in list_of(document["events"], "'events'"))
    width, weights, biases, activations = sum(part.width for part in inputs), [], [], []
    for k, layer in enumerate(list_of(document["layers"], "'layers'")):
        check_keys(layer, f"layer {k}", ("size", "activation"), ())
        size = _count(layer["size"], f"'size' of layer {k}", 1)
        weights.append(_array(archive, f"weight_{k}", "<f4", (size, width)))
        biases.append(_array(archive, f"bias_{k}", "<f4", (size,)))
        activations.append(text_of(layer["activation"], f"'activation' of layer {k}"))
        width = size
    if not biases:
        fail("'layers' is empty; one layer is needed at least")
    network = Network(inputs, tuple(weights), tuple(biases), tuple(activations))
    masks = _array(archive, "masks", "i1", (layout.states, len(events)))
    learner, scores = (text_of(document[key], repr(key)) for key in ("learner", "scores"))
    return Bundle(events, layout, masks, network, scores, learner)  # type: ignore[arg-type] # it is checked there


def _read_input(part: Any) -> Input:  # noqa: ANN401 - JSON may hold anything
    """Return one part of an observation."""
    check_keys(part, "an entry of 'inputs'", ("key", "numbers", "choices"), ())
    key = None if part["key"] is None else text_of(part["key"], "'key'")
    choices = [_count(n, "an entry of 'choices'") for n in list_of(part["choices"], "'choices'")]
    return Input(key, _count(part["numbers"], "'numbers'"), tuple(choices))


def _count(value: object, what: str, least: int = 0) -> int:
    """Return a whole number."""
    if type(value) is not int or value < least:
        fail(f"{what} is {shown(value)}; a whole number is needed, not below {least}")
    return value


def _member(archive: ZipFile, name: str) -> bytes:
    """Return the bytes of one member."""
    info = archive.NameToInfo.get(name)
    if info is None:
        fail(f"it has no {name}; give a file that supremal.deep.save wrote")
    if info.compress_type != ZIP_STORED:  # or a small file could ask for any amount of memory
        fail(f"{name} is compressed; give the file as supremal.deep.save wrote it")
    return archive.read(info)


def _array(archive: ZipFile, name: str, dtype: str, shape: tuple[int, ...]) -> NDArray[Any]:
    """Return one array."""
    raw = _member(archive, name)
    needed = int(np.prod(shape, dtype=object)) * np.dtype(dtype).itemsize
    if len(raw) != needed:
        fail(f"{name} has {len(raw):,} bytes; {needed:,} are needed for shape {shape}")
    return np.frombuffer(raw, dtype).astype(np.dtype(dtype).newbyteorder("=")).reshape(shape)
