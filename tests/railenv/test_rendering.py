"""Rendering: what a frame shows, without a display."""

import copy
import dataclasses
import pickle
from importlib.util import find_spec

import numpy as np
import pytest

from railenv.envs.rendering import History, Outline, Renderer, chart, colours, layout, plan
from tests.railenv.scenes import DELTA, make_bodies, make_history, make_scene

needs_pygame = pytest.mark.skipif(find_spec("pygame") is None, reason="the extra `render` is absent")

PLAN = (slice(90, 340), slice(20, 610))
"""Rows and columns of the plan view, inside its frame."""


@pytest.fixture
def renderer():
    pytest.importorskip("pygame")
    made = Renderer("rgb_array", fps=50)
    yield made
    made.close()


@pytest.fixture
def dummy_display(monkeypatch):
    pygame = pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    pygame.display.quit()
    yield pygame.display
    pygame.display.quit()


def where(frame, colour, area=(slice(None), slice(None))):
    """Return mean row and mean column of the pixels of a colour, and how many there are."""
    rows, columns = np.nonzero((frame[area] == colour).all(axis=-1))
    return rows.mean() if len(rows) else np.nan, columns.mean() if len(rows) else np.nan, len(rows)


def track_row(frame, column):
    """Return the row half-way between the rails in a column of the plan view."""
    rows = np.flatnonzero((frame[PLAN[0], column] == colours.RAIL).all(axis=-1))
    return (rows.min() + rows.max()) / 2.0


# ---------------------------------------------------------------------------- frames


def test_frame_is_an_array_of_the_size_asked_for(renderer):
    frame = renderer.draw(make_scene())
    assert frame.shape == (600, 960, 3)
    assert frame.dtype == np.uint8
    assert frame.flags.c_contiguous
    assert frame.flags.writeable


@needs_pygame
@pytest.mark.parametrize("size", [(640, 400), (1280, 720), (901, 777)])
def test_any_size_shows_the_whole_page(size):
    renderer = Renderer("rgb_array", fps=50, size=size)
    frame = renderer.draw(make_scene())
    assert frame.shape == (size[1], size[0], 3)
    assert where(frame, colours.LEADING)[2] > 100
    # nothing reaches the picture's border
    for edge in (frame[0], frame[-1], frame[:, 0], frame[:, -1]):
        assert (edge == 255).all()


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"bodies": make_bodies(frame=False)},
        {"curvature": 1.0 / 6250.0, "cant": 0.0873, "critical_speed": 120.0},
        {"curvature": -1.0 / 500.0, "cant": -0.1, "critical_speed": 60.0},
        {"curvature": 1e-9, "critical_speed": 1e4},
        {"bodies": make_bodies((31e-3, -31e-3), (0.3, -0.3)), "derailed": "a long reason, " * 20},
        {"bodies": make_bodies((1e9, -1e9), (1e9, -1e9)), "derailed": ""},
        {"history": History.empty()},
        {"history": History.empty(2)},
        {"history": make_history(0.0)},
        {"history": make_history(60.0, actuators=2)},
        {"history": make_history(2000.0, actuators=0, dt=0.5)},
        {"history": make_history(amplitude=10.0)},
        {"rail": np.array([5e-3, -5e-3])},
        {"flange_clearance": 0.4},
        {"half_wheelbase": 9.0},
    ],
)
def test_unusual_scenes_are_drawn(renderer, changes):
    frame = renderer.draw(make_scene(**changes))
    assert len(np.unique(frame.astype(int) @ [1, 256, 65536])) > 20


