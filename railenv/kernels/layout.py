"""What the rows of a kernel's buffer hold."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Layout:
    """Rows of the flat buffer ``w[row * L + lane]``, by their first index.

    In order: states ``x``, inputs ``u``, running conditions ``c`` (speed, curvature, cant),
    parameters ``p``, the track at each body's place ``sites``, derivatives ``dx``, two rows per state
    of work space of the integrators, what is looked up in tables, signals ``o``, the nonzero entries of
    the Jacobian ``j``, and those of the derivatives by the parameters ``q``. Buffers that only
    integrate end before ``j``, those without derivatives by parameters before ``q``.
    """

    n_states: int
    n_inputs: int
    n_parameters: int
    n_entries: int
    n_signals: int = 0
    n_parameter_entries: int = 0
    n_lookups: int = 0
    n_sites: int = 0

    @property
    def x(self) -> int:
        """First row of the states."""
        return 0

    @property
    def u(self) -> int:
        """First row of the inputs."""
        return self.n_states

    @property
    def c(self) -> int:
        """First row of the running conditions."""
        return self.u + self.n_inputs

    @property
    def p(self) -> int:
        """First row of the parameters."""
        return self.c + 3

    @property
    def sites(self) -> int:
        """First row of how the track at each body's place differs from that at the origin."""
        return self.p + self.n_parameters

    @property
    def dx(self) -> int:
        """First row of the derivatives."""
        return self.sites + self.n_sites

    @property
    def work(self) -> int:
        """First row of the integrators' work space."""
        return self.dx + self.n_states

    @property
    def lookups(self) -> int:
        """First row of what is looked up in tables: arguments and values."""
        return self.work + 2 * self.n_states

    @property
    def o(self) -> int:
        """First row of the signals."""
        return self.lookups + self.n_lookups

    @property
    def j(self) -> int:
        """First row of the Jacobian's entries."""
        return self.o + self.n_signals

    @property
    def rows(self) -> int:
        """Number of rows, the Jacobian's included."""
        return self.j + self.n_entries

    @property
    def q(self) -> int:
        """First row of the derivatives by the parameters."""
        return self.rows

    @property
    def all_rows(self) -> int:
        """Number of rows, the derivatives by the parameters included."""
        return self.rows + self.n_parameter_entries
