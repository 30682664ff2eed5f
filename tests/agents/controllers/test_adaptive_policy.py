"""Policies that an identifier tells the vehicle: the same as known ones, and their files."""

import dataclasses

import numpy as np
import pytest

import agents
import design
import railenv
from agents.controllers.adaptive_policy import told_inputs
from agents.controllers.memory import Memory, MemorySettings
from agents.controllers.network import Network, Normalization
from railenv.errors import ParameterError, UnknownNameError

BANK = [{"conicity": c, "creep_factor": k} for c in (0.05, 0.4) for k in (0.6, 1.4)]
MEMORY = MemorySettings(corners=(0.2, 2.0))
WORN = {"conicity": 0.3, "creep_factor": 0.8}


@pytest.fixture(scope="module")
def bogie():
    return railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW))


@pytest.fixture(scope="module")
def identifier(bogie):
    return agents.AdaptiveLQG.design(bogie, speeds=[60.0, 120.0], vehicles=BANK)


def network(identifier, *, odd=True, seed=0):
    """Return a small network with random weights."""
    inner = Memory(MEMORY, identifier.readings, identifier.commands, identifier.period)
    signs = np.concatenate([inner.signs, np.ones(2)])
    rng = np.random.default_rng(seed)
    return Network(
        weights=(rng.normal(size=(8, len(signs))), rng.normal(size=(1, 8))),
        biases=(rng.normal(size=8), np.zeros(1)),
        activation="tanh",
        squash="tanh",
        normalization=Normalization(np.zeros(len(signs)), np.full(len(signs), 2.0), 1e6),
        signs=signs if odd else None,
    )


@pytest.fixture
def policy(identifier):
    return agents.AdaptivePolicy(network(identifier), identifier, MEMORY)


def observations(policy, count, steps):
    rng = np.random.default_rng(1)
    for _ in range(steps):
        y = 0.1 * rng.normal(size=(count, len(policy.readings)))
        y[:, 2] = 90.0 / policy.readings[2].scale
        yield y


def test_told_the_truth_it_is_the_known_policy(policy, monkeypatch):
    known = policy.knowing(WORN)
    monkeypatch.setattr(policy.identifier, "estimate", lambda name: np.full(3, WORN[name]))
    policy.reset(3)
    known.reset(3)
    for y in observations(policy, 3, 20):
        np.testing.assert_allclose(policy.act(y), known.act(y), rtol=1e-12, atol=1e-14)
    assert known.about["told"] == WORN


def test_it_is_told_what_its_identifier_finds(identifier):
    """A network that reads nothing else returns the estimate."""
    plain = network(identifier, odd=False)
    first = np.zeros_like(plain.weights[0])
    first[0, -2] = 1e-3  # within the linear part of tanh
    last = np.zeros((1, 8))
    last[0, 0] = 1e3
    reading = dataclasses.replace(
        plain, weights=(first, last), biases=(np.zeros(8), np.zeros(1)), squash="none"
    )
    policy = agents.AdaptivePolicy(reading, identifier, MEMORY)
    policy.reset(4)
    alone = agents.AdaptiveLQG.from_file(identifier.to_file())
    alone.reset(4)
    for y in observations(policy, 4, 30):
        shares = policy.act(y)
        alone.observe(y)
        alone.advance(shares)
        expected = (alone.estimate("conicity") - 0.225) / 0.35  # half of -1 to 1: the scale is 2
        np.testing.assert_allclose(shares[:, 0], expected, atol=1e-5)
    assert (np.abs(expected) > 0.1).all()  # at first it is 0, the middle of the bank


def test_one_vehicle_is_the_same_as_one_of_many(policy):
    rows = list(observations(policy, 2, 5))
    policy.reset(2)
    many = [policy.act(y)[1] for y in rows]
    policy.reset()
    for y, share in zip(rows, many, strict=True):
        np.testing.assert_allclose(policy.act(y[1]), share, rtol=1e-12)


def test_its_identifier_is_its_own(identifier):
    first, second = (agents.AdaptivePolicy(network(identifier), identifier, MEMORY) for _ in range(2))
    first.reset(2)
    second.reset(5)
    assert first.act(next(observations(first, 2, 1))).shape == (2, 1)


def test_a_known_policy_is_linearised(bogie, policy):
    loop = design.closed_loop(bogie.replace(**WORN), policy.knowing(WORN), speed=80.0)
    assert loop.system.dt == pytest.approx(policy.period)
    np.testing.assert_allclose(loop.commands, 0.0, atol=1e-9)  # the network is odd


def test_a_file_gives_back_its_equal(policy, tmp_path):
    policy.about["seed"] = 3
    policy.save(tmp_path / "policy.npz")
    again = agents.load(tmp_path / "policy.npz")
    assert isinstance(again, agents.AdaptivePolicy)
    assert again.about == {"seed": 3}
    policy.reset(2)
    again.reset(2)
    for y in observations(policy, 2, 10):
        np.testing.assert_array_equal(policy.act(y), again.act(y))
    content = policy.to_file()
    del content.header["identifier"]
    with pytest.raises(ParameterError, match="AdaptivePolicy is damaged"):
        agents.AdaptivePolicy.from_file(content)


def test_a_known_vehicle_has_all_numbers_and_no_others(policy):
    with pytest.raises(ParameterError, match="creep_factor is missing"):
        policy.knowing({"conicity": 0.1})
    with pytest.raises(UnknownNameError, match="wear"):
        policy.knowing({**WORN, "wear": 0.5})


def test_what_does_not_fit_is_told(identifier):
    with pytest.raises(ParameterError, match="history of the memory is 2"):
        agents.AdaptivePolicy(network(identifier), identifier, MemorySettings(history=2))
    with pytest.raises(ParameterError, match=r"conicity, creep_factor\) and 1"):
        agents.AdaptivePolicy(network(identifier), identifier, MemorySettings(corners=(1.0,)))


def test_numbers_that_all_vehicles_share_are_not_told(bogie):
    same = [{"conicity": c, "creep_factor": 1.0} for c in (0.1, 0.3)]
    np.testing.assert_allclose(told_inputs(same, {"conicity": np.array([0.2])}), [[0.0]], atol=1e-12)
    alike = agents.AdaptiveLQG.design(bogie, speeds=[80.0], vehicles=[same[0]] * 2)
    with pytest.raises(ParameterError, match="must differ in a number"):
        agents.AdaptivePolicy(network(alike), alike, MEMORY)


def test_a_known_number_is_finite(policy):
    with pytest.raises(ParameterError, match="conicity is nan"):
        policy.knowing({**WORN, "conicity": float("nan")})


def test_numbers_are_scaled_over_the_bank():
    ends = {"conicity": np.array([0.05, 0.4, 0.225]), "creep_factor": np.array([0.6, 1.4, 1.2])}
    np.testing.assert_allclose(told_inputs(BANK, ends), [[-1.0, -1.0], [1.0, 1.0], [0.0, 0.5]])
