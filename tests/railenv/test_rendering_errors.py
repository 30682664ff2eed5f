"""Rendering: what cannot be drawn is refused."""

import sys
from importlib.util import find_spec

import gymnasium
import numpy as np
import pytest

from railenv.envs.rendering import History, Outline, Renderer
from railenv.errors import ParameterError
from tests.railenv.scenes import make_bodies, make_scene

needs_pygame = pytest.mark.skipif(find_spec("pygame") is None, reason="the extra `render` is absent")


def test_missing_pygame_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(gymnasium.error.DependencyNotInstalled, match=r"pip install 'railenv\[render\]"):
        Renderer("rgb_array", fps=50)


def test_importing_the_module_does_not_import_pygame():
    import subprocess

    code = "import sys, railenv.envs.rendering; sys.exit('pygame' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@needs_pygame
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"mode": "ansi"}, "mode is 'ansi'"),
        ({"fps": 0}, "fps is 0"),
        ({"fps": "fast"}, "fps is 'fast'"),
        ({"size": (100, 100)}, "size is 100 x 100"),
        ({"size": 960}, "size is 960"),
        ({"size": (960, 600, 3)}, "size is"),
    ],
)
def test_impossible_settings_are_refused(arguments, message):
    with pytest.raises(ParameterError, match=message):
        Renderer(**{"mode": "rgb_array", "fps": 50, **arguments})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"bodies": np.zeros((3, 5))}, r"bodies has shape \(3, 5\); it must be \(n, 4\)"),
        ({"bodies": np.zeros((4, 4))}, r"bodies has shape \(4, 4\); it must be \(2, 4\) or \(3, 4\)"),
        ({"bodies": np.full((3, 4), np.nan)}, "bodies has entries that are not finite"),
        ({"bodies": "none"}, "bodies is 'none'"),
        ({"equilibrium": np.zeros((2, 4))}, r"equilibrium has shape \(2, 4\); it must be \(3, 4\)"),
        ({"rail": np.zeros(3)}, r"rail has shape \(3,\); it must be \(2,\)"),
        ({"half_gauge": 0.0}, "half_gauge is 0 m"),
        ({"half_wheelbase": -1.0}, "half_wheelbase is -1 m"),
        ({"wheel_radius": np.inf}, "wheel_radius is inf"),
        ({"flange_clearance": None}, "flange_clearance is None"),
        ({"speed": 0.0}, "speed is 0 m/s"),
        ({"critical_speed": -1.0}, "critical_speed is -1 m/s"),
        ({"curvature": 2.0}, "curvature is 2 1/m"),
        ({"cant": 1.0}, "cant is 1 rad"),
        ({"time": np.nan}, "time is nan"),
        ({"history": None}, "history is None"),
        ({"history": History(np.arange(3), np.zeros((3, 1)), np.zeros((3, 1)))}, "has 1 columns"),
        ({"wheelsets": (-1.0, 1.0)}, "places must fall"),
        ({"wheelsets": (1.0, 0.0, -1.0), "outlines": (Outline(0.0, 1.0),)}, r"must be \(4, 4\), for 3"),
        ({"derailed": True}, "derailed is True"),
    ],
)
def test_impossible_scene_is_refused(changes, message):
    with pytest.raises(ParameterError, match=message):
        make_scene(**changes)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ((np.zeros((3, 1)), np.zeros((3, 2)), np.zeros((3, 1))), r"history.time has shape \(3, 1\)"),
        ((np.arange(3), np.zeros(3), np.zeros((3, 1))), r"history.y has shape \(3,\)"),
        ((np.arange(3), np.zeros((3, 2)), np.zeros(3)), r"history.action has shape \(3,\)"),
        ((np.arange(3), np.zeros((3, 2)), np.zeros((2, 1))), r"must be \(3, n\)"),
        ((np.zeros(3), np.zeros((3, 2)), np.zeros((3, 1))), "must increase"),
    ],
)
def test_impossible_history_is_refused(arrays, message):
    with pytest.raises(ParameterError, match=message):
        History(*arrays)


def test_scene_keeps_its_own_copy():
    bodies = make_bodies()
    scene = make_scene(bodies=bodies)
    bodies[0, 0] = 1.0
    assert scene.bodies[0, 0] == 0.0


def test_exaggeration_keeps_the_clearance_visible():
    assert make_scene().exaggeration == 25.0
    assert make_scene(flange_clearance=0.005).exaggeration == 50.0
    assert make_scene(flange_clearance=10.0).exaggeration == 1.0