def make_train(count, outlines=()):
    """Return a scene with any number of wheelsets, 2.5 m apart."""
    places = tuple(1.25 * (count - 1) - 2.5 * k for k in range(count))
    time = 0.005 * np.arange(200)
    y = 1e-3 * np.sin(20.0 * time[:, None] - np.arange(count))
    return make_scene(
        bodies=np.zeros((count + len(outlines), 4)),
        rail=np.zeros(count),
        wheelsets=places,
        outlines=outlines,
        half_wheelbase=max(1.0, places[0]),
        history=History(time, y, np.zeros((200, 1))),
    )


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_any_number_of_wheelsets_is_drawn_where_they_are(renderer, count):
    frame = renderer.draw(make_train(count))
    shades = {colours.of_wheelset(i, count) for i in range(count)}
    columns = [where(frame, colours.mix(shade, 0.45), PLAN) for shade in shades]
    assert min(n for *_, n in columns) > 20
    ends = [where(frame, c, PLAN)[1] for c in (colours.LEADING, colours.TRAILING)]
    if count == 1:
        assert ends[0] == pytest.approx(297, abs=2)
        assert np.isnan(ends[1])
    else:
        assert ends[1] < 297 < ends[0]


def test_frames_and_bodies_are_drawn_where_they_are(renderer):
    outlines = (Outline(2.5, 1.25), Outline(-2.5, 1.25), Outline(0.0, 3.75, "body"))
    plain, drawn = renderer.draw(make_train(4)), renderer.draw(make_train(4, outlines))
    rows, columns = np.nonzero((plain != drawn).any(axis=-1)[PLAN])
    left, right = (
        where(drawn, colours.NEUTRAL, (PLAN[0], half)) for half in (slice(20, 317), slice(317, 610))
    )
    assert left[2] == pytest.approx(right[2], rel=0.05)
    assert left[2] > 200
    assert np.ptp(rows) > 60
    assert np.ptp(columns) > 400


def whole_vehicle(**changes):
    """Return a scene of a body on two bogies, with its steady shift in a curve, moved from there."""
    places = (10.2, 7.8, -7.8, -10.2)
    outlines = (Outline(9.0, 1.2), Outline(-9.0, 1.2), Outline(0.0, 10.2, "body"))
    steady = np.zeros((7, 4))
    steady[6, 0], steady[6, 2] = 0.05, -0.02
    values = {
        "bodies": steady.copy(),
        "equilibrium": steady,
        "rail": np.zeros(4),
        "wheelsets": places,
        "outlines": outlines,
        "half_wheelbase": 10.2,
        "history": History.empty(1, 4),
    }
    return make_scene(**{**values, **changes})


def moved(**states):
    """Return the states of such a scene with some of the body's moved from the steady ones."""
    bodies = whole_vehicle().bodies.copy()
    for name, value in states.items():
        bodies[6, ("y", "z", "phi", "psi").index(name)] += value
    return bodies


def edge_rows(frame):
    """Return the rows of the body's two long edges, left of the plan's middle."""
    column = frame[PLAN[0], 200]
    return np.flatnonzero(column.astype(int).sum(axis=-1) < 200) + PLAN[0].start


def test_a_body_is_drawn_larger_in_motion_but_not_in_its_steady_shift(renderer):
    """A shift of 50 mm would be 1.25 m, drawn 25 times larger."""
    gauge = 34.0  # pixels of half the gauge, 0.7176 m
    rows = [edge_rows(renderer.draw(whole_vehicle(bodies=moved(y=y)))).mean() for y in (0.0, 0.01)]
    middle = 76 + 280 / 2
    assert middle - rows[0] == pytest.approx(0.05 * gauge / 0.7176, abs=1.0)
    assert rows[0] - rows[1] == pytest.approx(25 * 0.01 * gauge / 0.7176, abs=1.0)


def test_a_body_stands_on_the_chord_between_its_bogies(renderer):
    """On a bent track the middle of the body is nearer to the inner side than the track there."""
    scenes = [whole_vehicle(curvature=k) for k in (0.0, 1 / 2000.0)]
    straight, bent = (edge_rows(renderer.draw(scene)).mean() for scene in scenes)
    drawn = plan.Plan(scenes[1])
    drop = (drawn.track(9.0 * drawn.scale, 0.0) - drawn.track(0.0, 0.0)).imag
    assert drop > 10.0
    assert bent - straight == pytest.approx(drop, abs=1.5)


