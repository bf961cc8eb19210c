#!/usr/bin/env python3
"""Error, bytes and speed of presets and other settings of the fit, on one cloud.

Trains a map of the cloud, of level 0 alone, with each setting, one thread, evaluates it and writes a table in Markdown.
Speed is cubes a second of CPU time of the whole `gdfmap train` process, the best of several runs, which a
busy machine disturbs least. --plot needs Debian's python3-cairo.

  benchmarks/frontier.py cloud.ply [--cube-size M] [--samples N] [--runs N] [--plot docs/frontier.png]
"""

import argparse
import json
import math
import os
import resource
import shutil
import subprocess
import tempfile

PRESETS = ["fast", "balanced", "best"]
# Thresholds in thousandths of the cube size, for the curve that the presets lie on.
THRESHOLDS = [40, 20, 12.5, 8, 5]
CURVE_STEPS = "[8, 16, 32, 64]"


def settings(cube_size):
    """Name and YAML of each setting."""
    for preset in PRESETS:
        yield preset, f"fit: {{preset: {preset}}}\n"
    for threshold in THRESHOLDS:
        metres = threshold * 1e-3 * cube_size
        yield (f"{1000 * metres:g} mm, K to 64",
               f"adaptive: {{populated_steps: {CURVE_STEPS}, empty_steps: {CURVE_STEPS}, "
               f"mae_threshold: {metres:g}}}\n")


class Program:
    def __init__(self, path):
        self.path = path

    def run(self, *arguments):
        result = subprocess.run([self.path, *arguments], stdout=subprocess.PIPE, check=True)
        return result.stdout.decode()

    def json(self, *arguments):
        return json.loads(self.run(*arguments, "--json"))


def cpu_seconds():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def train(program, ingested, map_path, config_path):
    """Trains a copy of the ingested map; cubes fitted and CPU time."""
    shutil.rmtree(map_path, ignore_errors=True)
    shutil.copytree(ingested, map_path)
    before = cpu_seconds()
    report = program.json("train", map_path, "--config", config_path, "--threads", "1")
    return report["num_cubes_fitted"], cpu_seconds() - before


def measure(program, ingested, name, yaml, directory, options):
    """Figures of one setting."""
    map_path = os.path.join(directory, "trained.gdfmap")
    config_path = os.path.join(directory, "fit.yaml")
    with open(config_path, "w") as file:
        file.write(yaml)
    runs = [train(program, ingested, map_path, config_path) for _ in range(options.runs)]
    tiles = [tile for tile in program.json("tile", map_path, "--list")["tiles"]
             if tile["level"] == 0]
    cubes = sum(tile["num_cubes"] for tile in tiles)
    return {
        "name": name,
        "cubes_per_second": max(fitted / seconds for fitted, seconds in runs),
        "bytes": sum(tile["num_bytes"] for tile in tiles) / cubes,
        "gaussians": sum(tile["num_gaussians"] for tile in tiles) / cubes,
        "errors": program.json("evaluate", map_path, "--samples", str(options.samples)),
    }


def table(rows):
    lines = ["| setting | cubes/s (CPU, one thread) | Gaussians, bytes per cube | MAE / RMSE "
             "| populated / empty / outer shell: MAE | norm off the medial axis "
             "| angle off it, 0.1–0.3 / 0.3–1 m |",
             "|---|---|---|---|---|---|---|"]
    for row in rows:
        e = row["errors"]
        near, far = [band["off_axis_angle_mean_deg"] for band in e["gradient_bands"]]
        lines.append(
            f"| {row['name']} | {row['cubes_per_second']:.0f} "
            f"| {row['gaussians']:.1f}, {row['bytes']:.0f} "
            f"| {e['mae']:.4f} / {e['rmse']:.4f} m "
            f"| {e['populated']['mae']:.4f} / {e['empty']['mae']:.4f} "
            f"/ {e['outer_shell']['mae']:.4f} m "
            f"| {e['off_axis_norm_mean']:.3f} ± {e['off_axis_norm_std']:.3f} "
            f"| {near:.1f}° / {far:.1f}° |")
    return "\n".join(lines)


