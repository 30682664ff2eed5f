"""TEMPORARY"""

from design.stability.critical_speed import critical_speed


def hopf_points(model, **k):
    c = critical_speed(model, **k)
    return (c,) if c.loss == "hunting" else ()
