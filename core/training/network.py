"""The labelling network: a set of points and a set of markers in, who is who out.

Points are tokens that attend to each other, to distances between them, and to the layout's markers, which are encoded
from their places on the hand: one network serves any layout. What the trunk sees of the points are distances alone, so
labels cannot depend on where a hand is or how it is turned, nor on the order of points or markers. Left and right come
from signed volumes that attention spans between points: they change sign in a mirror, exactly, and nothing else does.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from core.labelling.marker_features import N_FEATURES, UNIT_M

WIDTH = 64
HEADS = 4
LAYERS = 6
N_VOLUMES = 4
_N_EDGE, _FARTHEST = 16, 5.0  # radial basis functions up to 25 cm
_HIDDEN_FFN = 96
_SLIM = 4  # numbers by which points choose each other for volumes
_FAR = -1e4


class Answer(NamedTuple):
    """Logits for b clouds of n points under layouts of m markers.

    label: (b, n, m + 1), the last for "none". hidden: (b, m). side: (b, n), positive: of a right hand. early: label as
    it stood after each layer but the last, to be taught too; only while training.
    """

    label: Tensor
    hidden: Tensor
    side: Tensor
    early: list[Tensor]


class Edges(nn.Module):
    """Distances between all as radial basis functions. (b, n, 3) to (b, n, n, 16). Nothing in it is learnt."""

    def __init__(self) -> None:
        super().__init__()
        centres = _FARTHEST * (torch.arange(_N_EDGE) / (_N_EDGE - 1)) ** 1.5
        self.register_buffer("centres", centres)
        self.register_buffer("sharpness", 1.0 / (1.2 * torch.cat([centres[1:2], centres[1:] - centres[:-1]])))

    def forward(self, places: Tensor) -> Tensor:
        """places: (b, n, 3)."""
        difference = places[:, :, None] - places[:, None]
        distance = torch.sqrt((difference * difference).sum(-1, keepdim=True) + 1e-8)
        scaled = (torch.clamp(distance, max=_FARTHEST) - self.centres) * self.sharpness
        return torch.exp(-scaled * scaled)


class Attention(nn.Module):
    """Heads that weigh tokens by content and by distance, and take both along."""

    def __init__(self) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(WIDTH)
        self.project = nn.Linear(WIDTH, 3 * WIDTH)
        self.bias = nn.Linear(_N_EDGE, HEADS, bias=False)
        self.out = nn.Linear(WIDTH + HEADS * _N_EDGE, WIDTH)

    def forward(self, x: Tensor, edges: Tensor, absent: Tensor | None) -> Tensor:
        """x: (b, n, w). edges: (b, n, n, e). absent: (b, 1, 1, n), _FAR where there is no token, or None."""
        q, k, v = (_heads(part) for part in self.project(self.norm(x)).split(WIDTH, dim=-1))
        logits = q @ k.transpose(-1, -2) * (WIDTH // HEADS) ** -0.5 + self.bias(edges).permute(0, 3, 1, 2)
        weights = torch.softmax(logits if absent is None else logits + absent, dim=-1)
        taken = (weights.transpose(1, 2) @ edges).reshape(int(x.shape[0]), -1, HEADS * _N_EDGE)
        out: Tensor = self.out(torch.cat([_joined(weights @ v), taken], dim=-1))
        return out


class Feed(nn.Module):
    """Each token by itself."""

    def __init__(self) -> None:
        super().__init__()
        self.net = nn.Sequential(
            nn.LayerNorm(WIDTH), nn.Linear(WIDTH, _HIDDEN_FFN), nn.ReLU(), nn.Linear(_HIDDEN_FFN, WIDTH)
        )

    def forward(self, x: Tensor) -> Tensor:
        """(b, n, w) to the same."""
        out: Tensor = self.net(x)
        return out


class Reading(nn.Module):
    """Points look at markers."""

    def __init__(self) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(WIDTH)
        self.query = nn.Linear(WIDTH, WIDTH)
        self.out = nn.Linear(WIDTH, WIDTH)

    def forward(self, x: Tensor, keys: Tensor, values: Tensor, absent: Tensor | None) -> Tensor:
        """x: (b, n, w). keys, values: (b, heads, m, w / heads). absent: (b, 1, 1, m)."""
        logits = _heads(self.query(self.norm(x))) @ keys.transpose(-1, -2) * (WIDTH // HEADS) ** -0.5
        weights = torch.softmax(logits if absent is None else logits + absent, dim=-1)
        out: Tensor = self.out(_joined(weights @ values))
        return out


class Volumes(nn.Module):
    """Signed volumes: for every point, three means of points that attention chooses, seen from there; (b, n, 4)."""

    def __init__(self) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(WIDTH)
        self.project = nn.Linear(WIDTH, 2 * 3 * N_VOLUMES * _SLIM)

    def forward(self, x: Tensor, points: Tensor, absent: Tensor | None) -> Tensor:
        """points: (b, n, 3) in units."""
        b, heads = int(x.shape[0]), 3 * N_VOLUMES
        q, k = (
            part.reshape(b, -1, heads, _SLIM).transpose(1, 2)
            for part in self.project(self.norm(x)).split(heads * _SLIM, dim=-1)
        )
        logits = q @ k.transpose(-1, -2)
        weights = torch.softmax(logits if absent is None else logits + absent, dim=-1)  # (b, 12, n, n)
        arms = weights @ points[:, None] - points[:, None]  # (b, 12, n, 3)
        first, second, third = arms.split(N_VOLUMES, dim=1)
        upward = second[..., [1, 2, 0]] * third[..., [2, 0, 1]] - second[..., [2, 0, 1]] * third[..., [1, 2, 0]]
        volume = (first * upward).sum(-1)
        sizes = (arms * arms).sum(-1)
        size = torch.sqrt(sizes[:, :N_VOLUMES] * sizes[:, N_VOLUMES : 2 * N_VOLUMES] * sizes[:, 2 * N_VOLUMES :] + 1e-6)
        return (volume / (0.05 + size)).transpose(1, 2)


class LayoutEncoder(nn.Module):
    """Markers of layouts as tokens. (l, m, 12) to (l, m, w)."""

    def __init__(self) -> None:
        super().__init__()
        self.enter = nn.Sequential(nn.Linear(N_FEATURES + _N_EDGE, WIDTH), nn.ReLU(), nn.Linear(WIDTH, WIDTH))
        self.edges = Edges()
        self.attention = Attention()
        self.feed = Feed()
        self.norm = nn.LayerNorm(WIDTH)

    def forward(self, features: Tensor, there: Tensor | None) -> Tensor:
        """there: (l, m) bool, which are markers."""
        edges = self.edges(features[..., :3])
        around = edges.mean(2) if there is None else (edges * there[:, None, :, None]).sum(2) / _count(there)
        absent = None if there is None else _absent(there)
        x = self.enter(torch.cat([features, around], dim=-1))
        x = x + self.attention(x, edges, absent)
        out: Tensor = self.norm(x + self.feed(x))
        return out


class Labeller(nn.Module):
    """The whole of it. asked: which hand is looked for, 1 the right, -1 the left, 0 any."""

    def __init__(self, layers: int = LAYERS) -> None:
        super().__init__()
        self.layout = LayoutEncoder()
        self.edges = Edges()
        self.enter = nn.Linear(_N_EDGE + 2, WIDTH)
        self.attention = nn.ModuleList(Attention() for _ in range(layers))
        self.reading = nn.ModuleList(Reading() for _ in range(layers))
        self.feed = nn.ModuleList(Feed() for _ in range(layers))
        self.remember = nn.Linear(WIDTH, 2 * WIDTH)
        self.volumes = Volumes()
        self.turned = nn.Linear(N_VOLUMES, WIDTH, bias=False)
        self.last_volumes = Volumes()
        self.sided = nn.Sequential(nn.LayerNorm(WIDTH), nn.Linear(WIDTH, N_VOLUMES))
        self.norm = nn.LayerNorm(WIDTH)
        self.match = nn.Linear(WIDTH, WIDTH)
        self.none = nn.Linear(WIDTH, 1)
        self.missing = Reading()
        self.hidden = nn.Sequential(nn.LayerNorm(WIDTH), nn.Linear(WIDTH, 1))
        self.remember_points = nn.Linear(WIDTH, 2 * WIDTH)

    def forward(
        self, points_m: Tensor, asked: Tensor, markers: Tensor, valid: Tensor | None = None,
        marked: Tensor | None = None,
    ) -> Answer:  # fmt: skip
        """points_m: (b, n, 3) [m]. asked: (b,). markers: (b, m, 12), or (1, m, 12) for all of them. valid: (b, n) bool.
        marked: as markers, (b, m) or (1, m) bool. Without the last two every point and marker counts."""
        memory, kept = self.encoded(markers, marked)
        return self.answered(points_m, asked, memory, kept, valid, marked)

    def encoded(self, markers: Tensor, marked: Tensor | None = None) -> tuple[Tensor, Tensor]:
        """What is kept of layouts, (l, m, w) and (l, m, 2 w): the same for every cloud of one performer."""
        memory = self.layout(markers, marked)
        return memory, self.remember(memory)

    def answered(
        self, points_m: Tensor, asked: Tensor, memory: Tensor, kept: Tensor, valid: Tensor | None = None,
        marked: Tensor | None = None,
    ) -> Answer:  # fmt: skip
        """The same as `forward`, of encoded layouts."""
        points = points_m / UNIT_M
        if valid is None:
            points = points - points.mean(1, keepdim=True)
        else:
            points = points * valid[..., None]
            points = points - points.sum(1, keepdim=True) / _count(valid)
        absent = None if valid is None else _absent(valid)
        unmarked = None if marked is None else _absent(marked)
        keys, values = (_heads(part) for part in kept.split(WIDTH, dim=-1))

        edges = self.edges(points)
        if valid is not None:
            edges = edges * valid[:, None, :, None]
        around = edges.mean(2) if valid is None else edges.sum(2) / _count(valid)
        spread = torch.clamp(torch.sqrt((points * points).sum(-1, keepdim=True) + 1e-8), max=_FARTHEST)
        told = (asked * asked)[:, None, None] * self.enter.weight[:, -1]
        x = functional.linear(torch.cat([around, spread], dim=-1), self.enter.weight[:, :-1], self.enter.bias) + told
        early = []
        for i in range(len(self.attention)):
            x = x + self.attention[i](x, edges, absent)
            if i == 1:
                x = x + self.turned(self.volumes(x, points, absent) * asked[:, None, None])
            x = x + self.reading[i](x, keys, values, unmarked)
            x = x + self.feed[i](x)
            if self.training and i < len(self.attention) - 1:
                early.append(self._scores(self.norm(x), memory, unmarked))

        final = self.norm(x)
        seen_keys, seen_values = (_heads(part) for part in self.remember_points(final).split(WIDTH, dim=-1))
        looking = memory + self.missing(memory, seen_keys, seen_values, absent)
        side = (self.sided(x) * self.last_volumes(x, points, absent)).sum(-1)
        return Answer(self._scores(final, memory, unmarked), self.hidden(looking)[..., 0], 4.0 * side, early)

    def _scores(self, x: Tensor, memory: Tensor, unmarked: Tensor | None) -> Tensor:
        """(b, n, m + 1)."""
        scores = self.match(x) @ memory.transpose(-1, -2) * WIDTH**-0.5
        if unmarked is not None:
            scores = scores + unmarked[:, 0]
        return torch.cat([scores, self.none(x)], dim=-1)


def _absent(there: Tensor) -> Tensor:
    return torch.where(there, 0.0, _FAR)[:, None, None]


def _count(there: Tensor) -> Tensor:
    return there.sum(1)[:, None, None]


def _heads(x: Tensor) -> Tensor:
    """(b, n, w) to (b, heads, n, w / heads)."""
    return x.reshape(int(x.shape[0]), -1, HEADS, WIDTH // HEADS).transpose(1, 2)


def _joined(x: Tensor) -> Tensor:
    return x.transpose(1, 2).reshape(int(x.shape[0]), -1, WIDTH)
