"""The mean of all ways and maps that fit, by importance sampling about the exact MAP.

What is far from Gaussian in direction only are the beacons' distances. So maps are drawn, in the logarithm of
each beacon's distance and its direction from where it was first seen; given a map the poses are as good as
Gaussian, and have their share of the integral by Laplace (Tierney and Kadane, "Accurate Approximations for
Posterior Moments and Marginal Densities", JASA 81(393), 1986). The first half of the draws is from Student's
t about the MAP, the second from one that has the first half's weighted mean and covariance.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bslam.algorithms.smoother import Smoother

Array = NDArray[np.float64]

_FREEDOM: Final = 6.0  # of Student's t: tails wider than the posterior's
_WIDER: Final = 1.15
_LN_SD_MAX: Final = 0.6  # of a draw along any axis: a factor of 1.8, wider than the first guess
_VARIANCE_MIN: Final = 1e-8


def posterior_mean(smoother: Smoother, draws: int, rng: np.random.Generator) -> tuple[Array, Array, float]:
    """Mean (3,) and covariance (3, 3) of the newest pose, and how many equally good draws it rests on.

    The smoother is solved, and its beacons were seen. A draw costs a few iterations over all poses.
    """
    eyes = smoother.first_eyes()
    ray = smoother.beacons - eyes
    centre = np.column_stack([np.log(np.hypot(*ray.T)), np.arctan2(ray[:, 1], ray[:, 0])]).ravel()
    information = _in_polar(smoother.map_information(), ray)
    covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
    proposal = _Student(centre, covariance)
    first = _draw(smoother, eyes, proposal, draws // 2, rng)
    second = _draw(smoother, eyes, _Student(*_moments(first, first.maps)), draws - draws // 2, rng)
    both = _Draws(*(np.concatenate(pair) for pair in zip(first, second, strict=True)))
    share = both.shares()
    return *_moments(both, both.poses), float(1.0 / np.sum(share**2))


class _Draws(NamedTuple):
    """Maps in polar coordinates (n, 2 beacons), their newest poses (n, 3), logarithms of weights (n,)."""

    maps: Array
    poses: Array
    ln_weight: Array

    def shares(self) -> Array:
        weight = np.exp(self.ln_weight - self.ln_weight.max())
        return weight / weight.sum()


class _Student:
    """Student's t; no axis is wider than a first guess makes sense, none without width."""

    def __init__(self, mean: Array, covariance: Array) -> None:
        variance, self._axes = np.linalg.eigh(covariance)
        self._mean, self._sd = mean, np.sqrt(np.clip(variance, _VARIANCE_MIN, _LN_SD_MAX**2))

    def draw(self, rng: np.random.Generator) -> tuple[Array, float]:
        """A value, and the logarithm of its density but for a constant that all of these have."""
        n = len(self._mean)
        unit = rng.standard_normal(n) * math.sqrt(_FREEDOM / rng.chisquare(_FREEDOM))
        ln_density = -0.5 * (_FREEDOM + n) * math.log1p(unit @ unit / _FREEDOM) - np.log(self._sd).sum()
        return self._mean + self._axes @ (_WIDER * self._sd * unit), float(ln_density)


def _draw(
    smoother: Smoother, eyes: Array, proposal: _Student, draws: int, rng: np.random.Generator
) -> _Draws:
    maps, poses, ln_weights = [], [], []
    for _ in range(draws):
        drawn, ln_density = proposal.draw(rng)
        ln_range, direction_rad = drawn.reshape(-1, 2).T
        ray = np.exp(ln_range)[:, None] * np.column_stack([np.cos(direction_rad), np.sin(direction_rad)])
        try:
            way, ln_fit = smoother.poses_in(eyes + ray)
        except ArithmeticError:
            continue  # in a map as odd as that no way fits
        maps.append(drawn)
        poses.append(way[-1])
        ln_weights.append(ln_fit - ln_density)
    return _Draws(np.array(maps), np.array(poses), np.array(ln_weights))


def _moments(draws: _Draws, values: Array) -> tuple[Array, Array]:
    """Mean (k,) and covariance (k, k) of values (n, k) by the draws' weights."""
    share = draws.shares()
    mean = share @ values
    off = values - mean
    return mean, (share[:, None] * off).T @ off


def _in_polar(information: Array, ray: Array) -> Array:
    """The same of ln distance and direction instead of x and y, each beacon's."""
    jacobian = np.zeros_like(information)
    for at, (x_m, y_m) in enumerate(ray.tolist()):
        jacobian[2 * at : 2 * at + 2, 2 * at : 2 * at + 2] = [[x_m, -y_m], [y_m, x_m]]
    return jacobian.T @ information @ jacobian
