"""What a renderer is shown of an environment."""

import numpy as np
import pytest

from railenv.envs.showing import Past


@pytest.mark.parametrize("n", [0, 1, 4, 5, 9, 10, 11, 15, 16, 57])
def test_the_past_holds_the_last_steps_in_order(n):
    past = Past(5, n_actuators=1, n_wheelsets=2)
    for k in range(n):
        past.add(0.1 * k, np.array([0.01 * k]), np.array([k, -k]))
    held = np.arange(max(0, n - 5), n)
    history = past.history()
    np.testing.assert_allclose(history.time, 0.1 * held)
    np.testing.assert_allclose(history.action, 0.01 * held[:, None])
    np.testing.assert_allclose(history.y, held[:, None] * [1.0, -1.0])
    past.clear()
    assert past.history().y.shape == (0, 2)


def test_a_history_does_not_change_with_later_steps():
    past = Past(2, n_actuators=0, n_wheelsets=1)
    past.add(0.0, np.zeros(0), np.array([1.0]))
    history = past.history()
    for k in range(1, 6):
        past.add(float(k), np.zeros(0), np.array([0.0]))
    np.testing.assert_array_equal(history.y, [[1.0]])
