"""The creep law of the paper beside Kalker's simplified theory and beside Polach's law."""

from __future__ import annotations

from markupsafe import Markup

from design.reproduction.cases import COACH
from design.reproduction.creep import CROWN_RADIUS, FLANGE, FLANGE_ANGLE, TREAD, creep_laws
from design.reproduction.document import fragment
from design.reproduction.drawing import legend_below, panel, retitle
from design.reproduction.section import Data, DataTable, Drawing, Section, significant
from design.reproduction.store import Piece
from railenv.contact.creep_comparison import CreepComparison, Direction
from railenv.contact.creep_laws import LAWS
from railenv.contact.creep_plots import plot_forces

_PANELS: tuple[tuple[Direction, int, str], ...] = (
    ("longitudinal", 0, "without spin"),
    ("lateral", 0, "without spin"),
    ("lateral", TREAD, "spin of the tread"),
    ("lateral", FLANGE, "spin of a flange"),
)


class Creep(Section):
    """Creep forces by each law, for the coach's wheel."""

    key = "creep"
    title = "The creep law beside Kalker's simplified theory"

    def pieces(self) -> tuple[Piece, ...]:
        """Return the laws on the coach's wheel."""
        return (creep_laws(COACH),)

    def text(self, data: Data) -> Markup:
        """Return the patch and the table of differences."""
        found = self._found(data)
        patch, f = found.patch, found.patch.creep_coefficients
        vehicle = COACH.vehicle
        paragraphs = [
            f"{vehicle.name}: a wheel under {patch.load / 1e3:.1f} kN on a rail with a crown of "
            f"{CROWN_RADIUS:g} m touches it in an ellipse with semi-axes of "
            f"{1e3 * patch.rolling:.1f} mm in the rolling direction and "
            f"{1e3 * patch.lateral:.1f} mm across it (Hertz). Kalker's "
            f"coefficients of this patch are f33 = {f.longitudinal_creep / 1e6:.2f} MN, f11 = "
            f"{f.lateral_creep / 1e6:.2f} MN, f12 = {f.lateral_spin_creep / 1e3:.1f} kN m, f22 = "
            f"{f.spin_creep:.1f} N m²; Table 1 has {vehicle.longitudinal_creep / 1e6:.2f} MN, "
            f"{vehicle.lateral_creep / 1e6:.2f} MN, {vehicle.lateral_spin_creep / 1e3:.1f} kN m and "
            f"{vehicle.spin_creep:.1f} N m².",
            "The heuristic law of eqs 2 and 3 and Polach's law saturate Kalker's linear forces; "
            "FASTSIM is Kalker's simplified theory. The spin of the tread is that of its conicity; "
            "the flange has "
            f"a contact angle of {FLANGE_ANGLE:g} degrees.",
        ]
        rows = [
            (
                f"{direction}, {where}",
                *(f"{found.deviation(law, direction, found.spin[i]):.1%}" for law in LAWS[1:3]),
            )
            for direction, i, where in _PANELS
        ]
        return fragment(
            "table.html",
            paragraphs=paragraphs,
            caption="Largest difference from FASTSIM, of the adhesion limit μN.",
            header=("creep force", "heuristic", "Polach"),
            rows=rows,
            words=1,
        )

    def draw(self, data: Data) -> tuple[Drawing, ...]:
        """Draw the forces."""
        found = self._found(data)
        drawings = []
        for direction, i, where in _PANELS:
            figure, ax = panel("", 4.0)
            plot_forces(found, direction, i, ax)
            retitle(ax, f"{direction} force, {where}")
            legend_below(figure, ax.get_lines())
            name = f"creep_{direction}_{('no_spin', 'tread', 'flange')[i]}"
            caption = f"{direction.capitalize()} creep force over creepage, {where}."
            drawings.append(Drawing(name, figure, caption, "Creep laws, the coach's wheel"))
        return tuple(drawings)

    def tables(self, data: Data) -> tuple[DataTable, ...]:
        """Return the forces by all laws."""
        found = self._found(data)
        header = ("direction", "spin_1_per_m", "creepage", *(f"{law}_N" for law in LAWS))
        rows = []
        for direction, i, _ in _PANELS:
            forces = found.longitudinal if direction == "longitudinal" else found.lateral
            rows += [
                (
                    direction,
                    found.spin[i],
                    significant(x),
                    *(significant(forces[law][i, k]) for law in LAWS),
                )
                for k, x in enumerate(found.creepage)
            ]
        return (DataTable("creep_laws", header, rows),)

    def _found(self, data: Data) -> CreepComparison:
        found: CreepComparison = data[self.pieces()[0].name]
        return found
