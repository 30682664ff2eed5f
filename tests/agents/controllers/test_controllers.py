"""The controller interface: running, batches, files, linearisation."""

import io
import math
import zipfile

import gymnasium as gym
import numpy as np
import pytest

import agents
import design
import railenv
from agents.controllers.files import ControllerFile, write
from railenv.errors import ParameterError, UnknownNameError


@pytest.fixture(scope="module")
def coach():
    return railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH))


def make(kind, coach):
    return {
        "passive": lambda: agents.Passive.design(coach),
        "yaw rate": lambda: agents.YawRateFeedback.design(coach, gain=1e5),
        "lqr": lambda: agents.LQR.design(coach, speeds=[80.0, 120.0, 160.0]),
        "lqg": lambda: agents.LQG.design(coach, speeds=[80.0, 130.0]),
        "h-infinity": lambda: agents.HInfinity.design(coach, speeds=[80.0, 130.0]),
        "output feedback": lambda: agents.OutputFeedback.design(
            coach,
            speeds=[60.0, 140.0],
            gains=[[[1e3, 2e4, -5e4, -1e6]], [[8e2, 1e4, -1e5, -1e6]]],
        ),
    }[kind]()


KINDS = ["passive", "yaw rate", "lqr", "lqg", "h-infinity", "output feedback"]


def observations(controller, count, seed=0):
    rng = np.random.default_rng(seed)
    rows = 0.02 * rng.normal(size=(count, len(controller.readings)))
    names = [reading.name for reading in controller.readings]
    rows[:, names.index("speed")] = rng.uniform(0.7, 1.7, size=count)
    return rows.astype(np.float32)


@pytest.mark.parametrize("kind", KINDS)
def test_a_batch_does_what_single_controllers_do(coach, kind):
    batch, single = make(kind, coach), make(kind, coach)
    batch.reset(3)
    speeds = observations(batch, 3)[:, [r.name for r in batch.readings].index("speed")]
    steps = [observations(batch, 3, seed) for seed in range(6)]
    for step in steps:
        step[:, [r.name for r in batch.readings].index("speed")] = speeds
    together = np.array([batch.act(step) for step in steps])
    for i in range(3):
        single.reset()
        alone = np.array([single.act(step[i]) for step in steps])
        np.testing.assert_allclose(alone, together[:, i], rtol=1e-12, atol=1e-15)
    batch.reset(3)
    np.testing.assert_array_equal(batch.act(steps[0]), together[0])
    assert np.abs(together).max() <= 1.0


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_gives_back_its_equal(coach, kind, tmp_path):
    controller = make(kind, coach)
    path = tmp_path / "controller.npz"
    controller.save(path)
    again = agents.load(path)
    assert type(again) is type(controller)
    assert again.about == controller.about
    assert again.observation == controller.observation
    for name in ("speeds", "A", "B", "C", "D", "E"):
        np.testing.assert_array_equal(getattr(again.law, name), getattr(controller.law, name))
    assert type(controller).load(path).readings == controller.readings
    np.testing.assert_array_equal(
        again.act(observations(again, 1)[0]), controller.act(observations(again, 1)[0])
    )


@pytest.mark.parametrize("kind", KINDS)
def test_linearisation_predicts_what_it_does_to_small_signals(coach, kind):
    controller = make(kind, coach)
    names = controller.input_labels
    signals = np.zeros(len(names))
    signals[names.index("speed")] = 95.0
    system = controller.linearize(signals)
    rng = np.random.default_rng(2)
    scales = np.array([reading.scale for reading in controller.readings])
    controller.reset()
    z = np.zeros(system.nstates)
    for _ in range(5):
        y = 1e-3 * scales * rng.normal(size=len(names))
        y[names.index("speed")] = 95.0
        without_speed = y.copy()
        predicted = system.C @ z + system.D @ without_speed
        z = system.A @ z + system.B @ without_speed
        moment = controller.act(y / scales) * controller.limit
        np.testing.assert_allclose(moment, predicted, rtol=1e-9, atol=1e-9)


def test_an_observer_is_told_the_moment_that_was_applied(coach):
    """Beyond the limit the filter of an LQG goes on with the limited moment, not the commanded."""
    controller = make("lqg", coach)
    big = observations(controller, 1)[0]
    big[0] = 9.0  # accelerometer
    controller.reset()
    assert abs(controller.act(big)[0]) == 1.0
    _, B, _, D, E = controller.law.at_one(100.0 * float(big[2]))
    y = big.astype(float) * [reading.scale for reading in controller.readings]
    expected = B @ y + E @ (np.sign(D @ y) * controller.limit)
    np.testing.assert_allclose(controller._z[0], expected, rtol=1e-12)


