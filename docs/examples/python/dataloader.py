"""Feeds a torch DataLoader with pictures of a large folder of objects: python dataloader.py FOLDER

Each worker process loads a model when it needs it, and renders it from a direction that depends on the index alone.
"""

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

import blinn

SIZE = (128, 128)


class Views:
    """Pictures of all models below a folder, several views of each. A map-style dataset of torch."""

    def __init__(self, folder: Path, views: int = 4) -> None:
        self.views = views
        self.models = sorted(path for path in folder.rglob("*") if path.suffix in {".glb", ".gltf", ".obj"})

    def __len__(self) -> int:
        return len(self.models) * self.views

    def __getitem__(self, index: int) -> dict[str, Any]:
        if not 0 <= index < len(self):
            raise IndexError(index)
        model, view = divmod(index, self.views)
        angle = 2 * math.pi * view / self.views
        try:
            scene = blinn.load(self.models[model])
            low, high = scene.bounds
        except blinn.LoadError as error:
            # A folder of a million downloads has broken files. An empty picture keeps the batch complete.
            print(error, file=sys.stderr)
            return {"image": np.zeros((3, *SIZE[::-1]), np.float32), "depth": np.zeros(SIZE[::-1], np.float32)}
        centre, radius = (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, 1e-6)
        eye = centre + 3 * radius * np.array([math.sin(angle), 0.4, math.cos(angle)])
        camera = blinn.Camera.look_at(eye, centre, yfov=40)
        picture = scene.render(camera, size=SIZE, layers="depth", background="transparent", lights="three-point")
        image = picture.rgba[:, :, :3].astype(np.float32).transpose(2, 0, 1) / 255
        return {"image": image, "depth": np.nan_to_num(picture["depth"], posinf=0.0)}


def use_one_thread(worker: int) -> None:
    """Limit a worker to one thread: the workers share the cores."""
    blinn.set_threads(1)


def main(folder: Path) -> None:
    """Print the shapes of all batches."""
    from torch.utils.data import DataLoader

    loader = DataLoader(Views(folder), batch_size=16, num_workers=8, worker_init_fn=use_one_thread)
    for batch in loader:
        print(tuple(batch["image"].shape), tuple(batch["depth"].shape))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