def test_the_leading_bogie_is_seen_from_the_front_with_frame_and_body(renderer):
    front = (slice(80, 276), slice(640, 950))
    still = renderer.draw(whole_vehicle())[front]
    rolled = renderer.draw(whole_vehicle(bodies=moved(phi=0.004)))[front]
    top = [np.nonzero((f.astype(int).sum(axis=-1) < 200).any(axis=0))[0] for f in (still, rolled)]
    assert np.ptp(top[0]) == pytest.approx(168, abs=8)  # 1.4 m to each side
    assert (still != rolled).any()
    other = whole_vehicle().bodies.copy()
    other[5, 0] += 0.01  # the trailing frame is not in this view
    trailing = renderer.draw(whole_vehicle(bodies=other))[front]
    np.testing.assert_array_equal(trailing, still)
    other[4, 0] += 0.01
    assert (renderer.draw(whole_vehicle(bodies=other))[front] != still).any()


def test_two_wheelsets_and_a_frame_are_a_bogie(renderer):
    plain = make_scene()
    told = make_scene(wheelsets=(1.2, -1.2), outlines=(Outline(0.0, 1.2),))
    np.testing.assert_array_equal(renderer.draw(plain), renderer.draw(told))


def test_same_scene_gives_the_same_pixels(renderer):
    scene = make_scene(curvature=1 / 6250.0, critical_speed=120.0, bodies=make_bodies((2e-3, 1e-3)))
    first = renderer.draw(scene)
    renderer.draw(make_scene(bodies=make_bodies((-9e-3, 0.0)), derailed="wheel lift"))
    np.testing.assert_array_equal(renderer.draw(scene), first)
    np.testing.assert_array_equal(Renderer("rgb_array", fps=50).draw(scene), first)


def test_a_frame_is_not_changed_by_the_next_one(renderer):
    first = renderer.draw(make_scene())
    kept = first.copy()
    renderer.draw(make_scene(derailed="wheel lift"))
    np.testing.assert_array_equal(first, kept)


# -------------------------------------------------------------------- what they show


def test_displacement_to_the_left_moves_the_wheelset_up_in_the_plan(renderer):
    rows = []
    for y in (-6e-3, -3e-3, 0.0, 3e-3, 6e-3):
        frame = renderer.draw(make_scene(bodies=make_bodies((y, 0.0), frame=False)))
        rows.append(where(frame, colours.LEADING, PLAN)[0])
    assert (np.diff(rows) < 0.0).all()
    # drawn 25 times larger, with the half gauge as 58 pixels
    assert rows[0] - rows[-1] == pytest.approx(12e-3 * 25 * 58 / 0.7176, abs=1.5)


def test_trailing_wheelset_is_behind_the_leading_one(renderer):
    frame = renderer.draw(make_scene())
    behind, ahead = (where(frame, c, PLAN)[1] for c in (colours.TRAILING, colours.LEADING))
    assert behind < 295 < ahead


def test_yaw_to_the_left_turns_the_left_wheel_back(renderer):
    frame = renderer.draw(make_scene(bodies=make_bodies(yaw=(4e-3, 0.0), frame=False)))
    left = where(frame, colours.LEADING, (slice(90, 216), PLAN[1]))[1]
    right = where(frame, colours.LEADING, (slice(216, 340), PLAN[1]))[1]
    assert left < right - 5.0


@pytest.mark.parametrize(("side", "upper"), [(1.0, True), (-1.0, False)])
def test_wheel_turns_red_at_flange_contact(renderer, side, upper):
    free = renderer.draw(make_scene(bodies=make_bodies((side * (DELTA - 1e-5), 0.0))))
    touching = renderer.draw(make_scene(bodies=make_bodies((side * (DELTA + 1e-5), 0.0))))
    assert where(free, colours.ALARM, PLAN)[2] == 0
    row, _, n = where(touching, colours.ALARM, PLAN)
    assert n > 100
    assert (row < 126) == upper


