"""The numbers behind the section on controllers, as tables for files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from agents.evaluation.evaluation import Evaluation
from design.reproduction import DataTable


def speeds(found: Sequence[Evaluation]) -> DataTable:
    """Return the critical speeds on every curve; no number if a loop has failed."""
    header = (
        "controller",
        "reads",
        "radius_m",
        "cant_rad",
        "linear_m_per_s",
        "loss",
        "frequency_hz",
        "disturbed_m_per_s",
        "ramp_m_per_s",
        "nonlinear_m_per_s",
        "deficiency_150_mm_m_per_s",
    )
    rows = [
        (
            each.controller,
            each.observation,
            curve.radius,
            curve.cant,
            curve.linear,
            curve.loss,
            curve.frequency,
            curve.disturbed,
            curve.ramp,
            curve.nonlinear,
            curve.deficiency_limit,
        )
        for each in found
        for curve in each.curves
    ]
    return DataTable("hopf_push", header, rows)


def robust(found: Sequence[Evaluation]) -> DataTable:
    """Return the robust critical speeds and the vehicles that determine them."""
    header = ("controller", "reads", "robust_m_per_s", "worst_conicity", "worst_creep_factor")
    names = ("conicity", "creep_factor")
    rows = [(e.controller, e.observation, e.robust, *map(e.worst.get, names)) for e in found]
    return DataTable("hopf_push_robust", header, rows)


def ride(found: Sequence[Evaluation]) -> DataTable:
    """Return results of runs on rough track with noisy sensors: moments, accelerations, safety."""
    units = {
        "speed": "speed_m_per_s",
        "moment_rms": "moment_rms_n_m",
        "moment_peak": "moment_peak_n_m",
        "acceleration_rms": "acceleration_rms_m_per_s2",
        "acceleration_peak": "acceleration_peak_m_per_s2",
        "cfr_213_333": "cfr_213_333_of_limit",
        "en_14363": "en_14363_of_limit",
        "derailed": "derailed",
    }
    rows = [(e.controller, *(run[name] for name in units)) for e in found for run in e.ride]
    return DataTable("hopf_push_ride", ("controller", *units.values()), rows)


def growth(rates: Mapping[str, Any]) -> DataTable:
    """Return the growth rates over speed."""
    rows = [
        (name, float(v), float(rate))
        for name, each in rates.items()
        for v, rate in zip(each["speeds"], each["rates"], strict=True)
    ]
    return DataTable("growth_rates", ("controller", "speed_m_per_s", "growth_rate_1_per_s"), rows)


def diagrams(diagrams: Sequence[Mapping[str, Any]]) -> DataTable:
    """Return the final amplitude of every simulated offset; infinite without an equilibrium."""
    header = ("controller", "offset_m", "speed_m_per_s", "amplitude_y_w1_m")
    rows = [
        (each["controller"], float(offset), float(v), float(left))
        for each in diagrams
        for offset, line in zip(each["offset"], each["amplitude"], strict=True)
        for v, left in zip(each["speed"], line, strict=True)
    ]
    return DataTable("closed_loop_diagrams", header, rows)


def frictions(found: Sequence[Evaluation]) -> DataTable:
    """Return the speeds up to which an offset dies out at other coefficients of friction."""
    header = ("controller", "radius_m", "cant_rad", "friction", "disturbed_m_per_s")
    rows = [
        (each.controller, curve.radius, curve.cant, float(mu), speed)
        for each in found
        for curve in each.curves
        for mu, speed in curve.disturbed_by_friction.items()
    ]
    return DataTable("hopf_push_friction", header, rows)


def delays(found: Sequence[Evaluation]) -> DataTable:
    """Return the critical speeds at other delays of the actuator."""
    header = ("controller", "delay_s", "linear_m_per_s", "robust_m_per_s")
    rows = [
        (each.controller, float(delay), linear, robust)
        for each in found
        for delay, (linear, robust) in each.delays.items()
    ]
    return DataTable("hopf_push_delay", header, rows)


def noises(found: Sequence[Evaluation]) -> DataTable:
    """Return the rms moments by the factor on noise and bias of the sensors."""
    rows = [(e.controller, float(factor), moment) for e in found for factor, moment in e.noises.items()]
    return DataTable("hopf_push_noise", ("controller", "noise_factor", "moment_rms_n_m"), rows)
