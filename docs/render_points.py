#!/usr/bin/env python3
"""Draws the points that `gdfmap surface --project` writes, shaded, in parallel projection.

  docs/render_points.py points.ply picture.png [--azimuth 40] [--elevation 35] [--width 1200]

Needs Debian's python3-numpy and python3-cairo.
"""

import argparse

import cairo
import numpy as np

TYPES = {"double": "<f8", "float": "<f4"}


def read_points(path):
    with open(path, "rb") as file:
        fields, count = [], 0
        for line in iter(lambda: file.readline().decode().split(), ["end_header"]):
            if line[:2] == ["element", "vertex"]:
                count = int(line[2])
            elif line[0] == "property":
                fields.append((line[2], TYPES[line[1]]))
        return np.fromfile(file, dtype=fields, count=count)


def columns(points, *names):
    return np.stack([points[name].astype(float) for name in names], axis=1)


def view(azimuth, elevation):
    """Rows: to the right of the picture, up, and towards the eye."""
    a, e = np.radians([azimuth, elevation])
    eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.stack([right, np.cross(eye, right), eye])


def colours(points, axes):
    """Height as hue, light from above the eye's left shoulder; the sign of a normal means nothing."""
    normals = columns(points, "nx", "ny", "nz")
    light = axes.T @ np.array([-0.4, 0.6, 0.7])
    shade = 0.35 + 0.65 * np.abs(normals @ light) / np.linalg.norm(light)
    low, high = np.percentile(points["z"], [1, 99])
    t = np.clip((points["z"] - low) / max(high - low, 1e-9), 0, 1)[:, None]
    blue, sand = np.array([0.35, 0.55, 0.75]), np.array([0.95, 0.85, 0.65])
    return shade[:, None] * (blue + t * (sand - blue))


def draw(points, axes, width):
    place = columns(points, "x", "y", "z") @ axes.T
    low, high = place.min(axis=0), place.max(axis=0)
    scale = (width - 20) / (high[0] - low[0])
    height = int(scale * (high[1] - low[1])) + 20
    column, row = (10 + scale * (place[:, :2] - low[:2])).astype(int).T
    # A point covers 2 x 2 pixels; a pixel has the mean colour of the points that are nearest to the eye, to 3 pixels.
    pixels = [(height - 1 - row - dy) * width + column + dx for dx in range(2) for dy in range(2)]
    depth = np.full(height * width, -np.inf)
    for pixel in pixels:
        np.maximum.at(depth, pixel, place[:, 2])
    rgb = colours(points, axes)
    sums, counts = np.zeros((3, height * width)), np.zeros(height * width)
    for pixel in pixels:
        near = place[:, 2] > depth[pixel] - 3 / scale
        counts += np.bincount(pixel[near], minlength=height * width)
        for channel in range(3):
            sums[channel] += np.bincount(pixel[near], rgb[near, channel], minlength=height * width)
    means = np.where(counts > 0, 255 * sums / np.maximum(counts, 1), 255).astype(np.uint32)
    return (means[0] << 16 | means[1] << 8 | means[2]).reshape(height, width)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("points")
    parser.add_argument("picture")
    parser.add_argument("--azimuth", type=float, default=40.0, help="of the eye, degrees from x to y")
    parser.add_argument("--elevation", type=float, default=35.0)
    parser.add_argument("--width", type=int, default=1200)
    options = parser.parse_args()
    picture = draw(read_points(options.points), view(options.azimuth, options.elevation), options.width)
    height, width = picture.shape
    stride = cairo.ImageSurface.format_stride_for_width(cairo.FORMAT_RGB24, width)
    cairo.ImageSurface.create_for_data(memoryview(picture).cast("B"), cairo.FORMAT_RGB24, width, height,
                                       stride).write_to_png(options.picture)


if __name__ == "__main__":
    main()
