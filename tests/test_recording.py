"""Films: what is refused before anything is begun; the films themselves are tested with the extra."""

import sys

import pytest

from supremal import FormatError, MDPError, MissingDependencyError
from supremal.envs import PickupDeliveryEnv
from supremal.envs.recording import record_episode


def never(observation, info):
    raise AssertionError


@pytest.mark.parametrize("name", ["film.avi", "film"])
def test_another_ending_is_refused(tmp_path, name):
    with pytest.raises(FormatError, match=r"films end in \.gif or \.mp4, not in "):
        record_episode(tmp_path / name, PickupDeliveryEnv(render_mode="rgb_array"), never)


@pytest.mark.parametrize(
    ("mode", "options", "said"),
    [
        (None, {}, "has render_mode None; 'rgb_array' is needed for a film"),
        ("ansi", {}, "has render_mode 'ansi'; 'rgb_array' is needed"),
        ("rgb_array", {"max_steps": 0}, "max_steps is 0; a whole number above 0"),
        ("rgb_array", {"fps": 0}, "fps is 0; a whole number of pictures a second above 0"),
        ("rgb_array", {"fps": -2}, "fps is -2"),
    ],
)
def test_what_no_film_comes_of(tmp_path, mode, options, said):
    with pytest.raises(MDPError, match=said):
        record_episode(tmp_path / "new" / "film.gif", PickupDeliveryEnv(render_mode=mode), never, **options)
    assert [*tmp_path.iterdir()] == []


def test_without_moviepy_it_says_what_to_install(tmp_path, monkeypatch):
    for name in [name for name in sys.modules if name.split(".")[0] == "moviepy"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "moviepy", None)
    monkeypatch.delitem(sys.modules, "supremal.envs._moviepy", raising=False)
    monkeypatch.delattr("supremal.envs._moviepy", raising=False)
    with pytest.raises(MissingDependencyError, match=r"needs moviepy: pip install 'supremal\[video\]'"):
        record_episode(tmp_path / "film.gif", PickupDeliveryEnv(render_mode="rgb_array"), never)
    assert [*tmp_path.iterdir()] == []
