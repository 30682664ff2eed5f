"""The examples about offline data write data sets and learn from them."""

import numpy as np
import pytest

pytest.importorskip("minari")

import minari

import agents
from examples import offline_datasets


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Mean returns of four small data sets, which lie where Minari looks."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MINARI_DATASETS_PATH", str(tmp_path_factory.mktemp("datasets")))
        yield offline_datasets.make_datasets(
            "railenv/Bogie-v1", agents.shipped("output-feedback"), episodes=3
        )


def test_data_sets_are_of_what_their_names_say(written):
    assert written["random"] < written["mediocre"] < written["expert"]
    assert sorted(minari.list_local_datasets()) == [
        f"railenv/bogie/{name}-v0" for name in sorted(offline_datasets.DATASETS)
    ]
    for name, value in written.items():
        dataset = minari.load_dataset(f"railenv/bogie/{name}-v0")
        returns = [episode.rewards.sum() for episode in dataset.iterate_episodes()]
        assert np.mean(returns) == pytest.approx(value)
        assert dataset.storage.metadata["ref_max_score"] == written["expert"]


def test_the_environment_of_a_data_set_does_the_same_again(written):
    dataset = minari.load_dataset("railenv/bogie/mediocre-v0")
    env = dataset.recover_environment()
    for k, episode in enumerate(dataset.iterate_episodes()):
        observation, _ = env.reset(seed=k)
        assert np.array_equal(observation, episode.observations[0])
        for action, reward in zip(episode.actions, episode.rewards, strict=True):
            assert env.step(action)[1] == reward


def test_a_controller_of_another_vehicle_is_refused():
    with pytest.raises(ValueError, match="another vehicle"):
        offline_datasets.make_env("railenv/DualWheelset-v1", agents.shipped("output-feedback"))


def test_learning_from_a_data_set(written, tmp_path):
    torch = pytest.importorskip("torch")
    from examples import learn_offline

    dataset = minari.load_dataset("railenv/bogie/expert-v0")
    env = dataset.recover_environment()
    signs = learn_offline.mirror_signs(env)
    actor = learn_offline.learn(dataset, signs, learn_offline.Options(updates=600))
    policy = learn_offline.controller(actor, env)
    policy.save(tmp_path / "policy.npz")
    observation, _ = env.reset(seed=5)
    acted = agents.load(tmp_path / "policy.npz").act(observation[: len(policy.readings)])
    with torch.no_grad():
        assert acted == pytest.approx(actor(torch.as_tensor(observation)).numpy(), abs=1e-5)
    x, action, *_ = learn_offline.transitions(dataset)
    with torch.no_grad():
        error = (actor(x) - action).square().mean()
        assert actor(-x * 0.0) == pytest.approx(np.zeros((len(x), 1)))
    assert error < 0.5 * action.square().mean()
