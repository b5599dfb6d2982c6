"""Ways around the walls: the shortest on a grid of cells that all keep a distance from them."""

from __future__ import annotations

import heapq
import math

import numpy as np
from numpy.typing import NDArray

from bslam.world.arena import Arena, Point

# Lengths of a move to a side and across, as whole numbers: ways of the same length are exactly equal then.
_STRAIGHT, _DIAGONAL = 10, 14


class RoutePlanner:
    """Plans in one arena, on the free cells that can be reached from one place.

    A cell is free if its centre keeps the distance; from a cell the way goes on to any of the eight around.
    Cells are numbered up the columns. The outermost ones all round lie outside the arena and are never free,
    so that no move leaves the grid.
    """

    def __init__(self, arena: Arena, cell_m: float, clearance_m: float, start: Point) -> None:
        columns, rows = grid_size(arena, cell_m)
        low_x, low_y = arena.low
        x_m = low_x + (np.arange(columns) - 0.5) * cell_m
        y_m = low_y + (np.arange(rows) - 0.5) * cell_m
        self._centres = np.stack(np.meshgrid(x_m, y_m, indexing="ij"), axis=-1).reshape(-1, 2)
        inside = np.zeros((columns, rows), dtype=np.bool_)
        inside[1:-1, 1:-1] = True
        free = inside.ravel() & (arena.path_clearance(self._centres, self._centres) >= clearance_m)
        self._rows = rows
        # What a move adds to a cell's number, and its length.
        self._moves = [(add, _STRAIGHT) for add in (-rows, -1, 1, rows)]
        self._moves += [(add, _DIAGONAL) for add in (-rows - 1, -rows + 1, rows - 1, rows + 1)]
        self._free = free.tolist()
        self._reachable = self._reached_from(start, np.flatnonzero(free))

    @property
    def places(self) -> NDArray[np.float64]:
        """Centres of the cells that can be reached, (cells, 2)."""
        return self._centres[self._reachable]

    def route(self, start: Point, goal: Point) -> list[Point]:
        """Centres of the cells from the one nearest to the start to the one nearest to the goal.

        Where several ways are equally short it goes diagonally first: ahead as far as it can.
        """
        ends = [self._nearest(point, self._reachable) for point in (start, goal)]
        return [(x_m, y_m) for x_m, y_m in self._centres[self._search(*ends)].tolist()]

    def _nearest(self, point: Point, cells: NDArray[np.int64]) -> int:
        return int(cells[np.hypot(*(self._centres[cells] - point).T).argmin()])

    def _reached_from(self, start: Point, free: NDArray[np.int64]) -> NDArray[np.int64]:
        """The cells that ways lead to from the free one nearest to the start."""
        waiting = [self._nearest(start, free)] if len(free) > 0 else []
        reached = set(waiting)
        while waiting:
            cell = waiting.pop()
            around = {cell + add for add, _ in self._moves if self._free[cell + add]} - reached
            reached |= around
            waiting += around
        return np.array(sorted(reached), dtype=np.int64)

    def _search(self, start: int, goal: int) -> list[int]:
        """A*: on from the cell that promises the shortest way, of several from the nearest to the goal."""
        before, length, waiting = {start: start}, {start: 0}, [(0, 0, start)]
        while waiting[0][2] != goal:
            cell = heapq.heappop(waiting)[2]
            for add, move in self._moves:
                following, through = cell + add, length[cell] + move
                if self._free[following] and through < length.get(following, math.inf):
                    before[following], length[following] = cell, through
                    rest = self._least(following, goal)
                    heapq.heappush(waiting, (through + rest, rest, following))
        way = [goal]
        while way[-1] != start:
            way.append(before[way[-1]])
        return way[::-1]

    def _least(self, cell: int, goal: int) -> int:
        """Length of the way if no wall stood between."""
        across = abs(cell // self._rows - goal // self._rows)
        up = abs(cell % self._rows - goal % self._rows)
        return _STRAIGHT * max(across, up) + (_DIAGONAL - _STRAIGHT) * min(across, up)


def grid_size(arena: Arena, cell_m: float) -> tuple[int, int]:
    """Columns and rows of the grid over the arena, with the outermost ones beyond it."""
    (low_x, low_y), (high_x, high_y) = arena.low, arena.high
    return math.ceil((high_x - low_x) / cell_m) + 2, math.ceil((high_y - low_y) / cell_m) + 2
