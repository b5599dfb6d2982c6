"""Jobs for every combination of the values that options with lists name."""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Mapping, Sequence
from typing import Any

from bslam.commands.arguments import run_options, scenario_source
from bslam.commands.drawing import draw
from bslam.options import RunOptions
from bslam.runs.batch import Job, make_jobs
from bslam.runs.sources import Source
from bslam.world.simulate import load_scenario

Filters = Mapping[str, Sequence[str]]


def grid_jobs(
    arguments: argparse.Namespace, sigmas_mps: Sequence[float] | None, filters: Filters | None = None
) -> list[Job]:
    """The grid as jobs; the first arguments.pictures of them are drawn."""
    return make_jobs(*grid(arguments, sigmas_mps, filters), draw, arguments.pictures)


def grid(
    arguments: argparse.Namespace, sigmas_mps: Sequence[float] | None, filters: Filters | None = None
) -> tuple[list[Source], list[RunOptions]]:
    """Simulated runs of arguments.scenario: sigma x observation x filter x association x seed.

    `sigmas_mps` None: what the scenario says. `filters`: by observation, where arguments.filter is None.
    None: the default one.
    """
    wheels = load_scenario(arguments.scenario).wheels
    noise = arguments.noise or wheels.noise
    options = [
        run_options(
            arguments,
            sigma_mps=sigma_mps,
            observation=observation,
            filter=filter_name,
            association=association,
            seed=seed,
            noise=noise,
        )
        for sigma_mps, observation in itertools.product(
            sigmas_mps or (wheels.sigma_mps,), _values(arguments.observation)
        )
        for filter_name, association, seed in itertools.product(
            _values(arguments.filter or (filters or {}).get(observation)),
            _values(arguments.association),
            arguments.seeds,
        )
    ]
    sources: list[Source] = [scenario_source(arguments, one.seed, one.sigma_mps, noise) for one in options]
    return sources, options


def _values(one_or_several: Any) -> list[Any]:
    """Options without lists in this command have a single value."""
    return one_or_several if isinstance(one_or_several, list) else [one_or_several]
