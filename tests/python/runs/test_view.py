"""Pictures: they are drawn from whatever a run leaves, and are PNG."""

import io
from dataclasses import replace

import matplotlib.image
import numpy as np
import pytest

from bslam.view.comparison import Contender, draw_comparison
from bslam.view.room import Mapped, Room, draw_room
from bslam.view.series import Series, draw_cells, draw_run
from bslam.view.stress import Line, draw_stress
from bslam.view.style import moving_mean, png, thinned

PATH = np.column_stack([np.linspace(0, 5, 200), np.sin(np.linspace(0, 5, 200))])


def pixels(figure):
    content = png(figure)
    assert content.startswith(b"\x89PNG")
    image = matplotlib.image.imread(io.BytesIO(content))
    assert image.shape[0] > 300
    assert image.shape[1] > 400
    return image


def texts(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def series(runs=1, steps=2000, lost=False):
    rng = np.random.default_rng(0)
    error_m = np.abs(rng.normal(0.1, 0.02, (runs, steps)))
    if lost:
        error_m[-1] = 1e6
    error_m[:, 0] = np.nan
    nees = rng.chisquare(3, (runs, steps))
    nees[:, :51] = np.nan
    return Series("a run", 0.04 * np.arange(steps), error_m, nees, (0.2, 9.3), 50.0)


def test_room_with_everything_shows_it(made):
    mapped = [Mapped(2.0, 0.6, np.diag([0.01, 0.04]), True), Mapped(1.0, 1.0, np.diag([1.0, 0.1]), False)]
    walls_m = np.array([[-1.0, -3.0, 6.0, -3.0]])
    figure = draw_room(Room("a room", PATH, PATH + 0.1, made.beacons, mapped, walls_m))
    pixels(figure)
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    lines = ["true path", "estimated path", "start"]
    assert names == [*lines, "true beacon", "mapped beacon, 2 sigma", "tentative beacon, 2 sigma"]
    low, high = figure.axes[0].get_ylim()
    assert low < -3.0 < 2.0 < high


def test_room_of_the_estimate_alone():
    pixels(draw_room(Room("nothing known", PATH)))


def test_room_with_a_truth_now_and_then_shows_dots():
    truth_m = np.full_like(PATH, np.nan)
    truth_m[[3, 50]] = PATH[[3, 50]]
    figure = draw_room(Room("sparse", PATH, truth_m))
    pixels(figure)
    (line,) = (one for one in figure.axes[0].lines if one.get_label() == "true path")
    assert (line.get_marker(), len(line.get_xdata())) == (".", 2)


def test_room_is_not_shrunk_by_an_estimate_that_got_lost(made):
    lost = PATH.copy()
    lost[-1] = (1e6, -1e6)
    figure = draw_room(Room("lost", lost, PATH, made.beacons))
    pixels(figure)
    assert figure.axes[0].get_xlim()[1] < 15.0


@pytest.mark.parametrize("true", [True, False])
def test_room_holds_what_is_mapped_unless_that_is_far_too_unsure(made, true):
    beacons = made.beacons if true else None
    off = Mapped(6.0, 0.0, np.diag([0.25, 0.01]), True)  # to 7 m
    axes = draw_room(Room("a room", PATH, PATH, beacons, [off])).axes[0]
    assert axes.get_xlim()[1] > 7.0 and axes.get_title() == "a room"
    unsure = Mapped(6.0, 0.0, np.diag([1e6, 0.01]), True)
    axes = draw_room(Room("a room", PATH, PATH if true else None, beacons, [off, unsure])).axes[0]
    assert axes.get_xlim()[1] < 20.0
    assert axes.get_title() == "a room; 1 of 2 mapped beacons reach beyond the picture"


def test_room_has_no_ellipse_of_a_beacon_that_stands_beyond_and_counts_these(made):
    wide_m2 = np.diag([1.0, 100.0])
    mapped = [Mapped(*place, wide_m2, confirmed) for *place, confirmed in ((1e3, 0, True), (2, -30, False))]
    axes = draw_room(Room("a room", PATH, PATH, made.beacons, mapped)).axes[0]
    assert len(axes.patches) == 0
    words = "a room; 1 of 1 mapped beacons reach beyond the picture; 1 tentative beyond the picture"
    assert axes.get_title() == words


def test_comparison_has_plain_numbers_at_its_scale():
    time_s = np.arange(100.0)
    figure = draw_comparison(
        "two", [Contender("one", time_s, np.full((1, 100), one)) for one in (0.02, 0.04)]
    )
    figure.axes[0].set_ylim(1.5, 5.5)
    pixels(figure)
    axis = figure.axes[0].yaxis
    shown = [one.label1.get_text() for one in [*axis.get_major_ticks(), *axis.get_minor_ticks()]]
    assert {"2", "5"} <= {*shown} and not any("mathdefault" in one for one in shown)


def test_run_shows_the_means_at_both_ends():
    figure = draw_run(series(steps=3000))
    pixels(figure)
    names = texts(figure.axes[0])
    assert names[0] == "position error"
    assert [name.split(":")[0] for name in names[1:]] == ["first 50 s", "last 50 s"]
    assert any("95 % band, 0.2 to 9.3" in name for name in texts(figure.axes[1]))


def test_a_short_run_has_the_means_that_the_table_has():
    names = texts(draw_run(series(steps=1001)).axes[0])
    assert [name.split(":")[0] for name in names[1:]] == ["first 50 s", "last 50 s"]


def test_legend_of_nees_lies_above_the_curve():
    overconfident = series()
    figure = draw_run(replace(overconfident, nees=1000.0 + overconfident.nees))
    pixels(figure)
    axes = figure.axes[1]
    legend = axes.get_legend().get_window_extent().transformed(axes.transData.inverted())
    low, high = axes.get_ylim()
    assert low < 0.2 < 9.3 < high  # the band is shown, whatever the NEES
    assert legend.y0 > max(np.nanmax(line.get_ydata()) for line in axes.get_lines())


def test_pair_shares_one_scale_that_a_lost_run_does_not_stretch():
    figure = draw_cells("both", [series(runs=5), series(runs=5, lost=False)])
    pixels(figure)
    top = figure.axes[0].get_ylim()[1]
    assert 10.0 < top < 100.0
    assert "mean of 5 runs" in texts(figure.axes[0])


def test_a_run_without_a_single_figure_is_drawn_all_the_same():
    empty = Series(
        "none", 0.04 * np.arange(100), np.full((1, 100), np.nan), np.full((1, 100), np.nan), (0.2, 9.3), 50.0
    )
    pixels(draw_run(empty))


def test_titles_are_names_and_no_formulas():
    name = r"a $\frac$"
    many = [Contender("one", 0.04 * np.arange(100), np.ones((1, 100)))]
    for figure in (
        draw_room(Room(name, PATH)),
        draw_run(replace(series(), title=name)),
        draw_comparison(name, many),
        draw_stress(name, [Line("row", [1.0], [3.0], 0.0, (0.0, 0.5))]),
    ):
        assert png(figure).startswith(b"\x89PNG")


def test_moving_mean_leaves_out_what_is_not_known():
    values = np.array([np.nan, 1.0, 3.0, np.nan, np.nan, np.nan, 5.0])
    np.testing.assert_allclose(moving_mean(values, 3), [1.0, 2.0, 2.0, 3.0, np.nan, 5.0, 5.0])


@pytest.mark.parametrize("rows", [10, 4000, 100_000])
def test_thinned_keeps_the_first_and_few(rows):
    kept = thinned(np.arange(rows))
    assert kept[0] == 0
    assert len(kept) <= min(rows, 8000)
