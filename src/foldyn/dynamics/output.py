"""The samples of a motion: all in memory, or the last ones if earlier ones are on disk."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.dynamics.audit import EnergyBalance, audited
from foldyn.dynamics.checkpoint import Keeping
from foldyn.dynamics.motion_state import Samples, StepPlan, samples
from foldyn.dynamics.sampling import Sampler
from foldyn.dynamics.timing import expected_samples
from foldyn.mechanics.heat import Heat
from foldyn.results import Quantity
from foldyn.results.columns import PIECE, Column, Columns, pieces

if TYPE_CHECKING:
    import xarray

LEAST = 16  # least number of samples in a window


class Output:
    """Room for the samples of a motion, and statistics of the samples written so far.

    Parameters
    ----------
    case : Case
    plan : StepPlan
    sampler : Sampler
        The user's quantities.
    branches : int
        Number of branches of laws with memory.
    keeping : Keeping, optional
        Destination of samples when their memory is full.
    heat : Heat, optional
        Heat, whose energy exchange with the sheet counts as energy at play.

    Attributes
    ----------
    window : Samples
        Room that compiled loops write to.
    balance : EnergyBalance
        Energy balance of all samples so far.
    names : tuple of str
        Names of the energies.
    """

    def __init__(
        self, case: Case, plan: StepPlan, sampler: Sampler, branches: int,
        keeping: Keeping | None = None, heat: Heat | None = None,
    ) -> None:  # fmt: skip
        self._heat = heat
        self._case, self._plan, self._sampler, self._branches = case, plan, sampler, branches
        self._keeping, self._air = keeping, case.air is not None
        self.names = audited(case.energy_groups, self._air)
        self._at_once = 1  # largest number of samples in a step
        if not plan.steps and not plan.every:
            self._at_once = math.floor(plan.dt / plan.interval) + 2
        self.balance = EnergyBalance(self._air)
        self.window = self._room(0)
        sampler.clear()

    def _room(self, count: int) -> Samples:
        structure = self._case.structure
        return samples(
            count, len(structure.nodes), len(self._case.reaction_dofs), len(self.names),
            self._branches,
        )  # fmt: skip

    def begin(self) -> None:
        """Make room for the expected samples, or for as many as the memory limit allows."""
        count = expected_samples(self._plan)
        if self._keeping is not None:
            row = sum(array.nbytes for array in self._room(1)[:-1])
            count = min(count, max(PIECE // row, LEAST, 2 * self._at_once))
        self.window = self._room(count)

    @property
    def rows(self) -> dict[str, tuple[int, ...]]:
        """Shapes of the parts of one sample, by name."""
        own = self.window._asdict()
        del own["first"]
        return {name: array.shape[1:] for name, array in own.items()} | self._sampler.rows

    # ------------------------------------------------------------------ while it runs
    def fits(self, length: int, steps: int, stored: int) -> int:
        """Number of steps, at most `length`, whose samples fit; makes room if no step fits.

        steps, stored : numbers of steps and samples so far.
        """
        if self._keeping is None:
            return length
        if self._window_fits(steps, stored) < 1 <= length:
            self.flush(stored)
        return max(0, min(length, self._window_fits(steps, stored)))

    def _window_fits(self, steps: int, stored: int) -> int:
        """Number of steps whose samples fit into the window."""
        if self._plan.steps:
            return self.window.end * self._plan.every - 1 - steps
        return (self.window.end - stored) // self._at_once

    def take(self, stored: int) -> None:
        """Evaluate the user's quantities at new samples; raises `SamplingError`."""
        self._sampler.take(self.window, stored)

    def update_balance(self, stored: int) -> EnergyBalance:
        """Return the energy balance after adding all new samples."""
        new = self.written(stored)
        seen = self.balance.count - new.first
        self.balance.add(new.energy[seen:], new.displacement[seen:])
        if self._heat is not None:
            self.balance.scale = max(self.balance.scale, float(self._heat.seen[1]))
        return self.balance

    def first_off(self, stored: int, limit: float) -> int:
        """Number of the first sample whose energy error exceeds a limit."""
        first = 0
        for energy, _ in self._energies(stored):
            off = self.balance.off(energy, limit)
            if off.any():
                return first + int(np.argmax(off))
            first += len(energy)
        return first

    def shorten(self, count: int) -> None:
        """Drop all samples after the first `count`."""
        if self._keeping is not None and self._keeping.begun:
            self._keeping.columns.cut(min(count, self._keeping.columns.count))
        self.balance = EnergyBalance(self._air)
        for energy, displacement in self._energies(count):
            self.balance.add(energy, displacement)

    def more_room(self, stored: int) -> None:
        """Make room for more samples."""
        if self._keeping is None:
            self.window = self.window.doubled()
        else:
            self.flush(stored)

    def flush(self, stored: int) -> None:
        """Write the samples to disk and empty the window."""
        assert self._keeping is not None
        out = self.written(stored)
        self.update_balance(stored)
        rows = out._asdict() | self._sampler.columns(stored)
        del rows["first"]
        self._keeping.append(rows)
        self.window = self.window._replace(first=stored)
        self._sampler.drop(stored)

    def checkpoint_arrays(self) -> dict[str, NDArray]:
        """Statistics of the samples on disk, for `resume_from`."""
        own = self.balance
        numbers = np.array([getattr(own, name) for name in EnergyBalance.NUMBERS])
        return {"balance_start": own.start, "balance": numbers}

    def resume_from(self, arrays: Mapping[str, NDArray], count: int) -> None:
        """Continue after `count` samples on disk, with the statistics in `arrays`."""
        self.window = self.window._replace(first=count)
        self._sampler.drop(count)
        own = self.balance
        own.start, own.count = arrays["balance_start"], count
        for name, value in zip(EnergyBalance.NUMBERS, arrays["balance"].tolist(), strict=True):
            setattr(own, name, value)

    # ------------------------------------------------------------------ what has been written
    def written(self, stored: int) -> Samples:
        """Samples in the window."""
        return self.window.until(max(stored, self.window.first))

    def displacement(self, stored: int) -> NDArray | Column:
        """Displacement of all samples (stored, n, 3), m."""
        columns = self._on_disk(stored)
        return self.written(stored).displacement if columns is None else columns["displacement"]

    def evenly_spaced(self, stored: int, most: int) -> tuple[NDArray, NDArray, NDArray]:
        """Displacement, velocity (k, n, 3) and energies (k, columns), as audited, at some samples.

        most : number of samples, from the first to the last, at most.
        """
        picks = np.unique(np.linspace(0, stored - 1, min(most, stored)).astype(np.int64))
        there: Any = self._on_disk(stored) or self.written(stored)._asdict()
        found = (there[name] for name in ("displacement", "velocity", "energy"))
        moved, moving, energy = (np.array([each[k] for k in picks.tolist()]) for each in found)
        return moved, moving, energy

    def time(self, sample: int) -> float:
        """Time (s) of a sample."""
        if sample >= self.window.first:
            return float(self.window.time[sample - self.window.first])
        assert self._keeping is not None
        return float(self._keeping.columns["time"][sample])

    def first(self, stored: int) -> tuple[Samples, dict[str, tuple[Quantity, NDArray]]]:
        """Samples with the user's quantities: all of them or, if they are on disk, the first."""
        columns, known = self._on_disk(stored), self._sampler.known
        if columns is None:
            own = self._sampler.columns(stored)
            return self.written(stored), {name: (known[name], own[name]) for name in own}
        shown = {name: columns[name][:1] for name in columns.names}
        return (
            Samples._make([*(shown[name] for name in Samples._fields[:-1]), 0]),
            {name: (quantity, shown[name]) for name, quantity in known.items()},
        )

    def whole(self, result: xarray.Dataset, stored: int) -> xarray.Dataset:
        """Complete a result made of `first` with all samples, read from disk on first use."""
        columns = self._on_disk(stored)
        if columns is None:
            return result
        assert self._keeping is not None
        self._keeping.check()
        lazy = {}
        for name, variable in result.data_vars.items():
            if "time" not in variable.dims:
                continue
            if name in self.names:
                every = columns.variable("energy", ("time", "column"))
                found = every[:, self.names.index(str(name))]
            else:
                found = columns.variable(str(name), tuple(map(str, variable.dims)))
            found.attrs = variable.attrs
            lazy[name] = found
        time = result["time"].variable
        coordinates: dict[Any, Any] = dict(result.drop_vars([*result.data_vars, "time"]).coords)
        coordinates["time"] = ("time", columns["time"][:], time.attrs)
        kept = {name: lazy.get(name, result[name].variable) for name in result.data_vars}
        return type(result)(kept, coordinates, result.attrs)

    def _on_disk(self, stored: int) -> Columns | None:
        """Columns on disk with all samples; None if samples are in memory."""
        keeping = self._keeping
        if keeping is None or not keeping.begun:
            return None
        if stored > keeping.columns.count:
            self.flush(stored)
        return keeping.columns

    def _energies(self, stored: int) -> Iterator[tuple[NDArray, NDArray]]:
        """Energies and displacements of all samples, in pieces."""
        if self.window.first:
            assert self._keeping is not None
            energy, moved = (self._keeping.columns[name] for name in ("energy", "displacement"))
            for rows in pieces(min(stored, len(energy)), moved[:1].nbytes):
                yield energy[rows], moved[rows]
        there = self.written(stored)
        yield there.energy, there.displacement
