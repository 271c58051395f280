"""Runs the output of a tracker through sila.Stream, frame by frame, and draws the weighted paths on the frames.

    python predict_on_video.py tracks.txt --camera camera.json --fps 25 --frames img1 --model corner.sila --out drawn
    python predict_on_video.py --out drawn            # simulated pedestrians, black frames

tracks.txt: MOTChallenge, frame,id,left,top,width,height,..., as ByteTrack, BoT-SORT and boxmot write it. camera.json:
four points known in the image and on the ground (docs/formats.md). Needs pandas and Pillow.
"""

import argparse
from pathlib import Path

import numpy as np
import sila
from PIL import Image, ImageDraw
from simulated_tracker import simulated


def draw(frame: Image.Image, boxes: np.ndarray, predictions: sila.Predictions, stream: sila.Stream) -> None:
    """Boxes, and of each prediction the paths of 5 % and more: the wider, the more likely."""
    pen = ImageDraw.Draw(frame, "RGBA")
    for _, left, top, width, height in boxes:
        pen.rectangle([left, top, left + width, top + height], outline="white")
    for prediction in predictions:
        weights: dict[bytes, float] = {}  # of paths: modes of the variant "wide" have that of another mode
        for mode in prediction.modes:
            weights[mode.path_m.tobytes()] = weights.get(mode.path_m.tobytes(), 0.0) + mode.weight
        for index, (path_m, weight) in reversed(list(enumerate(weights.items()))):
            path = [tuple(p) for p in stream.to_image(np.frombuffer(path_m).reshape(-1, 2)) if np.isfinite(p).all()]
            colour = ["#ffd21f", "#4cc9f0", "#f72585", "#80ed99"][index % 4] + f"{int(80 + 175 * weight):02x}"
            if weight >= 0.05 and path:
                pen.line(path, fill=colour, width=1 + int(5 * weight))
                pen.text(path[-1], f"{weight:.0%}", fill=colour)


def run(options: argparse.Namespace) -> None:
    if options.tracks and not options.camera:
        raise ValueError("a MOT file is in pixels: expected --camera")
    if not options.fps > 0 or options.every < 1:
        raise ValueError(f"expected --fps and --every above 0, found {options.fps:g} and {options.every}")
    options.out.mkdir(parents=True, exist_ok=True)
    tracks, camera = (options.tracks, options.camera) if options.tracks else simulated(options.out)
    if not (lines := tracks.read_text().strip().splitlines()):
        raise ValueError(f"{tracks}: expected lines of MOTChallenge, found none")
    rows = np.loadtxt(lines, delimiter=",", usecols=range(6), ndmin=2)
    pictures = dict(enumerate(sorted(options.frames.iterdir()), 1)) if options.frames else {}
    with sila.Stream(options.model, camera=camera, batch=10) as stream:
        for number in range(1, int(rows[:, 0].max()) + 1):
            boxes = rows[rows[:, 0] == number, 1:]  # id, left, top, width, height
            feet = {int(box[0]): (box[1] + box[3] / 2, box[2] + box[4]) for box in boxes}
            predictions = stream.update(number / options.fps, feet)
            if number % options.every == 0:
                picture = Image.open(pictures[number]) if number in pictures else Image.new("RGB", (1280, 720))
                frame = picture.convert("RGB")
                draw(frame, boxes, predictions, stream)
                frame.save(options.out / f"{number:06d}.png")
    print(stream, stream.counts["rejected"])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Draws predicted paths on the frames of a tracker.")
    parser.add_argument("tracks", nargs="?", type=Path, help="MOT file; without one it is simulated")
    parser.add_argument("--camera", type=Path)
    parser.add_argument("--fps", type=float, default=10.0, help="frames per second")
    parser.add_argument("--frames", type=Path, help="folder of pictures whose sorted names are the frames from 1 on")
    parser.add_argument("--model", type=Path, help="model file to create or to continue")
    parser.add_argument("--every", type=int, default=10, help="frames between two drawn ones")
    parser.add_argument("--out", type=Path, default=Path("drawn"))
    try:
        run(parser.parse_args())
    except (OSError, ValueError) as error:
        parser.exit(2, f"{parser.prog}: {error}\n")
