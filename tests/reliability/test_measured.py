"""Long runs and sensitivities, in a short form."""

import mmap

import pytest

from benchmarks.reliability import sensitivity, soak


@pytest.mark.parametrize("run", [soak.single, soak.vector])
def test_memory_stays_flat_over_episodes(run):
    found = run(60.0)
    assert found.episodes >= 3
    assert abs(found.growth) < 4.0
    assert found.simulated == 60.0 * (soak.VEHICLES if run is soak.vector else 1)


def test_a_run_that_keeps_memory_is_noticed():
    kept = []

    def keep():
        kept.append(mmap.mmap(-1, 2**20))  # new pages, not what the allocator had left over
        kept[-1].write(b"x" * 2**20)

    first, memory, _ = soak._watched(keep, 40)
    assert memory[-1] - memory[0] > 20.0
    assert memory[-1] > first


def test_time_step_moves_results_by_less_than_the_page_says():
    made = dict(sensitivity.rows(steps=(0.0005, 0.001), duration=12.0))
    found = {what: measure() for what, measure in made.items() if not what.startswith("DOP853")}
    exact = found.pop("eigenvalues; cycle by shooting")
    for what, row in found.items():
        coarse = "float32" in what
        assert row.growth == pytest.approx(exact.growth, rel=0.5 if coarse else 0.02), what
        assert row.critical == pytest.approx(exact.critical, rel=0.02 if coarse else 1e-3), what
        assert row.amplitude == pytest.approx(exact.amplitude, rel=1e-3), what
    assert found["RK4, 0.5 ms"].growth == pytest.approx(exact.growth, rel=1e-4)
    assert found["RK4, 1 ms"].critical == pytest.approx(exact.critical, abs=1e-3)


def test_shorter_control_periods_approach_continuous_control():
    speeds = [sensitivity.period_row(period).linear for period in (0.0005, 0.001, 0.002)]
    assert speeds[2] - speeds[1] == pytest.approx(2.0 * (speeds[1] - speeds[0]), rel=0.1)
