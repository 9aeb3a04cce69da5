"""Laws of components with two or three ports."""

from collections.abc import Mapping, Sequence

import numpy as np

from .._analyse.power_ports import RATES, SAME, Local, Series, series


def is_lossless(local: Local, i: int, j: int, shares: Mapping[str, float | None]) -> bool:
    """Whether two ports have proportional efforts and proportional flows without losses, as in a transformer."""
    if local.is_driven or any(ratio is None for ratio in shares.values()):
        return False
    return all(
        ratio is not None and abs(local.offset((kind, j)) - ratio * local.offset((kind, i))) < SAME
        for kind, ratio in shares.items()
    )


def weighted(local: Local, ports: Sequence[int]) -> tuple[np.ndarray, list[Series]] | None:
    """Weights of the flows of three ports, and the impedance of each: e_i = Z_i f_i + weight_i effort."""
    flows, efforts = [("f", i) for i in ports], [("e", i) for i in ports]
    found = local.relations(flows)
    if len(found) != 1 or np.min(np.abs(found[0])) < SAME * np.max(np.abs(found[0])):
        return None
    weights = found[0] / found[0][np.argmin(np.abs(found[0]))]
    basis = np.linalg.svd(weights[None])[2][1:]
    away = np.eye(3) - np.outer(weights, weights) / (weights @ weights)
    values = []
    for which in range(len(RATES)):
        rows = local.relations([*efforts, *flows], which)
        lines, targets = [], []
        for motion in basis:
            pushed = np.linalg.lstsq(rows[:, :3], -rows[:, 3:] @ motion, rcond=1e-10)[0]
            if np.max(np.abs(rows[:, :3] @ pushed + rows[:, 3:] @ motion)) > SAME * np.max(np.abs(rows)):
                return None
            lines.append(away * motion)
            targets.append(away @ pushed)
        left, right = np.concatenate(lines), np.concatenate(targets)
        solution = np.linalg.lstsq(left, right, rcond=1e-10)[0]
        size = np.max(np.abs(right), initial=0.0)
        if np.max(np.abs(left @ solution - right), initial=0.0) > SAME * size:
            return None
        values.append(np.where(np.abs(solution) < SAME * size, 0.0, solution))
    laws = [series(column) for column in np.array(values).T]
    return None if any(law is None for law in laws) else (weights, [law for law in laws if law is not None])
