"""Networks that find apples: one sees depth alone and is small, one sees colour as well. `train_detector.py` trains them."""

import torch
from torch import nn
from torch.nn import functional

# Pixels of a cell of a network's map, and of which the sides of its input are multiples.
CELL, MULTIPLE = 4, 16
# Depths that count as measured [m], radius of a typical apple [m], and its radius in the image that gives the feature 0 [px].
NEAR, FAR, RADIUS, TYPICAL_PX = 0.2, 4.0, 0.04, 8.0
# Relief that gives the features 1, near and far around a pixel [m].
RELIEF_NEAR, RELIEF_FAR = 0.02, 0.08
# Least measured share of a cell whose mean depth counts.
LEAST_SHARE = 0.05


def conv(inputs, outputs, stride=1, size=3):
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, size, stride, size // 2, bias=False), nn.BatchNorm2d(outputs), nn.ReLU()
    )


def separable(inputs, outputs, stride=1):
    """A convolution of each channel by itself, and then one across channels."""
    return nn.Sequential(
        nn.Conv2d(inputs, inputs, 3, stride, 1, groups=inputs, bias=False), nn.BatchNorm2d(inputs),
        nn.Conv2d(inputs, outputs, 1, bias=False), nn.BatchNorm2d(outputs), nn.ReLU(),
    )


class Residual(nn.Module):
    """A separable convolution whose result is added to its input."""

    def __init__(self, channels):
        super().__init__()
        self.inner = separable(channels, channels)

    def forward(self, x):
        return x + self.inner(x)


def around(x):
    """Mean over a cell and its neighbours."""
    return functional.avg_pool2d(x, 3, 1, 1)


def larger(x, factor=2):
    return functional.interpolate(x, scale_factor=factor, mode="nearest")


class Detector(nn.Module):
    """Depth [n, 1, rows, columns] in metres (0: not measured), the focal length [1] in pixels, and if it sees colour the image [n, 3, rows, columns] in sRGB from 0 to 1,
    to a map [n, 5, rows / 4, columns / 4]: probability that the centre of an apple is in the cell, its place right of and below the cell's centre in cells, its
    radius in pixels, and the share of the cell's pixels that show an apple."""

    def __init__(self, channels):
        """`channels` before the last layer."""
        super().__init__()
        self.head = nn.Conv2d(channels, 5, 1)
        nn.init.constant_(self.head.bias[:1], -4.0)
        nn.init.constant_(self.head.bias[4:], -2.0)
        # Slope and offset that make probabilities of the first output.
        self.calibration = nn.Parameter(torch.tensor([1.0, 0.0]), requires_grad=False)

    def forward(self, depth, focal, colour=None):
        y = self.raw(depth, focal.reshape(-1, 1, 1, 1), colour)
        score = torch.sigmoid(y[:, 0:1] * self.calibration[0] + self.calibration[1])
        return torch.cat([score, y[:, 1:3], TYPICAL_PX * torch.exp(y[:, 3:4]), torch.sigmoid(y[:, 4:])], 1)


class DepthDetector(Detector):
    """Sees depth alone; 59,000 weights."""

    def __init__(self):
        super().__init__(24)
        self.second = conv(2, 12, 2)
        self.fourth = conv(12, 24, 2)
        self.joined = nn.Sequential(separable(27, 24), Residual(24))
        self.eighth = nn.Sequential(separable(24, 48, 2), Residual(48), Residual(48))
        self.sixteenth = nn.Sequential(separable(48, 96, 2), Residual(96), Residual(96), Residual(96))
        self.to_eighth = nn.Conv2d(96, 48, 1)
        self.at_eighth = Residual(48)
        self.to_quarter = nn.Conv2d(48, 24, 1)
        self.at_quarter = Residual(24)

    def raw(self, depth, focal, _=None):
        valid = ((depth > NEAR) & (depth < FAR)).to(depth.dtype)
        z = depth * valid
        # Only the relief to the surroundings is computed for each pixel; all else for cells of 4 x 4.
        total, count = functional.avg_pool2d(z, 4), functional.avg_pool2d(valid, 4)
        mean = around(total) / (around(count) + 1e-4)
        near = torch.clamp((z - larger(mean, 4)) * (1 / RELIEF_NEAR), -2.0, 2.0) * valid
        coarse, measured = functional.avg_pool2d(total, 4), functional.avg_pool2d(count, 4)
        beyond = larger(around(coarse) / (around(measured) + 1e-4), 4)
        far = torch.clamp((total / (count + 1e-4) - beyond) * (1 / RELIEF_FAR), -2.0, 2.0) * (count > LEAST_SHARE).to(depth.dtype)
        size = torch.log(focal * (RADIUS / TYPICAL_PX) / torch.clamp(mean, NEAR, FAR))
        quarter = self.fourth(self.second(torch.cat([valid, near], 1)))
        quarter = self.joined(torch.cat([quarter, far, size, count], 1))
        eighth = self.eighth(quarter)
        eighth = self.at_eighth(eighth + larger(self.to_eighth(self.sixteenth(eighth))))
        return self.head(self.at_quarter(quarter + larger(self.to_quarter(eighth))))


class ColourDetector(Detector):
    """Sees depth and colour; 414,000 weights."""

    def __init__(self):
        super().__init__(48)
        self.second = conv(7, 24, 2)
        self.fourth = nn.Sequential(conv(24, 32, 2), conv(32, 32), conv(32, 32))
        self.eighth = nn.Sequential(conv(32, 64, 2), conv(64, 64), conv(64, 64))
        self.sixteenth = nn.Sequential(conv(64, 96, 2), conv(96, 96), conv(96, 96))
        self.to_eighth = nn.Sequential(conv(160, 64, 1, 1), conv(64, 64))
        self.to_quarter = nn.Sequential(conv(96, 48, 1, 1), conv(48, 48))

    @staticmethod
    def mean_around(x, valid, size):
        """Mean depth of the measured pixels around each pixel: over cells of `size` x `size` pixels and their neighbours."""
        total, count = (around(functional.avg_pool2d(t, size)) for t in (x, valid))
        return larger(total / (count + 1e-4), size)

    def raw(self, depth, focal, colour):
        valid = ((depth > NEAR) & (depth < FAR)).to(depth.dtype)
        z = depth * valid
        near = torch.clamp((z - self.mean_around(z, valid, 4)) / RELIEF_NEAR, -2.0, 2.0) * valid
        far = torch.clamp((z - self.mean_around(z, valid, 16)) / RELIEF_FAR, -2.0, 2.0) * valid
        size = torch.log(focal * RADIUS / torch.clamp(z, NEAR, FAR) / TYPICAL_PX) * valid
        half = self.second(torch.cat([valid, near, far, size, 4.0 * colour - 2.0], 1))
        quarter = self.fourth(half)
        eighth = self.eighth(quarter)
        eighth = self.to_eighth(torch.cat([larger(self.sixteenth(eighth)), eighth], 1))
        return self.head(self.to_quarter(torch.cat([larger(eighth), quarter], 1)))
