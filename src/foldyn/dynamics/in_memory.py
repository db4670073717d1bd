"""Base of motions that are computed in memory, also where their result goes to a file."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from foldyn.dynamics.progress import Reporter, reported

if TYPE_CHECKING:
    import xarray

    from foldyn.dynamics.checkpoint import Keeping


class InMemory:
    """A motion without checkpoints.

    Attributes
    ----------
    kind : str
        The method, as it is told where the motion would replace an interrupted one.
    """

    kind: ClassVar[str]

    def finished(self, keeping: Keeping) -> None:
        """No stored result: the motion is computed again."""

    def run_into_file(
        self, keeping: Keeping, progress: bool | Reporter | None = None
    ) -> xarray.Dataset:
        """Compute the motion and write its result to its file."""
        with keeping.held():
            return keeping.save_result(self.run(progress, keeping))

    def run(
        self, progress: bool | Reporter | None = None, keeping: Keeping | None = None
    ) -> xarray.Dataset:
        """Compute the motion; see `driver.simulate`.

        `keeping` has nothing to keep of it, but refuses to replace an interrupted motion.
        """
        if keeping is not None:
            keeping.begin({"method": self.kind}, {})
        with reported(progress) as report:
            return self._computed(report)

    def _computed(self, report: Reporter) -> xarray.Dataset:
        raise NotImplementedError