class Panel:
    """Logarithmic axes within a rectangle of a picture."""

    FONT = 15

    def __init__(self, context, left, top, width, height, x_label, y_label, xs, ys):
        self.c = context
        self.left, self.top, self.width, self.height = left, top, width, height
        self.x_label, self.y_label = x_label, y_label
        self.x_range, self.y_range = self.around(xs), self.around(ys)

    @staticmethod
    def around(values):
        return math.log10(min(values) / 1.25), math.log10(max(values) * 1.25)

    def place(self, x, y):
        def share(value, limits):
            return (math.log10(value) - limits[0]) / (limits[1] - limits[0])
        return (self.left + share(x, self.x_range) * self.width,
                self.top + (1 - share(y, self.y_range)) * self.height)

    def text(self, text, x, y, align=0.0, angle=0.0):
        self.c.save()
        self.c.translate(x, y)
        self.c.rotate(angle)
        self.c.move_to(-align * self.c.text_extents(text).x_advance, 0.36 * self.FONT)
        self.c.show_text(text)
        self.c.restore()
        self.c.new_path()

    @staticmethod
    def ticks(limits):
        return [m * 10.0 ** e for e in range(math.floor(limits[0]), math.ceil(limits[1]) + 1)
                for m in (1, 1.5, 2, 3, 5, 7) if limits[0] <= math.log10(m * 10.0 ** e) <= limits[1]]

    def draw_axes(self):
        bottom = self.top + self.height
        for x in self.ticks(self.x_range):
            px, _ = self.place(x, 10 ** self.y_range[0])
            self.line([(px, self.top), (px, bottom)], 0.85, 1)
            self.text(f"{x:g}", px, bottom + 16, 0.5)
        for y in self.ticks(self.y_range):
            _, py = self.place(10 ** self.x_range[0], y)
            self.line([(self.left, py), (self.left + self.width, py)], 0.85, 1)
            self.text(f"{y:g}", self.left - 8, py, 1.0)
        self.c.set_source_rgb(0, 0, 0)
        self.c.set_line_width(1)
        self.c.rectangle(self.left, self.top, self.width, self.height)
        self.c.stroke()
        self.text(self.x_label, self.left + self.width / 2, bottom + 42, 0.5)
        self.text(self.y_label, self.left - 72, self.top + self.height / 2, 0.5, -math.pi / 2)

    def line(self, points, grey, width, dashes=()):
        self.c.set_source_rgb(grey, grey, grey)
        self.c.set_line_width(width)
        self.c.set_dash(dashes)
        for point in points:
            self.c.line_to(*point)
        self.c.stroke()
        self.c.set_dash(())
        self.c.set_source_rgb(0, 0, 0)

    def dot(self, point, radius, color):
        self.c.arc(*point, radius, 0, 2 * math.pi)
        self.c.set_source_rgb(*color)
        self.c.fill_preserve()
        self.c.set_source_rgb(0, 0, 0)
        self.c.set_line_width(1)
        self.c.stroke()

    def draw(self, rows, key):
        self.draw_axes()
        curve = [row for row in rows if row["name"] not in PRESETS]
        self.line([self.place(row[key], row["errors"]["mae"]) for row in curve], 0.45, 2, (6, 4))
        for row in rows:
            point = self.place(row[key], row["errors"]["mae"])
            if row["name"] in PRESETS:
                self.dot(point, 7, (0.1, 0.2, 0.5))
                self.text(row["name"], point[0], point[1] + 20, 0.5)
            else:
                self.dot(point, 4, (0.95, 0.85, 0.4))


def plot(rows, path, title):
    import cairo
    surface = cairo.ImageSurface(cairo.FORMAT_RGB24, 1240, 540)
    context = cairo.Context(surface)
    context.set_source_rgb(1, 1, 1)
    context.paint()
    context.set_source_rgb(0, 0, 0)
    context.select_font_face("DejaVu Sans")
    context.set_font_size(Panel.FONT)
    mae = [row["errors"]["mae"] for row in rows]
    for left, label, key in ((100, "bytes per cube", "bytes"),
                             (720, "cubes a second of CPU time, one thread",
                              "cubes_per_second")):
        panel = Panel(context, left, 60, 490, 400, label, "mean absolute error [m]",
                      [row[key] for row in rows], mae)
        panel.draw(rows, key)
    Panel(context, 0, 0, 1, 1, "", "", [1], [1]).text(title, 620, 28, 0.5)
    surface.write_to_png(path)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cloud")
    parser.add_argument("--gdfmap", default="build/release/bin/gdfmap", metavar="PROGRAM")
    parser.add_argument("--cube-size", type=float, default=1.0, metavar="M")
    parser.add_argument("--samples", type=int, default=100_000, metavar="N")
    parser.add_argument("--runs", type=int, default=3, metavar="N")
    parser.add_argument("--plot", metavar="FILE.png")
    return parser.parse_args()


def main():
    options = arguments()
    program = Program(options.gdfmap)
    with tempfile.TemporaryDirectory() as directory:
        ingested = os.path.join(directory, "ingested.gdfmap")
        program.run("ingest", ingested, options.cloud, "--cube-size", str(options.cube_size),
                    "--levels", "1", "--quiet")
        rows = [measure(program, ingested, name, yaml, directory, options)
                for name, yaml in settings(options.cube_size)]
    print(table(rows))
    if options.plot:
        plot(rows, options.plot,
             f"{os.path.basename(options.cloud)}: presets (dark), and a curve of thresholds with up "
             "to 64 Gaussians")


if __name__ == "__main__":
    main()
