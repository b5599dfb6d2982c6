"""What is trained beside bslam's scanner on the same pictures, and on clutter made of them as bslam makes it:
OpenCV's HOG with a linear SVM, and a small network that finds middles, as FOMO does.
"""

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.svm import LinearSVC

from bslam.detect.boxes import Floats, overlaps
from bslam.detect.clutter import clutter
from bslam.detect.examples import Example
from bslam.detect.fit import shapes_of

cv2: Any = None
torch: Any = None
try:  # extras
    cv2 = importlib.import_module("cv2")
    torch = importlib.import_module("torch")
except ImportError:
    pass

Frame = NDArray[np.uint8]
Rng = np.random.Generator
CLUTTER = 40
PAD, STEP = 16, 1.05  # of HOG's scan: pixels around a frame, and from size to size
HOG_BYTES = 13  # a pixel: its colours, two gradients as float, their two directions
LOWEST = -0.8  # score of a window that HOG reports
NMS, OTHER = 0.4, 0.3  # overlaps: of two boxes of one thing, and at most with a thing of what is none
CHANGES, MOVED_SCALED = 8, np.array([0.05, 0.05, 0.09])
ROUNDS, RANDOM, NEGATIVES = 3, 20, 25  # the last two of each picture
STEPS, BATCH, CLUTTER_SHARE = 400, 16, 0.25
LAYERS = ((1, 8, 1), (6, 8, 2), (6, 8, 1), (6, 16, 2), (6, 16, 1), (6, 16, 1))
"""MobileNetV2's first blocks at a width of .35: expansion, channels, stride."""
STRIDE = 8


@dataclass(frozen=True)
class Fitted:
    """What a training made. find: boxes (n, 4) in a frame and their scores; cost: how often weights are
    multiplied for a frame, and bytes of RAM at least.
    """

    find: Callable[[Frame], tuple[Floats, Floats]]
    cost: Callable[[Frame], tuple[int, int]]
    flash_bytes: int