@pytest.mark.parametrize("kind", ["yaw rate", "lqr", "lqg", "h-infinity", "output feedback"])
def test_linear_critical_speed_is_where_the_environment_turns_to_growth(coach, kind):
    controller = make(kind, coach)
    for conicity in (0.05, 0.3):
        model = coach.replace(conicity=conicity)
        found = design.critical_speed(model, controller=controller, speed_range=(40.0, 300.0))
        if found.loss != "hunting":
            continue
        simulated = agents.simulated_critical_speed(
            coach, controller, found.speed, vehicle={"conicity": conicity}
        )
        assert simulated == pytest.approx(found.speed, rel=5e-3)


def test_h_infinity_is_odd_and_rests_where_nothing_changes():
    """Steady readings (of a curve, of a sensor's offset) command no moment."""
    controller = agents.shipped("h-infinity")
    rng = np.random.default_rng(1)
    speed = [r.name for r in controller.readings].index("speed")
    rows = 0.02 * rng.normal(size=(40, len(controller.readings)))
    rows[:, speed] = 0.9
    mirrored = -rows
    mirrored[:, speed] = 0.9
    controller.reset()
    there = np.array([controller.act(row) for row in rows])
    controller.reset()
    np.testing.assert_allclose([controller.act(row) for row in mirrored], -there, atol=1e-12)
    signals = np.array([0.3, 0.01, 90.0, 0.1])
    limit = controller.limits[0]
    assert abs(controller.steady(signals)[0]) < 1e-4 * limit
    # what cant deficiency puts into the accelerometer is taken out at once
    law = controller.law.at_one(90.0)
    names = controller.input_labels
    known = law[3][0, names.index("cant_deficiency")] / law[3][0, names.index("accel_b")]
    assert known == pytest.approx(9.81, rel=1e-2)


@pytest.mark.parametrize("radius", [math.inf, 4000.0])
def test_shipped_h_infinity_is_stable_at_and_between_its_speeds(radius):
    hollow = railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW))
    controller = agents.shipped("h-infinity")
    for speed in (20.0, 40.0, 60.0, 80.0):
        loop = design.closed_loop(hollow, controller, speed=speed, radius=radius, cant=0.05)
        assert loop.stable
        assert abs(loop.commands[0]) < 1e-3 * controller.limits[0]


def test_full_state_lqr_pushes_the_critical_speed_far_beyond_the_passive_one(coach):
    passive = design.critical_speed(coach).speed
    lqr = agents.LQR.design(coach, speed=160.0)
    found = design.critical_speed(coach, controller=lqr, speed_range=(20.0, 2.6 * passive))
    assert found.loss == "none"
    assert agents.disturbed_critical_speed(coach, lqr, speed_range=(20.0, 300.0)) >= 2.5 * passive


def test_lqr_rests_on_a_curve_that_its_vehicle_runs_on(coach):
    lqr = agents.LQR.design(coach, speed=80.0)
    loop = design.closed_loop(coach, lqr, speed=80.0, radius=8000.0, cant=0.05)
    assert abs(loop.commands[0]) < 0.03 * coach.actuator.limit
    assert loop.stable


def test_controllers_print_as_one_line():
    assert str(agents.shipped("lqg-scheduled")) == (
        "LQG: laws for 20 to 240 m/s from sensors to command_b, order 26, within 26000 N m, every 5 ms"
    )
    assert str(agents.shipped("lqr")).startswith("LQR: one law from full state to command_b, order 0")


def test_a_controller_of_ones_own_is_a_class_with_two_methods(coach):
    class Damper(agents.Controller):
        def reset(self, count=None):
            self.mean = 0.0

        def act(self, observation):
            gyro = 0.2 * observation[..., 1]
            self.mean = self.mean + 0.005 * (gyro - self.mean)
            return (-1e5 / 26e3 * (gyro - self.mean))[..., None]

    env = gym.make("railenv/Bogie-v1", observation="sensors", disable_env_checker=True)
    observation, _ = env.reset(seed=0, options={"speed": 100.0, "radius": float("inf")})
    damper = Damper()
    damper.reset()
    assert env.action_space.contains(damper.act(observation).astype(np.float32))
    assert damper.observation == "sensors"
    assert agents.simulated_critical_speed(coach, damper, 145.0, width=0.1) > 130.0
    with pytest.raises(ParameterError, match="Damper does not say how it is saved"):
        damper.save("x.npz")


