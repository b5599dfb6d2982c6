"""A log tested before it is believed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from bslam.errors import BslamError
from bslam.log import Log
from bslam.logcheck import plausible, verdict
from bslam.logcheck.drive import Drive, Factors, drive_of
from bslam.logcheck.files import are_degrees, check_files, degrees_finding
from bslam.logcheck.finding import Finding, Report
from bslam.logcheck.flow import Flow, best_flow
from bslam.logcheck.solution import Solution, solve
from bslam.logcheck.units import sign_findings, signs, unit_slip, unknown_unit

Settings = Iterable[tuple[str, int | float]]
"""Of the core, as `Robot.settings`: forward_scale, turn_scale, sighting_delay_us."""

_SLIPS_MAX: Final = 3
_BLIND: Final = (
    "all else: it takes a robot that moves and beacons with identities, seen again within a second"
)
_HANGING: Final = "all else: it takes sightings that change"
_STRAIGHT: Final = "signs and scale of the turn: it hardly turns while beacons are seen"
_ONE_CURVATURE: Final = "one wheel against the other, scale of the turn: the drive has one curvature"
_DELAY: Final = "delay of the sightings: several fit alike, as speed and turn change too little"
_NO_RANGES: Final = "scales, mount, noise, exchanged identities: no sighting has a distance"


def check_folder(folder: Path, settings: Settings = ()) -> Report:
    """A csv folder, its files first; `settings` as for `check_log`. Raises BslamError for what cannot be read
    even so.
    """
    with TemporaryDirectory() as place:
        copy = Path(place) / folder.resolve().name
        found = check_files(folder, copy) if folder.is_dir() else []
        try:
            report = check_log(Log.read(copy if found else folder), settings)
        except BslamError as error:
            raise BslamError(str(error).replace(str(copy), str(folder))) from error
    return replace(report, findings=[*found, *report.findings])


def check_log(log: Log, settings: Settings = ()) -> Report:
    """Every test that the log's content allows; `settings` win over the log's own."""
    log = replace(log, robot=replace(log.robot, settings=(*log.robot.settings, *settings)))
    findings, factors = [*verdict.missing(log), *verdict.outside(log)], Factors()
    if are_degrees(log.sightings.bearing_rad):
        findings.append(degrees_finding(log.sightings.bearing_rad, "sightings"))
        factors = Factors(bearing=findings[-1].figures["factor"])
    findings += plausible.repeated(log)
    if wild := [*plausible.counted(log), *plausible.summed_up(log, factors)]:
        return Report(log.name, [*findings, *wild], [plausible.HELD_BACK])
    drive, flow, factors = _in_si(log, factors, findings)
    if flow is not None and (wild := [*unknown_unit(log, flow)]):
        return Report(log.name, [*findings, *wild], [plausible.HELD_BACK])
    if flow is None:
        return Report(log.name, findings, [_BLIND])
    if still := [*verdict.hanging(drive)]:
        return Report(log.name, [*findings, *still], [_HANGING])
    signed, shown = signs(flow), flow
    if signed.way > 0.0:  # else the sensor looks backward
        findings += plausible.outside_view(log, factors.bearing)
    untested = [] if abs(flow.turn) > 2.0 * flow.turn_error else [_STRAIGHT]
    if signed != Factors():
        drive = drive_of(log, factors * signed)
        flow = best_flow(drive) or flow
    if not drive.has_ranges:
        return Report(log.name, [*findings, *sign_findings(log, signed, shown, [])], [*untested, _NO_RANGES])
    solution = solve(log, drive, flow)
    findings += sign_findings(log, signed, shown, solution.references)
    return _judged(Report(log.name, findings, untested), log, drive, flow, solution)


def _judged(report: Report, log: Log, drive: Drive, flow: Flow, solution: Solution) -> Report:
    """The report, with what the fit tells."""
    findings, untested = [*report.findings], [*report.untested]
    late = [*verdict.delay(solution, drive, flow)]
    is_held = solution.is_delay_clear or not all(one.is_note for one in late)
    findings += [*(late if is_held else []), *verdict.scales(solution, drive, flow)]
    findings += [
        *verdict.mount(solution, drive),
        *verdict.noise(solution, drive),
        *verdict.wheels(solution, drive),
        *verdict.identities(solution, log),
    ]
    names = ["way", "turn", "bend", "yaw", "delay"]
    if solution.has_one_curvature:
        untested.append(_ONE_CURVATURE)
        names = ["way", "yaw", "delay"]
    if not is_held:
        untested.append(_DELAY)
        names.remove("delay")
    return Report(log.name, findings, untested, {name: vars(getattr(solution, name)) for name in names})


def _in_si(log: Log, factors: Factors, findings: list[Finding]) -> tuple[Drive, Flow | None, Factors]:
    """The drive after all slips of units are put right, its flow, and the factors that do it."""
    drive = drive_of(log, factors)
    flow = best_flow(drive) if drive.is_usable else None
    for _ in range(_SLIPS_MAX):
        slip = unit_slip(log, drive, flow) if flow is not None else None
        if slip is None:
            break
        factors = factors * slip[0]
        findings.append(slip[1])
        drive = drive_of(log, factors)
        flow = best_flow(drive)
    return drive, flow, factors
