"""Films of episodes: as many pictures as there are moments, those that the environment draws."""

from pathlib import Path

import numpy as np
import pytest
from imageio_ffmpeg import count_frames_and_secs
from PIL import Image

from supremal import patterns, plant_automaton
from supremal.envs import PickupDeliveryEnv, SupervisedEnv
from supremal.envs.recording import record_episode

PAGE = Path(__file__).parents[3] / "docs" / "plots.md"


def first(observation, info):
    return int(np.argmax(info["action_mask"]))


def frames(path):
    with Image.open(path) as film:
        for k in range(film.n_frames):
            film.seek(k)
            yield np.asarray(film.convert("RGB"), np.int16)


def test_a_gif_has_the_pictures_of_the_episode(tmp_path):
    target = tmp_path / "new" / "film.gif"
    env = PickupDeliveryEnv(render_mode="rgb_array")
    assert record_episode(target, env, first, seed=3, max_steps=12) == target
    env.reset(seed=3)
    drawn = [env.render()]
    info = env.reset(seed=3)[1]
    for _ in range(12):
        info = env.step(first(None, info))[4]
        drawn.append(env.render())
    films = [*frames(target)]
    assert len(films) == 13
    for shown, meant in zip(films, drawn, strict=True):
        assert np.abs(shown - meant).mean() < 3  # a GIF has 256 colours
    far = np.abs(films[1] - drawn[2].astype(np.int16)).mean()
    assert far > 2 * np.abs(films[1] - drawn[1]).mean()
    assert [path.name for path in target.parent.iterdir()] == ["film.gif"]


def test_an_mp4_has_as_many_pictures_and_lasts_as_long(tmp_path):
    target = tmp_path / "film.mp4"
    target.write_text("old")
    record_episode(target, PickupDeliveryEnv(render_mode="rgb_array"), first, seed=0, max_steps=11, fps=6)
    count, seconds = count_frames_and_secs(str(target))
    assert count == 12
    assert seconds == pytest.approx(2.0, abs=0.2)
    assert [path.name for path in tmp_path.iterdir()] == ["film.mp4"]


def test_an_agent_is_filmed_under_its_supervisor(tmp_path):
    grid = PickupDeliveryEnv(render_mode="rgb_array")
    model = grid.model(rewards=False)
    no_turn = patterns.absence("r", alphabet=model.alphabet)
    env = SupervisedEnv(
        grid, rules=[no_turn], plant=plant_automaton(model), events=model.actions, nonblocking=False
    )
    words = []

    def choose(observation, info):
        words.append(info.get("events", ()))
        return np.flatnonzero(info["action_mask"])[-1]

    record_episode(tmp_path / "film.gif", env, choose, seed=0, max_steps=20)
    assert len([*frames(tmp_path / "film.gif")]) == len(words) + 1
    assert not any("r" in word for word in words)


@pytest.mark.parametrize("name", ["film.gif", "film.mp4"])
def test_a_film_that_breaks_off_leaves_nothing(tmp_path, name):
    def fails(observation, info):
        raise RuntimeError

    with pytest.raises(RuntimeError):
        record_episode(tmp_path / name, PickupDeliveryEnv(render_mode="rgb_array"), fails, seed=0)
    assert [*tmp_path.iterdir()] == []


def test_the_page_runs_as_printed(tmp_path, monkeypatch):
    (block,) = PAGE.read_text(encoding="utf-8").split("```python video\n")[1:]
    monkeypatch.chdir(tmp_path)
    exec(compile(block.split("```")[0], "docs/plots.md", "exec"), {})  # noqa: S102 - our own page
    assert sorted(path.name for path in tmp_path.iterdir()) == ["episode.gif", "episode.mp4"]