class _Hog:
    """A window of gradients round a box that is as wide to high as a thing."""

    def __init__(self, aspect: float) -> None:
        self.box = 48.0 * np.array([aspect**0.5, aspect**-0.5])
        self.window = 8 * np.rint((self.box + 16) / 8).astype(int)
        self.descriptor = cv2.HOGDescriptor(tuple(self.window.tolist()), (16, 16), (8, 8), (8, 8), 9)

    def scan(self, frame: Frame) -> tuple[Floats, Floats]:
        """Boxes of all windows above LOWEST, and their scores, surest first."""
        settings = {"hitThreshold": LOWEST, "padding": (PAD, PAD), "scale": STEP, "groupThreshold": 0}
        rects, scores = self.descriptor.detectMultiScale(frame, **settings)
        rects, order = np.asarray(rects, float).reshape(-1, 4), np.argsort(-np.ravel(scores), kind="stable")
        boxes = self._boxes(rects[:, :2] + rects[:, 2:] / 2, rects[:, 2] / self.window[0])
        return boxes[order], np.ravel(scores)[order]

    def products(self, frame: Frame) -> int:
        """Of all windows, at all sizes that are scanned."""
        size, count = np.array(frame.shape[1::-1], float), 0
        while (np.rint(size) >= self.window).all():
            count += int(np.prod((np.rint(size) + 2 * PAD - self.window) // 8 + 1))
            size /= STEP
        return count * int(self.descriptor.getDescriptorSize())

    def fit(
        self, own: Sequence[tuple[Example, Floats]], seen: Sequence[Example], kind: str, rng: Rng
    ) -> None:
        """Random windows are the first examples of none, those that are hard to tell the others."""
        examples = [
            self._features(one.frame, changed, number % 2 == 1)
            for one, box in own
            for number, changed in enumerate(_changed_boxes(box, rng))
        ]
        negatives = []
        for one in seen:
            size = np.array(one.frame.shape[1::-1])
            largest = max(0.0, float(np.log((size / self.window).min())))
            draws = rng.uniform(0.0, [largest, *size], (RANDOM, 3))
            negatives += self._others(one, kind, self._boxes(draws[:, 1:], np.exp(draws[:, 0])))
        self._train(examples, negatives)
        for _ in range(ROUNDS):
            negatives += [row for one in seen for row in self._others(one, kind, self.scan(one.frame)[0])]
            self._train(examples, negatives)

    def _boxes(self, middles: Floats, scales: Floats) -> Floats:
        half = self.box / 2 * scales[:, None]
        return np.hstack([middles - half, middles + half])

    def _features(self, frame: Frame, box: Floats, mirrored: bool = False) -> Floats:
        """Of a box in a frame; beyond its edges the frame goes on."""
        scale = (np.prod(box[2:] - box[:2]) / np.prod(self.box)) ** 0.5
        first = (box[:2] + box[2:] - scale * self.window) / 2
        where = np.array([[scale, 0.0, first[0]], [0.0, scale, first[1]]])
        flags, size = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, tuple(self.window.tolist())
        cut = cv2.warpAffine(frame, where, size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
        return self.descriptor.compute(np.ascontiguousarray(cut[:, :: -1 if mirrored else 1])).ravel()

    def _others(self, one: Example, kind: str, boxes: Floats) -> list[Floats]:
        """Features of boxes that show something else, of the first ones."""
        is_other = overlaps(boxes, one.of(kind)).max(axis=1, initial=0.0) < OTHER
        return [self._features(one.frame, box) for box in boxes[is_other][:NEGATIVES]]

    def _train(self, examples: Sequence[Floats], negatives: Sequence[Floats]) -> None:
        weight = max(1.0, len(negatives) / len(examples) / 3.0)
        svm = LinearSVC(C=0.01, class_weight={1: weight, -1: 1.0}, tol=1e-3, max_iter=4000, random_state=0)
        svm.fit(np.array([*examples, *negatives]), np.repeat([1, -1], [len(examples), len(negatives)]))
        self.descriptor.setSVMDetector(np.append(svm.coef_[0], svm.intercept_[0]).astype(np.float32))


def _changed_boxes(box: Floats, rng: Rng) -> Floats:
    """A box as it is, then moved and scaled."""
    draws = rng.uniform(-MOVED_SCALED, MOVED_SCALED, (CHANGES, 3))
    draws[0] = 0.0
    sides = box[2:] - box[:2]
    middles, halves = (box[:2] + box[2:]) / 2 + draws[:, :2] * sides, np.exp(draws[:, 2:]) * sides / 2
    return np.hstack([middles - halves, middles + halves])


def fit_hog(examples: Sequence[Example], kind: str, rng: Rng) -> Fitted:
    """As many windows as bslam has for boxes of such shapes."""
    where = [(one, box) for one in examples for box in one.of(kind)]
    seen = [*examples, *clutter(examples, kind, CLUTTER, rng)]
    windows = []
    for shape, chosen in shapes_of(np.array([box for _, box in where])):
        windows.append(_Hog(shape.box_columns / shape.box_rows))
        windows[-1].fit([pair for pair, its in zip(where, chosen, strict=True) if its], seen, kind, rng)

    def find(frame: Frame) -> tuple[Floats, Floats]:
        boxes, scores = map(np.concatenate, zip(*(one.scan(frame) for one in windows), strict=True))
        corners = np.hstack([boxes[:, :2], boxes[:, 2:] - boxes[:, :2]])
        kept = np.array(cv2.dnn.NMSBoxes(corners, scores - LOWEST, 0.0, NMS), int)
        return boxes[kept], scores[kept]

    def cost(frame: Frame) -> tuple[int, int]:
        pixels = (frame.shape[0] + 2 * PAD) * (frame.shape[1] + 2 * PAD)
        return sum(one.products(frame) for one in windows), HOG_BYTES * pixels

    return Fitted(find, cost, sum(one.descriptor.getDescriptorSize() + 1 for one in windows))


# ---- a network --------------------------------------------------------------------------------------------


def fit_network(examples: Sequence[Example], kind: str, rng: Rng) -> Fitted:
    """From nothing, on frames at half their size: there it sees as much of a thing as it is to find."""
    torch.set_num_threads(1)
    torch.manual_seed(int(rng.integers(2**31)))
    seen = [*examples, *clutter(examples, kind, CLUTTER, rng)]
    shares = [(1 - CLUTTER_SHARE) / len(examples)] * len(examples) + [CLUTTER_SHARE / CLUTTER] * CLUTTER
    size = STRIDE * (np.max([one.frame.shape[1::-1] for one in examples], axis=0) // (2 * STRIDE))
    blocks = _network()
    optimiser = torch.optim.AdamW(blocks.parameters(), weight_decay=1e-2)
    pace = torch.optim.lr_scheduler.OneCycleLR(optimiser, 6e-3, total_steps=STEPS)
    for _ in range(STEPS):
        chosen = rng.choice(len(seen), BATCH, p=shares)
        frames, heats = zip(*(_changed(seen[one], kind, size, rng) for one in chosen), strict=True)
        optimiser.zero_grad()
        _loss(_heat(blocks, frames), torch.from_numpy(np.array(heats, np.float32))).backward()
        optimiser.step()
        pace.step()
    blocks.eval()
    weights = sum(each.numel() for each in blocks.parameters())
    return Fitted(lambda frame: _peaks(blocks, frame), lambda frame: _cost(blocks, frame), weights)


def _network() -> Any:
    nn = torch.nn

    def layer(before: int, after: int, side: int = 1, stride: int = 1, groups: int = 1) -> list[Any]:
        convolution = nn.Conv2d(before, after, side, stride, side // 2, groups=groups, bias=False)
        return [convolution, nn.BatchNorm2d(after)]

    blocks, channels = [nn.Sequential(*layer(3, 16, 3, 2), nn.ReLU6())], 16
    for larger, after, stride in LAYERS:
        inside = larger * channels
        first = [*layer(channels, inside), nn.ReLU6()] if larger > 1 else []
        depth = [*layer(inside, inside, 3, stride, inside), nn.ReLU6()]
        blocks.append(nn.Sequential(*first, *depth, *layer(inside, after)))
        channels = after
    head = [*layer(channels, 6 * channels), nn.ReLU6(), nn.Conv2d(6 * channels, 32, 1), nn.ReLU()]
    last = nn.Conv2d(32, 1, 1)
    nn.init.constant_(last.bias, -4.0)  # a middle is rare
    return nn.ModuleList([*blocks, nn.Sequential(*head, last)])


def _heat(blocks: Any, frames: Sequence[Frame]) -> Any:
    """Logits of a middle, a cell each."""
    x = torch.from_numpy(np.stack(frames).transpose(0, 3, 1, 2).astype(np.float32) / 128.0 - 1.0)
    for block in blocks:
        y = block(x)
        x = x + y if y.shape == x.shape else y
    return x[:, 0]


def _changed(one: Example, kind: str, size: NDArray[np.int64], rng: Rng) -> tuple[Frame, Floats]:
    """A picture at half its size, moved, scaled, mirrored, in other light; and where middles are in it."""
    scale = 0.5 * np.exp(rng.uniform(-0.3, 0.3)) * np.array([1, 1])
    scale[0] *= rng.choice([-1, 1])
    shift = (size - scale * one.frame.shape[1::-1]) / 2 + rng.uniform(-0.15, 0.15, 2) * size
    where = np.hstack([np.diag(scale), shift[:, None]])
    small = cv2.warpAffine(one.frame, where, tuple(size.tolist()), borderMode=cv2.BORDER_REPLICATE)
    light = small * rng.uniform(0.7, 1.3) * rng.uniform(0.9, 1.1, 3) + rng.uniform(-25.0, 25.0)
    cells = np.stack(np.meshgrid(*(np.arange(-(-side // STRIDE)) for side in size)), axis=-1)
    heat = np.zeros(cells.shape[:2])
    for box in one.of(kind):
        middle = (scale * (box[:2] + box[2:]) / 2 + shift) / STRIDE
        sd = np.maximum(0.7, 0.15 * scale[1] * (box[2:] - box[:2]) / STRIDE)
        heat = np.maximum(heat, np.exp(-(((cells - middle) / sd) ** 2).sum(axis=-1) / 2))
        heat[(cells == np.rint(middle)).all(axis=-1)] = 1.0
    return np.clip(light, 0, 255).astype(np.uint8), heat


def _loss(logits: Any, heat: Any) -> Any:
    """Focal, weaker near a middle (Zhou, Wang, Krähenbühl 2019)."""
    logarithm, sure, there = torch.nn.functional.logsigmoid, torch.sigmoid(logits), (heat == 1.0).float()
    hits = there * (1 - sure) ** 2 * logarithm(logits)
    others = (1 - there) * (1 - heat) ** 4 * sure**2 * logarithm(-logits)
    return -(hits + others).sum() / max(1.0, float(there.sum()))


def _peaks(blocks: Any, frame: Frame) -> tuple[Floats, Floats]:
    """Middles, as boxes of no size: cells that are surer than those around."""
    small = cv2.resize(frame, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    with torch.no_grad():
        heat = torch.sigmoid(_heat(blocks, [small]))
        tops = (heat == torch.nn.functional.max_pool2d(heat, 3, 1, 1)) & (heat > 0.02)
    sure, (row, column) = heat[0].numpy(), np.nonzero(tops[0].numpy())
    middles = 2.0 * STRIDE * np.stack([column, row], axis=1)
    return np.hstack([middles, middles]), sure[row, column].astype(float)


def _cost(blocks: Any, frame: Frame) -> tuple[int, int]:
    """Products of all layers, and values that one of them reads and writes."""
    found: list[tuple[int, int]] = []

    def note(layer: Any, read: Any, made: Any) -> None:
        found.append((made.numel() * layer.weight[0].numel(), read[0].numel() + made.numel()))

    layers = [each for each in blocks.modules() if isinstance(each, torch.nn.Conv2d)]
    hooks = [each.register_forward_hook(note) for each in layers]
    _peaks(blocks, frame)
    for hook in hooks:
        hook.remove()
    return sum(products for products, _ in found), max(kept for _, kept in found)
