# SPDX-License-Identifier: GPL-3.0-or-later
"""How much work a fit may do: the same model and objective, more or fewer steps."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Work:
    """Work of a fit.

    starts : how many of STARTS are explored
    sweeps, explore_steps : alternating sweeps and joint steps for each of them
    finalists, final_steps : so many of the best go on with so many joint steps each
    refine_steps : joint steps at most for the best of those
    coarse : of anisotropic fits, joint steps before the best is chosen see and move every second
        azimuth only
    """

    starts: int
    sweeps: int
    explore_steps: int
    finalists: int
    final_steps: int
    refine_steps: int
    coarse: bool = field(default=False, kw_only=True)

    @property
    def all_explore_steps(self) -> int:
        """Sweeps and joint steps of all starts together."""
        return self.starts * (self.sweeps + self.explore_steps) + self.finalists * self.final_steps


@dataclass(frozen=True)
class Quality(Work):
    """Work of an isotropic fit, which aggregates its samples; see Work and `problem`.

    coarse_phi_group, coarse_angles : resolution of all stages but the last
    appearance_steps : joint steps after the refinement that see the appearance as well, and those
        that the refinement has not needed
    maps : environments of the appearance; 0 for the albedo alone
    polish_steps : joint steps on all samples and the appearance
    polish_angles : angle bins of the polish
    """

    appearance_steps: int
    maps: int
    coarse_phi_group: int
    coarse_angles: int
    polish_steps: int
    polish_angles: int


QUALITIES = {
    "draft": Quality(1, 5, 0, 1, 0, 5, 6, 2, 15, 120, 0, 120),
    "standard": Quality(4, 3, 4, 3, 8, 20, 10, 8, 9, 360, 3, 720),
    "best": Quality(6, 6, 8, 3, 16, 60, 40, 8, 5, 360, 12, 720),
}
ANISOTROPIC_QUALITIES = {
    "draft": Work(1, 2, 10, 1, 0, 2, coarse=True),
    "standard": Work(1, 4, 0, 1, 0, 36),
    "best": Work(3, 8, 10, 1, 0, 80),
}
DEFAULT_QUALITY = "standard"
