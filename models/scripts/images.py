"""Writes one image of every format that glTF and MTL files use, for the decoder's test. Needs Pillow and numpy.

    PYTHON images.py OUT        OUT: models/tests/images

Each shows the same 16 × 8 picture, as far as the format allows: left half red, right half green. Grey images show
light and dark; images with alpha are opaque in the left half only.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

W, H = 16, 8


def halves(left, right, dtype=np.uint8):
    picture = np.zeros((H, W, len(left)), dtype)
    picture[:, : W // 2], picture[:, W // 2 :] = left, right
    return picture


def main(out):
    out.mkdir(parents=True, exist_ok=True)
    rgb = Image.fromarray(halves((255, 0, 0), (0, 255, 0)))
    rgba = Image.fromarray(halves((255, 0, 0, 255), (0, 255, 0, 51)))
    grey = Image.fromarray(halves((204,), (51,))[..., 0])
    rgb.save(out / "rgb.png")
    rgba.save(out / "rgba.png")
    grey.save(out / "grey.png")
    Image.fromarray(halves((204, 255), (51, 51)), "LA").save(out / "grey_alpha.png")
    deep = Image.fromarray(halves((52428,), (13107,), np.uint16)[..., 0])
    deep.save(out / "grey_16.png")
    deep.save(out / "grey_16.tif", compression="tiff_adobe_deflate")
    rgb.convert("P", palette=Image.Palette.ADAPTIVE, colors=4).save(out / "palette.png")
    paletted = rgb.convert("P", palette=Image.Palette.ADAPTIVE, colors=2)
    green = paletted.getpixel((W - 1, 0))
    paletted.save(out / "palette_transparent.png", transparency=bytes([51 if i == green else 255 for i in range(2)]))
    grey.point(lambda v: 255 * (v > 128), "1").save(out / "one_bit.png")
    rgb.save(out / "rgb.jpg", quality=95, subsampling=0)
    rgb.save(out / "progressive.jpg", quality=95, subsampling=2, progressive=True)
    grey.save(out / "grey.jpg", quality=95)
    rgb.convert("CMYK").save(out / "cmyk.jpg", quality=95, subsampling=0)
    rgba.save(out / "lossless.webp", lossless=True, exact=True)
    rgb.save(out / "lossy.webp", quality=95)
    rgb.save(out / "rgb.bmp")
    rgba.save(out / "rgba.tga")
    rgb.save(out / "rgb.tif")
    rgba.save(out / "lzw.tif", compression="tiff_lzw")
    paletted.save(out / "palette.tif", compression="packbits")
    rgb.save(out / "frames.gif", save_all=True, append_images=[grey], duration=100)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