def test_flange_contact_is_against_the_displaced_rail(renderer):
    scene = make_scene(bodies=make_bodies((DELTA + 1e-3, 0.0)), rail=np.array([2e-3, 0.0]))
    assert where(renderer.draw(scene), colours.ALARM, PLAN)[2] == 0


def test_rails_bend_with_curvature(renderer):
    """A positive curvature has its outer rail on the left, so the track bends down, to the right."""
    drops = []
    for curvature in (-1 / 500, -1 / 6250, 0.0, 1 / 6250, 1 / 500, 1 / 250):
        frame = renderer.draw(make_scene(curvature=curvature, bodies=make_bodies(frame=False)))
        drops.append(track_row(frame, 600) - track_row(frame, 310))
    assert (np.diff(drops) > 4.0).all()
    assert drops[2] == 0.0
    assert drops[3] > 8.0
    np.testing.assert_allclose(drops[:2], [-drops[4], -drops[3]], atol=1.5)


def test_sleepers_pass_to_the_left(renderer):
    row = 76 + 280 // 2 + 90
    later = plan.GROUND_SLOWDOWN * 0.05 / 85.0
    strips = [
        (renderer.draw(make_scene(time=t))[row, 470:600] == colours.SLEEPER).all(axis=-1)
        for t in (0.0, later)
    ]
    shift = round(0.05 * 58 / 0.7176)
    same = np.mean(strips[0][shift:] == strips[1][:-shift])
    assert same > 0.95 > np.mean(strips[0][:-shift] == strips[1][shift:])


def test_equilibrium_is_drawn_but_moves_no_wheel(renderer):
    bodies = make_bodies((2e-3, 2e-3))
    at_rest = renderer.draw(make_scene(bodies=bodies, equilibrium=bodies))
    moving = renderer.draw(make_scene(bodies=bodies, equilibrium=make_bodies((-5e-3, -5e-3))))
    assert (at_rest != moving).any()
    assert where(at_rest, colours.LEADING, PLAN)[0] == pytest.approx(
        where(moving, colours.LEADING, PLAN)[0], abs=1.0
    )


def test_critical_speed_is_green_below_and_red_above(renderer):
    header = (slice(0, 54), slice(None))
    scene = make_scene(critical_speed=100.0)
    below = renderer.draw(scene)
    above = renderer.draw(dataclasses.replace(scene, speed=110.0))
    without = renderer.draw(make_scene())
    found = [
        [where(frame, colour, header)[2] > 0 for colour in (colours.SAFE, colours.ALARM)]
        for frame in (below, above, without)
    ]
    assert found == [[True, False], [False, True], [False, False]]


def test_derailment_shows_a_banner_with_its_reason(renderer):
    area = (slice(56, 84), slice(10, 620))
    frames = [renderer.draw(make_scene(derailed=d)) for d in (None, "wheel lift", "Nadal")]
    red = [where(frame, colours.ALARM, area)[2] for frame in frames]
    assert red[0] == 0
    assert min(red[1:]) > 5000
    assert red[1] != red[2]


def test_action_is_drawn_only_when_there_is_one(renderer):
    below = (slice(500, 600), slice(None))
    counts = [
        where(renderer.draw(make_scene(history=make_history(actuators=n))), colours.SAFE, below)[2]
        for n in (0, 1)
    ]
    assert counts[0] == 0 < counts[1]


