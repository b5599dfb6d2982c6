"""Machines fitted together are those that LinearSVC fits one by one."""

import numpy as np

from tools.training.fit import fit
from tools.training.together import fit_together


def test_fit_together_decides_as_linear_svc_does() -> None:
    random = np.random.default_rng(3)
    x = random.normal(size=(600, 5))
    targets = np.column_stack([x[:, 0] * x[:, 1] > 0.2, x[:, 2] ** 2 + x[:, 3] > 1.0])
    targets ^= random.random(targets.shape) < 0.05  # some labels are wrong, so no machine is without loss
    one_by_one = fit(x, targets, 0.01, quadratic=True)
    together = fit_together(x, targets, 0.01, iterations=400)
    expected = one_by_one.decide(x)
    first, second = np.triu_indices(5)
    found = np.hstack([x, x[:, first] * x[:, second]]) @ together.weights.T + together.bias
    # LIBLINEAR stops at a gradient 1e-4 of the first one.
    assert np.abs(found - expected).max() < 5e-3
    assert np.abs(expected).max() > 1.0