def test_observations_of_another_number_of_vehicles_are_refused(coach):
    controller = make("passive", coach)
    controller.reset(2)
    with pytest.raises(ParameterError, match="was reset for 2 vehicles"):
        controller.act(observations(controller, 3))
    controller.reset()
    with pytest.raises(ParameterError, match="was reset for one vehicle"):
        controller.act(observations(controller, 2))


@pytest.mark.parametrize("kind", KINDS)
def test_any_finite_observation_gives_an_action_within_the_limit_and_others_are_refused(coach, kind):
    controller = make(kind, coach)
    size = len(controller.readings)
    for value in (1.7e308, -1e300, 1e12):
        controller.reset()
        for _ in range(3):
            shares = controller.act(np.full(size, value))
            assert (np.abs(shares) <= 1.0).all()
    for wrong in (np.full(size, np.nan), np.full(size, np.inf), ["x"] * size, None, np.zeros(size + 1)):
        with pytest.raises(ParameterError, match="observation"):
            controller.act(wrong)
    with pytest.raises(ParameterError, match="count is -1"):
        controller.reset(-1)


def test_damaged_and_foreign_files_are_refused(coach, tmp_path):
    path = tmp_path / "controller.npz"
    make("lqg", coach).save(path)
    whole = path.read_bytes()
    for content in (b"", b"not a file", whole[: len(whole) // 2], whole[:-20]):
        path.write_bytes(content)
        with pytest.raises(ParameterError, match="is not a controller's file, or is damaged"):
            agents.load(path)
    np.savez(path, header=np.array("{}"), A=np.zeros(2))
    with pytest.raises(ParameterError, match="is not a controller's file"):
        agents.load(path)
    write(path, ControllerFile("Passive", {}, {}))
    with pytest.raises(ParameterError, match="lacks speeds, A, B, C, D, E"):
        agents.load(path)
    law = make("passive", coach).law
    arrays = {name: getattr(law, name) for name in ("speeds", "A", "B", "C", "D", "E")}
    write(path, ControllerFile("Passive", {"limit": 1.0}, arrays))
    with pytest.raises(ParameterError, match="is damaged: KeyError"):
        agents.load(path)
    write(path, ControllerFile("Sorcery", {}, {}))
    with pytest.raises(UnknownNameError, match="Sorcery"):
        agents.load(path)
    make("passive", coach).save(path)
    with pytest.raises(UnknownNameError, match="Passive"):
        agents.LQG.load(path)
    with pytest.raises(FileNotFoundError):
        agents.load(tmp_path / "absent.npz")


def test_no_pickle_in_a_file_is_ever_loaded(tmp_path):
    class Bomb:
        def __reduce__(self):
            return print, ("executed",)

    path = tmp_path / "bomb.npz"
    buffer = io.BytesIO()
    np.save(buffer, np.array([Bomb()], dtype=object), allow_pickle=True)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("header.npy", buffer.getvalue())
    with pytest.raises(ParameterError, match="allow_pickle=False"):
        agents.load(path)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (agents.LQR.design, "give one of them"),
        (lambda m: agents.LQR.design(m, speed=100.0, speeds=[90.0]), "give one of them"),
        (agents.HInfinity.design, "give one of them"),
        (lambda m: agents.HInfinity.design(m, speed=100.0, slack=0.9), "slack is 0.9"),
        (lambda m: agents.YawRateFeedback.design(m, gain=float("nan")), "gain is nan"),
        (lambda m: agents.YawRateFeedback.design(m, gain=1.0, washout=-1.0), "washout is -1"),
        (lambda m: agents.OutputFeedback.design(m, speeds=[90.0], gains=[1.0]), "gains has shape"),
        (lambda m: agents.Filters(washout=0.0), "corner frequency washout is 0"),
        (lambda m: agents.Passive.design(railenv.HIGH_SPEED_COACH), "must be a railenv.Model"),
        (lambda m: agents.Passive.design(railenv.Equipped(m.plant, "none")), "no actuators"),
    ],
)
def test_impossible_designs_are_refused(coach, call, message):
    with pytest.raises(ParameterError, match=message):
        call(coach)


def test_a_dual_wheelset_is_controlled_too():
    model = railenv.Equipped(railenv.DualWheelset(railenv.TABLE_1), "primary")
    passive = design.critical_speed(model).speed
    controller = agents.YawRateFeedback.design(model, gain=2e4)
    found = design.critical_speed(model, controller=controller, speed_range=(5.0, 200.0))
    assert found.speed > passive
    # the two wheelsets hunt alike: it takes long until their growth is told from their beginning
    simulated = agents.simulated_critical_speed(model, controller, found.speed, duration=24.0)
    assert simulated == pytest.approx(found.speed, rel=5e-3)
