"""Paper 3's experiment on simulated data (fig. 3): 8 targets, 100 steps, false alarms over part of the area.

``python -m tests.validation.jpda_experiment --out plot.png`` prints the numbers and draws the tracks of one
seed. Targets start in [0, 500] x [0, 50], false alarms fall in [0, 200] x [0, 200], P_D = .98, as printed;
the paper does not say how fast targets go, how much is false and how exact a measurement is: see `Setting`.
Our form is beside the printed one, eqs. (28)-(29), which always moves a target to some measurement.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tracker.filtering import jpda, planar

Floats = NDArray[np.float64]

FORMS = ("with misses", "as printed")


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """One experiment; lengths in px, times in steps.

    Attributes:
        targets: How many.
        steps: How many.
        starts: Width and height of the area of the first positions.
        cluttered: Width and height of the area of false alarms.
        detection: P_D.
        false: False alarms a step.
        speed: Greatest first speed along x and y.
        intensity: Of the white acceleration.
        noise: Standard deviation of a measurement.
        gate: P_G.
        lost: A target is lost at a step where its estimate is further away.
    """

    targets: int = 8
    steps: int = 100
    starts: tuple[float, float] = (500.0, 50.0)
    cluttered: tuple[float, float] = (200.0, 200.0)
    detection: float = 0.98
    false: float = 10.0
    speed: tuple[float, float] = (2.0, 2.0)
    intensity: float = 0.05
    noise: float = 2.0
    gate: float = 0.999
    lost: float = 20.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """Truth (T, N, 4), each step's measurements, and the estimates (T, N, 4) of each form."""

    truth: Floats
    measurements: list[Floats]
    estimates: dict[str, Floats]

    def errors(self, form: str) -> Floats:
        """Return the distances (T, N) between estimate and truth."""
        return np.linalg.norm((self.estimates[form] - self.truth)[:, :, [0, 2]], axis=2)


def simulate(setting: Setting, rng: np.random.Generator) -> tuple[Floats, list[Floats]]:
    """Draw the targets' states (T, N, 4) and what is measured at each step."""
    n = setting.targets
    f, q = planar.transition(1.0), planar.process_noise(1.0, setting.intensity)
    root = np.linalg.cholesky(q)
    places = rng.uniform(0.0, setting.starts, (n, 2))
    speeds = rng.uniform([-setting.speed[0], 0.0], setting.speed, (n, 2))
    state = np.stack([places[:, 0], speeds[:, 0], places[:, 1], speeds[:, 1]], 1)
    truth, measurements = [], []
    for _ in range(setting.steps):
        truth.append(state)
        seen = rng.random(n) < setting.detection
        own = state[seen][:, [0, 2]] + setting.noise * rng.normal(size=(seen.sum(), 2))
        false = rng.uniform(0.0, setting.cluttered, (rng.poisson(setting.false), 2))
        measurements.append(rng.permutation(np.concatenate([own, false])))
        state = state @ f.T + rng.normal(size=state.shape) @ root.T
    return np.array(truth), measurements


def follow(setting: Setting, first: Floats, measurements: list[Floats], *, printed: bool) -> Floats:
    """Track targets whose first states (N, 4) are known; return the estimates (T, N, 4)."""
    mean = first
    covariance = np.tile(np.diag([setting.noise**2, 0.1, setting.noise**2, 0.1]), (len(first), 1, 1))
    density = setting.false / np.prod(setting.cluttered)
    estimates = []
    for step, measured in enumerate(measurements):
        if step:
            mean, covariance = planar.predict(mean, covariance, 1.0, setting.intensity)
        found = jpda.innovations(mean, covariance, measured, planar.POSITION, setting.noise**2 * np.eye(2))
        # Where nothing false is expected a measurement still is not quite certain.
        clutter = np.where((measured < setting.cluttered).all(1), density, 0.01 * density)
        weights = jpda.likelihoods(found, detection=setting.detection, gate=setting.gate, clutter=clutter)
        beta = jpda.associate(weights).beta
        mean, covariance = jpda.update(
            mean, covariance, found, jpda.without_misses(beta) if printed else beta
        )
        estimates.append(mean)
    return np.array(estimates)


def run(setting: Setting, seed: int) -> Run:
    """Simulate once and track in both forms."""
    truth, measurements = simulate(setting, np.random.default_rng(seed))
    estimates = {form: follow(setting, truth[0], measurements, printed=form == FORMS[1]) for form in FORMS}
    return Run(truth=truth, measurements=measurements, estimates=estimates)


def summary(setting: Setting, runs: list[Run], form: str) -> dict[str, float]:
    """Return the median and root mean square error in px, and the shares of steps and targets lost."""
    errors = np.stack([one.errors(form) for one in runs])
    return {
        "median error": float(np.median(errors)),
        "rms error": float(np.sqrt(np.mean(errors**2))),
        "steps lost": float(np.mean(errors > setting.lost)),
        "targets lost at the end": float(np.mean(errors[:, -1] > setting.lost)),
    }


def draw(one: Run, path: str) -> None:
    """Draw measurements and truth beside each form's tracks."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(15, 4.5), sharex=True, sharey=True)
    everything = np.concatenate(one.measurements)
    axes[0].scatter(everything[:, 0], everything[:, 1], s=1, color="0.6")
    for axis, title in zip(axes, ("simulated", *FORMS), strict=True):
        states = one.truth if title == "simulated" else one.estimates[title]
        axis.plot(states[:, :, 0], states[:, :, 2], linewidth=1)
        axis.set_title(title)
        axis.set_xlabel("x, px")
    axes[0].set_ylabel("y, px")
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    plt.close(figure)


def main() -> None:
    """Print the numbers and draw the first seed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", help="where to draw the first seed")
    parser.add_argument("--seeds", type=int, default=50)
    arguments = parser.parse_args()
    for setting in (
        Setting(),
        Setting(false=80.0),
        Setting(detection=0.7),
        Setting(false=80.0, detection=0.7),
    ):
        runs = [run(setting, seed) for seed in range(arguments.seeds)]
        print(f"P_D {setting.detection}, {setting.false:.0f} false alarms a step, {arguments.seeds} seeds")
        for form in FORMS:
            print(f"  {form}: ", end="")
            print(", ".join(f"{name} {value:.3f}" for name, value in summary(setting, runs, form).items()))
        if arguments.out and setting == Setting():
            draw(runs[0], arguments.out)


if __name__ == "__main__":
    main()
