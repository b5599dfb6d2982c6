"""Where a log comes from: each kind can be sent to another process and loaded there."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from bslam.datasets.dlr import load_dlr
from bslam.datasets.mrclam import best_truth, load_mrclam
from bslam.errors import BslamError
from bslam.evaluation.align import Rigid
from bslam.log import Log, has_identities
from bslam.options import RunOptions, parse_association, usual_filter
from bslam.recording import Recording, load
from bslam.recording.aslog import as_log
from bslam.rig import load_rig
from bslam.runs.camera import UNTOLD_THRESHOLD, CameraStore, Threshold, camera_log
from bslam.scannerfile import ScannerModel, read_scanner
from bslam.world.scenario import Scenario
from bslam.world.simulate import load_scenario, simulate


@dataclass(frozen=True)
class Says:
    """What the sightings of a log tell, by which a run chooses what it was not told."""

    signatures: bool = False
    ranges: bool = True
    identities: bool = True

    @property
    def observation(self) -> str:
        """What a run takes of them, unless asked otherwise."""
        return "distance" if self.ranges else "direction"

    @property
    def association(self) -> str:
        """What tells whose they are."""
        return "both" if self.signatures else "known" if self.identities else "mahalanobis"


def options_for(says: Says, words: Mapping[str, Any]) -> RunOptions:
    """Options of a run by their names; what is not said, or None, by what the sightings tell.

    `association` is one as on the command line, "known:0.05", or such a name with its rate.
    """
    given = {name: value for name, value in words.items() if value is not None}
    if given.get("known_map") and says.identities:
        says = replace(says, signatures=False)
    association = given.pop("association", says.association)
    name, rate = parse_association(association) if isinstance(association, str) else association
    observation = given.setdefault("observation", says.observation)
    has_map = given.get("known_map", False) or "kept_map" in given
    given.setdefault("filter", usual_filter(observation, has_map))
    return RunOptions(association=name, wrong_identity_rate=rate, **given)


def what_it_says(log: Log) -> Says:
    """Of a log at hand."""
    sightings = log.sightings
    has_ranges = bool(np.isfinite(sightings.range_m).any()) or len(sightings.range_m) == 0
    return Says(
        sightings.signature is not None, has_ranges, has_identities(log) or not len(sightings.time_us)
    )


class Source(Protocol):
    """A log that can be made on demand."""

    @property
    def name(self) -> str:
        """Scenario, or the log's own name."""

    @property
    def truth_kind(self) -> str:
        """ "simulated", "recorded" or how complete a data set's truth is."""

    @property
    def says(self) -> Says:
        """What its sightings tell."""

    @property
    def shared(self) -> Hashable | None:
        """Sources with the same value rest on the same costly preparation; None: there is none."""

    def prepare(self) -> None:
        """Do what `shared` speaks of, unless it is done. Raises BslamError."""

    def load(self) -> Log:
        """The log. Raises BslamError."""

    def walls_m(self) -> NDArray[np.float64]:
        """Walls (w, 4) x1, y1, x2, y2 in the frame of the truth; none where nobody knows them."""


class _Unshared:
    """Nothing to prepare."""

    shared: ClassVar[Hashable | None] = None

    def prepare(self) -> None:
        """Nothing."""


