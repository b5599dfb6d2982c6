"""What a model finds in pictures: in words, as a page with curves, and drawn into the pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from matplotlib.figure import Figure

from bslam.detect.boxes import Curve
from bslam.scannerfile import Kind
from bslam.view.report import Picture, Section, Table, render
from bslam.view.style import ESTIMATE, SECOND, new_figure, png, tidy

_FALSE: Final = (0.1, 1.0)


@dataclass(frozen=True)
class Figures:
    """How good a class is found: at overlaps of .3 and .5, and in pictures that show none of it."""

    kind: Kind
    loose: Curve
    curve: Curve
    without: Curve

    @property
    def found(self) -> int:
        """Labelled objects that it finds by itself, at its threshold."""
        return int((self.curve.hits & (self.curve.scores >= self.kind.threshold)).sum())

    @property
    def false(self) -> int:
        """Detections at its threshold that are on none."""
        return int((~self.curve.hits & (self.curve.scores >= self.kind.threshold)).sum())

    @property
    def false_without(self) -> int:
        """Those in pictures that show none of the class."""
        return int((self.without.scores >= self.kind.threshold).sum())

    @property
    def share(self) -> float:
        """Of labelled objects that it finds by itself."""
        return self.found / max(1, self.curve.labelled)

    def words(self) -> str:
        """Found by itself first."""
        pictures = self.curve.pictures
        text = (
            f"{self.kind.name}: finds {self.found} of {self.curve.labelled} labelled by itself "
            f"({100 * self.share:.0f} %), and {self.false} false ones in {pictures} pictures"
        )
        if self.without.pictures:
            text += f", {self.false_without} of them in the {self.without.pictures} that show none"
        recalls = " and ".join(f"{self.curve.recall_at(one):.2f} at {one:g}" for one in _FALSE)
        return (
            f"{text}\n  average precision {self.loose.average_precision:.2f} at IoU .3, "
            f"{self.curve.average_precision:.2f} at .5; recall {recalls} false a picture"
        )


def page(title: str, words: str, figures: Sequence[Figures], commands: Sequence[str]) -> str:
    """The same as a page, with a curve a class."""
    heads = ["class", "labelled", "found by itself", "false", "in pictures without", "AP .3", "AP .5"]
    heads += [f"recall at {one:g} false a picture" for one in _FALSE]
    rows = [heads, *(_row(one) for one in figures)]
    sections = [
        Section(
            one.kind.name,
            (),
            one.words().replace("\n", "; "),
            pictures=(Picture(png(draw_curve(one)), f"{one.kind.name}: precision and recall"),),
        )
        for one in figures
    ]
    return render(title, words, Table(rows, " ".join(commands)), sections)


def _row(one: Figures) -> list[str]:
    row = [one.kind.name, str(one.curve.labelled), f"{one.found} ({100 * one.share:.0f} %)", str(one.false)]
    row += [f"{one.false_without} in {one.without.pictures}"]
    row += [f"{its.average_precision:.2f}" for its in (one.loose, one.curve)]
    return row + [f"{one.curve.recall_at(false):.2f}" for false in _FALSE]


def draw_curve(one: Figures) -> Figure:
    """Precision over recall, and where the threshold is."""
    figure = new_figure(6.0, 4.2)
    axes = figure.subplots()
    axes.plot(one.loose.recall, one.loose.precision, color=SECOND, label="IoU .3")
    axes.plot(one.curve.recall, one.curve.precision, color=ESTIMATE, label="IoU .5")
    above = int((one.curve.scores >= one.kind.threshold).sum())
    if above:
        axes.plot(
            one.curve.recall[above - 1],
            one.curve.precision[above - 1],
            "o",
            color=ESTIMATE,
            label="threshold",
        )
    axes.set_xlim(0.0, 1.02)
    axes.set_ylim(0.0, 1.02)
    axes.legend(loc="lower left")
    tidy(axes, "recall", "precision")
    return figure