def test_long_history_keeps_its_extremes():
    time = 0.001 * np.arange(60_001)
    value = np.zeros(len(time))
    value[31_234] = 7.0
    value[41_234] = -6.0
    axes = chart.Axes(layout.Box(0, 0, 800, 100), 10.0, 60.0, 60.0, 10.0)
    x, y = chart.trace(axes, time, value)
    assert len(x) == len(y) < 1000
    assert y.min() == pytest.approx(50.0 - 35.0)
    assert y.max() == pytest.approx(50.0 + 30.0)
    assert (np.diff(x) >= 0.0).all()
    assert x[y.argmin()] == pytest.approx(31.234 / 60.0 * 800.0, abs=2.0)


# ----------------------------------------------------------------- life of a renderer


@needs_pygame
def test_arrays_need_no_display(monkeypatch):
    import pygame

    pygame.display.quit()
    monkeypatch.setenv("SDL_VIDEODRIVER", "there is none")
    Renderer("rgb_array", fps=50).draw(make_scene())
    assert not pygame.display.get_init()
    assert pygame.mixer is None or not pygame.mixer.get_init()


def test_close_twice_and_draw_again(renderer):
    first = renderer.draw(make_scene())
    renderer.close()
    renderer.close()
    np.testing.assert_array_equal(renderer.draw(make_scene()), first)


def test_closing_one_renderer_leaves_another(renderer):
    other = Renderer("rgb_array", fps=50)
    first = renderer.draw(make_scene())
    other.draw(make_scene())
    other.close()
    np.testing.assert_array_equal(renderer.draw(make_scene()), first)
    renderer.draw(make_scene(speed=12.3, time=4.56))


def test_survives_pygame_quit_elsewhere(renderer):
    """Other environments end pygame as a whole when they close."""
    import pygame

    renderer.draw(make_scene())
    pygame.quit()
    renderer.draw(make_scene(speed=77.7, time=1.11))
    pygame.quit()
    pygame.font.init()
    renderer.draw(make_scene(speed=66.6, time=2.22))


def test_copies_and_pickles(renderer):
    expected = renderer.draw(make_scene())
    for twin in (copy.deepcopy(renderer), pickle.loads(pickle.dumps(renderer))):
        assert (twin.mode, twin.fps, twin.size) == ("rgb_array", 50, (960, 600))
        np.testing.assert_array_equal(twin.draw(make_scene()), expected)


def test_human_mode_shows_frames_in_a_window(dummy_display):
    renderer = Renderer("human", fps=1000, size=(640, 400))
    assert renderer.draw(make_scene()) is None
    assert dummy_display.get_surface().get_size() == (640, 400)
    assert dummy_display.get_caption()[0] == "railenv"
    import pygame

    shown = pygame.surfarray.array3d(dummy_display.get_surface()).transpose(1, 0, 2)
    wanted = Renderer("rgb_array", fps=50, size=(640, 400)).draw(make_scene())
    np.testing.assert_array_equal(shown, wanted)
    renderer.close()
    renderer.close()
    assert not dummy_display.get_init()


def test_window_keeps_to_the_frame_rate(dummy_display):
    import time

    renderer = Renderer("human", fps=20, size=(640, 400))
    renderer.draw(make_scene())
    start = time.perf_counter()
    for _ in range(4):
        renderer.draw(make_scene())
    assert time.perf_counter() - start >= 0.18
    renderer.close()


def test_window_stays_until_the_last_renderer_closes(dummy_display):
    one, two = (Renderer("human", fps=1000, size=(640, 400)) for _ in range(2))
    arrays = Renderer("rgb_array", fps=50)
    for each in (one, two, arrays):
        each.draw(make_scene())
    arrays.close()
    one.close()
    assert dummy_display.get_surface() is not None
    two.draw(make_scene())
    two.close()
    assert not dummy_display.get_init()


def test_window_reopens_after_pygame_quit_elsewhere(dummy_display):
    import pygame

    renderer = Renderer("human", fps=1000, size=(640, 400))
    renderer.draw(make_scene())
    pygame.quit()
    renderer.draw(make_scene(speed=55.5))
    assert dummy_display.get_surface() is not None
    renderer.close()