@dataclass(frozen=True)
class ScenarioSource(_Unshared):
    """A drive to simulate."""

    scenario: str  # name or path of a TOML file
    seed: int
    sigma_mps: float | None  # wheel-speed sigma; None: the scenario's
    noise: str | None  # what errs; None: as the scenario says
    noise_draw: int = field(default=0, kw_only=True)  # of [wheels]; 0: the scenario's

    truth_kind: ClassVar[str] = "simulated"
    says: ClassVar[Says] = Says(signatures=True)

    @property
    def name(self) -> str:
        return Path(self.scenario).stem

    def world(self) -> Scenario:
        """What is simulated."""
        return load_scenario(self.scenario)

    def redrawn(self) -> Scenario:
        """The same, with its wheels' noise drawn as is asked for."""
        scenario = self.world()
        wheels = replace(scenario.wheels, draw=self.noise_draw or scenario.wheels.draw)
        return replace(scenario, wheels=wheels)

    def load(self) -> Log:
        return simulate(self.redrawn(), self.seed, self.sigma_mps, self.noise)

    def walls_m(self) -> NDArray[np.float64]:
        scenario = self.world()
        start = scenario.start
        ends_m = np.array([(*wall.start, *wall.end) for wall in scenario.arena.walls], dtype=np.float64)
        to_start = Rigid(start.heading_rad, start.x_m, start.y_m).inverse()
        return to_start.points(ends_m.reshape(-1, 2)).reshape(-1, 4)


@dataclass(frozen=True)
class CameraSource(ScenarioSource):
    """A drive to simulate, watched by cameras."""

    rig: str  # name or path of a TOML file
    store: Path  # where the rendered drives are kept
    threshold: Threshold = UNTOLD_THRESHOLD  # of the detector's score
    model: Path | None = None  # of a user's own kinds; None: the built-in ones

    @property
    def shared(self) -> Hashable | None:  # type: ignore[override]
        moved = (self.sigma_mps, self.noise_draw) if self.noise == "actuation" else None
        return self.scenario, self.seed, self.rig, self.noise, moved, self.model

    def scanner(self) -> ScannerModel | None:
        """The model of a user's own kinds. Raises BslamError."""
        return None if self.model is None else read_scanner(self.model)

    def prepare(self) -> None:
        self.load()

    def load(self) -> Log:
        rig, store = load_rig(self.rig), CameraStore(self.store)
        chosen = self.threshold, self.scanner()
        return camera_log(self.redrawn(), self.seed, self.sigma_mps, self.noise, rig, store, *chosen)


@dataclass(frozen=True)
class FolderSource(_Unshared):
    """A recorded log folder."""

    path: Path

    truth_kind: ClassVar[str] = "recorded"

    @property
    def name(self) -> str:
        return self.path.resolve().name

    @property
    def says(self) -> Says:
        try:
            return what_it_says(self.load())
        except BslamError:  # which its run meets again, and reports
            return Says()

    def load(self) -> Log:
        return Log.read(self.path)

    def walls_m(self) -> NDArray[np.float64]:
        return np.empty((0, 4))


@dataclass(frozen=True)
class DlrSource(_Unshared):
    """The DLR Spatial Cognition data set, held against its least-squares solution."""

    directory: Path

    truth_kind: ClassVar[str] = "least squares"
    says: ClassVar[Says] = Says()

    @property
    def name(self) -> str:
        return self.directory.resolve().name

    def load(self) -> Log:
        return load_dlr(self.directory)

    def walls_m(self) -> NDArray[np.float64]:
        return np.empty((0, 4))


@dataclass(frozen=True)
class MrclamSource(_Unshared):
    """One robot of an MRCLAM data set."""

    directory: Path
    robot: int

    says: ClassVar[Says] = Says()

    @property
    def name(self) -> str:
        return f"{self.directory.resolve().name}_robot{self.robot}"

    @property
    def truth_kind(self) -> str:
        return best_truth(self.directory, self.robot)[0]

    def load(self) -> Log:
        return load_mrclam(self.directory, self.robot)

    def walls_m(self) -> NDArray[np.float64]:
        return np.empty((0, 4))


@dataclass(frozen=True)
class RecordingSource(_Unshared):
    """A recording."""

    path: Path

    truth_kind: ClassVar[str] = "recorded"
    says: ClassVar[Says] = Says(signatures=True)

    @property
    def name(self) -> str:
        return self.path.stem

    def recording(self) -> Recording:
        """All of it."""
        return load(self.path)

    def load(self) -> Log:
        return as_log(self.recording())

    def walls_m(self) -> NDArray[np.float64]:
        return np.empty((0, 4))
