"""A policy and its supervisor in one file: no action comes out that is not enabled, and no code goes in."""

from __future__ import annotations

import json
import subprocess
import sys
from functools import cache, partial
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from press import ACTIONS, PLANT, RULES, Press, press
from sb3_contrib import QRDQN, MaskablePPO
from stable_baselines3 import A2C, PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize
from torch import nn

from supremal import FormatError, MDPError
from supremal.deep import Bundle, MaskedDQN, load, save
from supremal.deep.archive import bundle_of
from supremal.deep.network import ACTIVATIONS, Input, Network
from supremal.envs.supervised import Counts, SupervisedEnv

POLICY = {"dict": "MultiInputPolicy", "flat": "MlpPolicy"}
KINDS = ("dict", "flat")
LEARNERS = (MaskablePPO, MaskedDQN)
OF = {
    MaskablePPO: {"n_steps": 128, "n_epochs": 2},
    MaskedDQN: {"buffer_size": 1_000, "learning_starts": 100},
}


@cache
def trained(learner: type, observe: str) -> Any:
    """Return a learner after 500 steps in two environments, with no line about masks."""
    env = DummyVecEnv([lambda: Monitor(press(observe=observe))] * 2)
    kwargs = {"policy_kwargs": {"net_arch": [16]}, "seed": 0, "device": "cpu"}
    return learner(POLICY[observe], env, **OF[learner], **kwargs).learn(500)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the path of a bundle."""
    path = tmp_path_factory.mktemp("bundle") / "press.zip"
    save(path, trained(MaskablePPO, "flat"))
    return path


def reachable(observe: str) -> tuple[list[Any], list[list[bool]]]:
    """Return every observation that random runs come across, and by definition what keeps the rules there."""
    env, random = press(observe=observe), np.random.default_rng(0)
    seen: dict[tuple[float, ...], tuple[Any, list[bool]]] = {}
    for seed in range(60):
        observation, info = env.reset(seed=seed)
        ended = False
        while not ended:
            flat = gymnasium.spaces.flatten(env.observation_space, observation)
            seen[tuple(flat.tolist())] = (observation, info["keeps"])
            action = random.choice(np.flatnonzero(info["action_mask"]))
            observation, _, terminated, truncated, info = env.step(action)
            ended = terminated or truncated
    return [list(part) for part in zip(*seen.values(), strict=True)]  # type: ignore[return-value]


ENV = press(observe="flat")
SEEN, KEEPS = reachable("flat")


def linear(weight: Any, bias: Any, scores: Any) -> Bundle:
    """Return the press under a policy of one layer."""
    network = Network((Input(None, 8),), (weight,), (bias,), ("identity",))
    return Bundle(ENV.model.events, ENV.layout, ENV.model.masks, network, scores)


# --- no way around the mask -------------------------------------------------------------------------------


@pytest.mark.parametrize("observe", KINDS)
@pytest.mark.parametrize("learner", LEARNERS)
def test_no_rule_is_broken_while_it_learns(learner: type, observe: str) -> None:
    counts = trained(learner, observe).env.get_attr("counts")
    assert counts == [Counts(violations=0, disabled=0, model_broken=0)] * 2


@pytest.mark.parametrize("observe", KINDS)
@pytest.mark.parametrize("learner", LEARNERS)
def test_a_bundle_chooses_as_its_learner_did_and_keeps_the_rules(
    learner: type, observe: str, tmp_path: Path
) -> None:
    model = trained(learner, observe)
    save(tmp_path / "press.zip", model)
    bundle = load(tmp_path / "press.zip")
    assert (bundle.learner, bundle.events) == (learner.__name__, ("strike", "rest", "oil"))
    observations, keeps = reachable(observe)
    assert len(keeps) >= 6
    for observation, kept in zip(observations, keeps, strict=True):
        action = bundle.predict(observation)
        chosen, _ = model.predict(observation, deterministic=True, action_masks=np.array(kept))
        assert kept[action]
        assert action == chosen


@pytest.mark.parametrize("observe", KINDS)
def test_a_batch_is_as_its_rows(observe: str, tmp_path: Path) -> None:
    save(tmp_path / "press.zip", trained(MaskablePPO, observe))
    bundle = load(tmp_path / "press.zip")
    observations, _ = reachable(observe)
    if observe == "dict":
        batch: Any = {key: np.stack([o[key] for o in observations]) for key in observations[0]}
    else:
        batch = np.stack(observations)
    assert bundle.predict(batch).tolist() == [bundle.predict(observation) for observation in observations]


@pytest.mark.filterwarnings("ignore:(overflow|invalid value):RuntimeWarning")
@settings(max_examples=60, deadline=None)
@given(
    weight=arrays(np.float32, (3, 8), elements=st.floats(-(2.0**127), 2.0**127, width=32)),
    bias=arrays(np.float32, 3, elements=st.floats(-(2.0**127), 2.0**127, width=32)),
    seed=st.none() | st.integers(0, 99),
)
def test_whatever_the_network_the_mask_holds(weight: Any, bias: Any, seed: int | None) -> None:
    bundle = linear(weight, bias, "logits")
    random = None if seed is None else np.random.default_rng(seed)
    actions = bundle.predict(np.stack(SEEN), random=random)
    assert all(keeps[action] for keeps, action in zip(KEEPS, actions, strict=True))


def test_drawn_actions_follow_the_probabilities_of_the_learner(path: Path) -> None:
    model, bundle = trained(MaskablePPO, "flat"), load(path)
    observation, info = press(observe="flat").reset(seed=0)
    batch = np.tile(observation, (20_000, 1))
    drawn = np.bincount(bundle.predict(batch, random=np.random.default_rng(0)), minlength=3) / 20_000
    tensor, _ = model.policy.obs_to_tensor(observation)
    distribution = model.policy.get_distribution(tensor, action_masks=info["action_mask"])
    assert np.abs(drawn - distribution.distribution.probs.detach().numpy()[0]).max() < 0.015


def test_a_further_mask_restricts_further(path: Path) -> None:
    bundle = load(path)
    observation, info = press(observe="flat").reset(seed=0)
    assert info["action_mask"].tolist() == [1, 1, 1]
    for action in range(3):
        assert bundle.predict(observation, np.eye(3, dtype=bool)[action]) == action
    with pytest.raises(MDPError, match="no action is enabled in observation 0; the mask given leaves none"):
        bundle.predict(observation, [0, 0, 0])
    with pytest.raises(MDPError, match=r"action_mask has shape \(2,\); \(3,\) or \(1, 3\) is needed"):
        bundle.predict(observation, [1, 1])


def test_outside_of_the_supervisor_a_mask_has_to_be_given(path: Path) -> None:
    bundle = load(path)
    lost, _ = press(observe="flat").reset(seed=0)
    lost[1:] = 0
    with pytest.raises(MDPError, match="outside of the supervisor.*give action_mask=info"):
        bundle.predict(lost)
    assert bundle.predict(lost, [0, 0, 1]) == 2


def test_the_learner_with_a_penalty_is_put_under_the_supervisor(tmp_path: Path) -> None:
    env = press(observe="flat", mode="monitor")
    save(tmp_path / "press.zip", PPO("MlpPolicy", env, n_steps=64, seed=0, device="cpu").learn(64))
    bundle = load(tmp_path / "press.zip")
    assert all(keeps[bundle.predict(observation)] for observation, keeps in zip(SEEN, KEEPS, strict=True))


@pytest.mark.parametrize("observation", [{"observation": [0.0]}, [0.0] * 8, 3], ids=str)
def test_observations_of_another_shape(observation: Any, tmp_path: Path) -> None:
    save(tmp_path / "press.zip", trained(MaskablePPO, "dict"))
    with pytest.raises(MDPError, match="a dictionary with 'supervisor' is needed"):
        load(tmp_path / "press.zip").predict(observation)
    with pytest.raises(MDPError, match=r"shape \(2, 7\); \(N, 8\) is needed"):
        linear(np.zeros((3, 8)), np.zeros(3), "logits").predict(np.zeros((2, 7)))


def test_values_have_no_probabilities() -> None:
    bundle = linear(np.zeros((3, 8)), np.zeros(3), "values")
    with pytest.raises(MDPError, match="random is given, but this policy has values"):
        bundle.predict(SEEN[0], random=np.random.default_rng(0))


# --- the networks -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("function", [nn.ReLU, nn.Tanh, nn.ELU, nn.Sigmoid])
def test_each_activation_is_that_of_torch(function: type[nn.Module]) -> None:
    kwargs = {"net_arch": [5, 4], "activation_fn": function}
    model = A2C("MlpPolicy", press(observe="flat"), policy_kwargs=kwargs, seed=0, device="cpu")
    observations = np.random.default_rng(0).normal(size=(50, 8)).astype(np.float32) * 3
    tensor, _ = model.policy.obs_to_tensor(observations)
    logits = model.policy.get_distribution(tensor).distribution.logits.detach().numpy()
    scores = bundle_of(model).network.scores(observations, 50)
    scores -= np.logaddexp.reduce(scores, axis=1, keepdims=True)
    assert np.abs(scores - logits).max() < 1e-5


def test_the_activations_hold_for_large_numbers() -> None:
    with np.errstate(over="raise", invalid="raise"):
        for name, function in ACTIVATIONS.items():
            low, high = function(np.array([-1e4, 1e4], np.float32))
            assert (low, high) == {"tanh": (-1, 1), "sigmoid": (0, 1), "identity": (-1e4, 1e4)}.get(
                name, (-1 if name == "elu" else 0, 1e4)
            )


def image(size: int = 40) -> gymnasium.Env:
    """Return the press with its picture in place of its heat."""
    space = gymnasium.spaces.Box(0, 255, (size, size, 3), np.uint8)
    env = gymnasium.wrappers.TransformObservation(Press(), lambda _: np.zeros(space.shape, np.uint8), space)
    return SupervisedEnv(env, rules=RULES, plant=PLANT, events=ACTIONS)


@pytest.mark.parametrize(
    ("model", "said"),
    [
        (object, "a policy of type NoneType cannot be saved"),
        (lambda: QRDQN("MlpPolicy", press(observe="flat"), buffer_size=10), "QRDQNPolicy cannot be saved"),
        (lambda: PPO("MultiInputPolicy", image()), "a CombinedExtractor with layers of its own"),
        (lambda: PPO("MlpPolicy", Press()), "a SupervisedEnv is needed"),
        (
            lambda: PPO("MlpPolicy", VecNormalize(make_vec_env(partial(press, observe="flat")))),
            "by VecNormalize",
        ),
        (
            lambda: PPO("MlpPolicy", press(observe="flat"), policy_kwargs={"activation_fn": nn.Softplus}),
            "a layer of type Softplus cannot be saved; Linear is needed",
        ),
    ],
)
def test_models_that_no_bundle_holds(model: Any, said: str, tmp_path: Path) -> None:
    with pytest.raises(MDPError, match=said):
        save(tmp_path / "press.zip", model())
    assert list(tmp_path.iterdir()) == []


def test_a_network_that_diverged(tmp_path: Path) -> None:
    model = PPO("MlpPolicy", press(observe="flat"), device="cpu")
    model.policy.action_net.bias.data[0] = np.nan
    with pytest.raises(MDPError, match="not finite; the learner diverged"):
        save(tmp_path / "press.zip", model)


# --- the file ---------------------------------------------------------------------------------------------


def test_the_file_holds_text_and_numbers_and_is_replaced_as_one(path: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy.zip"
    copy.write_text("what was here before")
    save(str(copy), trained(MaskablePPO, "flat"))
    assert copy.read_bytes() == path.read_bytes()
    assert list(tmp_path.iterdir()) == [copy]
    with ZipFile(path) as archive:
        sizes = {info.filename: info.file_size for info in archive.infolist()}
        layers = json.loads(archive.read("bundle.json"))["layers"]
    assert sizes.pop("bundle.json") < 2_000
    assert layers == [{"size": 16, "activation": "tanh"}, {"size": 3, "activation": "identity"}]
    assert sizes == {"masks": 18, "weight_0": 512, "bias_0": 64, "weight_1": 192, "bias_1": 12}


def test_a_failure_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(OSError, match="folder"):
        save(tmp_path / "folder", trained(MaskablePPO, "flat"))
    with pytest.raises(OSError, match="nowhere"):
        save(tmp_path / "nowhere" / "press.zip", trained(MaskablePPO, "flat"))
    assert [found.name for found in tmp_path.rglob("*")] == ["folder"]


def test_loading_needs_neither_pickle_nor_torch(path: Path) -> None:
    script = f"""if True:
        import sys
        sys.modules.update(dict.fromkeys(["torch", "stable_baselines3", "sb3_contrib"]))
        import numpy as np
        from supremal.deep import load
        import pickle
        def refuse(*_, **__):
            raise SystemExit("unpickled")
        pickle.load = pickle.loads = pickle.Unpickler = refuse
        np.load = refuse
        observation = np.array({SEEN[0].tolist()}, np.float32)
        print(load({str(path)!r}).predict(observation))
    """
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", script], capture_output=True, text=True, check=False
    )
    assert done.stdout.strip() == str(load(path).predict(SEEN[0])), done.stderr


def changed(path: Path, place: Path, kind: int = ZIP_STORED, **members: bytes | None) -> Path:
    """Write the archive to ``place`` with other members, None for none, and return that."""
    with ZipFile(path) as old, ZipFile(place, "w", kind) as new:
        for name in old.namelist():
            raw = members.get(name.replace(".", "_"), old.read(name))
            if raw is not None:
                new.writestr(name, raw)
    return place


def document(path: Path, **changes: Any) -> bytes:
    """Return the document of a bundle with changes."""
    with ZipFile(path) as archive:
        return json.dumps(json.loads(archive.read("bundle.json")) | changes).encode()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"format": "another"}, "bundle.json is no document of a bundle"),
        ({"version": 2}, "it has version 2, and this supremal reads 1; a newer one wrote it"),
        ({"version": "1"}, "'version' is \"1\"; 1 is needed"),
        ({"more": 1}, "unknown key 'more'"),
        ({"scores": "guesses"}, "it does not hold together: scores is 'guesses'"),
        ({"events": ["strike"]}, r"masks has 18 bytes; 6 are needed for shape \(6, 1\)"),
        ({"layers": []}, "'layers' is empty"),
        ({"layers": [{"size": 0, "activation": "tanh"}]}, "'size' of layer 0 is 0; .* not below 1"),
        ({"layers": [{"size": 16, "activation": "tanh"}]}, "the network scores 16 actions; there are 3"),
        ({"layers": [{"size": 17, "activation": "tanh"}]}, r"weight_0 has 512 bytes; 544 .* \(17, 8\)"),
        ({"layers": [{"size": 16, "activation": "tan"}] * 1}, "did you mean 'tanh'"),
        ({"inputs": [{"key": None, "numbers": -8, "choices": []}]}, "'numbers' is -8; a whole number"),
        ({"inputs": [{"key": None, "numbers": 10**30, "choices": []}]}, "weight_0 has 512 bytes"),
        ({"layout": {}}, "it does not hold together: a layout is"),
    ],
    ids=str,
)
def test_documents_that_say_something_else(changes: Any, said: str, path: Path, tmp_path: Path) -> None:
    place = changed(path, tmp_path / "changed.zip", bundle_json=document(path, **changes))
    with pytest.raises(FormatError, match=said):
        load(place)


@pytest.mark.parametrize(
    ("members", "said"),
    [
        ({"bundle_json": None}, "it has no bundle.json"),
        ({"bundle_json": b"{"}, "this is not JSON"),
        ({"masks": None}, "it has no masks"),
        ({"masks": b"\2" * 18}, "0s and 1s of shape"),
        ({"bias_1": b"\0" * 11}, r"bias_1 has 11 bytes; 12 are needed for shape \(3,\)"),
        ({"bias_1": b"\xff" * 12}, "numbers that are not finite"),
        ({"kind": ZIP_DEFLATED}, "bundle.json is compressed"),
    ],
    ids=str,
)
def test_archives_that_hold_something_else(members: Any, said: str, path: Path, tmp_path: Path) -> None:
    place = changed(path, tmp_path / "changed.zip", **members)
    with pytest.raises(FormatError, match=said) as caught:
        load(place)
    assert str(place) in str(caught.value)


def test_files_that_are_no_archive(path: Path, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("no archive")
    (tmp_path / "half.zip").write_bytes(path.read_bytes()[:700])
    for name, said in {
        "notes.txt": "it is no bundle, or a damaged one",
        "half.zip": "it is no bundle, or a damaged one",
        "nowhere.zip": "cannot read it: No such file",
        ".": "cannot read it: Is a directory",
    }.items():
        with pytest.raises(FormatError, match=said):
            load(tmp_path / name)
    trained(MaskablePPO, "flat").save(tmp_path / "model.zip")
    with pytest.raises(FormatError, match="it has no bundle.json"):
        load(tmp_path / "model.zip")


def test_a_flipped_byte_is_found_or_changes_nothing(path: Path, tmp_path: Path) -> None:
    raw, whole = path.read_bytes(), load(path)
    random, found = np.random.default_rng(0), 0
    for place in random.choice(len(raw), 300, replace=False):
        flipped = bytearray(raw)
        flipped[place] ^= int(random.integers(1, 256))
        (tmp_path / "flipped.zip").write_bytes(flipped)
        try:
            bundle = load(tmp_path / "flipped.zip")
        except FormatError:
            found += 1
        else:
            assert (bundle.masks == whole.masks).all()
            assert bundle.predict(np.stack(SEEN)).tolist() == whole.predict(np.stack(SEEN)).tolist()
    assert found > 200
