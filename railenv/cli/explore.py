"""``railenv explore``: a page in the browser on which one moves a vehicle's numbers."""

from __future__ import annotations

from typing import Annotated

import typer

from railenv.cli.common import err, out
from railenv.cli.options import CurveOptions, VehicleModelName, VehicleOption, with_groups
from railenv.extras import require


@with_groups
def explore(
    *,
    vehicle: VehicleOption = "HIGH_SPEED_COACH_HOLLOW",
    model: Annotated[
        VehicleModelName,
        typer.Option("--model", "-m", help="Bogie, dual wheelset or whole coach to begin with."),
    ] = "bogie",
    curve: CurveOptions,
    speed: Annotated[float, typer.Option("--speed", "-s", help="Speed to begin with, m/s.")] = 100.0,
    port: Annotated[int, typer.Option(help="Port of the page; 0 for any that is free.")] = 5006,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")
    ] = True,
) -> None:
    """Open a page that shows eigenvalues, motion, contact and limit cycles as you move numbers.

    Only browsers on this machine can reach it. Stop it with Ctrl-C.
    """
    require("panel", "Panel", "the Explorer", extra="explore")
    from railenv.explorer import server
    from railenv.explorer.state import State
    from railenv.vehicles.lookup import named

    state = State(vehicle=named(vehicle), kind=model, radius=curve.radius, cant=curve.cant, speed=speed)
    state.model()
    running = server.server(state, port)
    out.print(f"the Explorer is at {server.address(running)}", highlight=False, soft_wrap=True)
    err.print("stop it with Ctrl-C", highlight=False)
    server.run(running, browser=browser)
